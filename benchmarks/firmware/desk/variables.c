/* The firmware's log variables and parameters by name, as "group.name". */
#include "variables.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "log.h"
#include "param.h"

#include "cfassert.h"

#define MOST_VARIABLES 2000
#define NAME_BYTES 64

struct table {
    int count;
    struct {
        char name[NAME_BYTES];
        int type;
        volatile void *address;
    } variables[MOST_VARIABLES];
};

static struct table logs;
static struct table parameters;

static void add(struct table *table, const char *group, const char *name, int type, volatile void *address)
{
    const int number = table->count++;

    ASSERT(table->count <= MOST_VARIABLES);
    snprintf(table->variables[number].name, NAME_BYTES, "%s.%s", group, name);
    table->variables[number].type = type;
    table->variables[number].address = address;
}

void desk_add_log(const char *group, const char *name, int type, const volatile void *address)
{
    add(&logs, group, name, type, (volatile void *)address);
}

void desk_add_parameter(const char *group, const char *name, int type, volatile void *address)
{
    add(&parameters, group, name, type, address);
}

static int find(const struct table *table, const char *name)
{
    for (int k = 0; k < table->count; k++) {
        if (strcmp(table->variables[k].name, name) == 0) {
            return k;
        }
    }
    return -1;
}

static double value(const struct table *table, int number)
{
    const volatile void *const address = table->variables[number].address;

    switch (table->variables[number].type) {
    case DESK_UINT8: return *(const volatile uint8_t *)address;
    case DESK_UINT16: return *(const volatile uint16_t *)address;
    case DESK_UINT32: return *(const volatile uint32_t *)address;
    case DESK_INT8: return *(const volatile int8_t *)address;
    case DESK_INT16: return *(const volatile int16_t *)address;
    case DESK_INT32: return *(const volatile int32_t *)address;
    default: return *(const volatile float *)address;
    }
}

double variables_log(const char *name)
{
    const int number = find(&logs, name);

    return (number < 0) ? NAN : value(&logs, number);
}

bool variables_set(const char *name, double wanted)
{
    const int number = find(&parameters, name);
    volatile void *address;

    if (number < 0) {
        return false;
    }
    address = parameters.variables[number].address;
    switch (parameters.variables[number].type) {
    case DESK_UINT8: *(volatile uint8_t *)address = (uint8_t)wanted; break;
    case DESK_UINT16: *(volatile uint16_t *)address = (uint16_t)wanted; break;
    case DESK_UINT32: *(volatile uint32_t *)address = (uint32_t)wanted; break;
    case DESK_INT8: *(volatile int8_t *)address = (int8_t)wanted; break;
    case DESK_INT16: *(volatile int16_t *)address = (int16_t)wanted; break;
    case DESK_INT32: *(volatile int32_t *)address = (int32_t)wanted; break;
    default: *(volatile float *)address = (float)wanted; break;
    }
    return true;
}

logVarId_t logGetVarId(const char *group, const char *name)
{
    char whole[NAME_BYTES];

    snprintf(whole, sizeof whole, "%s.%s", group, name);
    return (logVarId_t)find(&logs, whole);
}

bool logVarIdIsValid(logVarId_t id) { return id != UINT16_MAX; }

float logGetFloat(logVarId_t id) { return (float)value(&logs, id); }
