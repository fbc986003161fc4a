/* Stub of the Crazyflie's firmware: one group, which the host's program reads by name. */
#ifndef LOG_H
#define LOG_H

#include <stdbool.h>
#include <stdint.h>

struct variable {
    const char *type;
    const char *name;
    void *address;
};

typedef uint16_t logVarId_t;

logVarId_t logGetVarId(const char *group, const char *name);
void *logGetAddress(logVarId_t id);
static inline bool logVarIdIsValid(logVarId_t id) { return id != 0xffffU; }

extern const struct variable host_logged[];
extern const struct variable host_parameters[];

#define LOG_UINT8 "uint8_t"
#define LOG_UINT16 "uint16_t"
#define LOG_UINT32 "uint32_t"
#define LOG_FLOAT "float"

#define LOG_GROUP_START(group) const struct variable host_logged[] = { { "group", #group, 0 },
#define LOG_ADD(variable_type, variable_name, variable_address) { variable_type, #variable_name, variable_address },
#define LOG_GROUP_STOP(group) { 0, #group, 0 } };

#endif
