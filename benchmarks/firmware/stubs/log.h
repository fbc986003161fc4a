/* In the place of the firmware's log.h: every variable of a group is entered in a table before main (desk/variables.c). */
#ifndef LOG_H
#define LOG_H

#include <stdbool.h>
#include <stdint.h>

#include "desk_variables.h"

#define LOG_UINT8 DESK_UINT8
#define LOG_UINT16 DESK_UINT16
#define LOG_UINT32 DESK_UINT32
#define LOG_INT8 DESK_INT8
#define LOG_INT16 DESK_INT16
#define LOG_INT32 DESK_INT32
#define LOG_FLOAT DESK_FLOAT
#define LOG_FP16 DESK_UINT16

typedef uint16_t logVarId_t;

typedef uint8_t (*logAcquireUInt8)(uint32_t timestamp, void *data);
typedef uint16_t (*logAcquireUInt16)(uint32_t timestamp, void *data);
typedef uint32_t (*logAcquireUInt32)(uint32_t timestamp, void *data);
typedef int8_t (*logAcquireInt8)(uint32_t timestamp, void *data);
typedef int16_t (*logAcquireInt16)(uint32_t timestamp, void *data);
typedef int32_t (*logAcquireInt32)(uint32_t timestamp, void *data);
typedef float (*logAcquireFloat)(uint32_t timestamp, void *data);

typedef struct {
    void *data;
    union {
        logAcquireUInt8 acquireUInt8;
        logAcquireUInt16 acquireUInt16;
        logAcquireUInt32 acquireUInt32;
        logAcquireInt8 acquireInt8;
        logAcquireInt16 acquireInt16;
        logAcquireInt32 acquireInt32;
        logAcquireFloat aquireFloat;
    };
} logByFunction_t;

logVarId_t logGetVarId(const char *group, const char *name);
bool logVarIdIsValid(logVarId_t id);
float logGetFloat(logVarId_t id);

#define LOG_GROUP_START(group) \
    static void __attribute__((constructor)) desk_log_##group(void) { const char *const desk_group = #group; (void)desk_group;
#define LOG_ADD(type, name, address) desk_add_log(desk_group, #name, type, address);
#define LOG_ADD_CORE(type, name, address) LOG_ADD(type, name, address)
#define LOG_ADD_DEBUG(type, name, address) LOG_ADD(type, name, address)
#define LOG_ADD_BY_FUNCTION(type, name, address)
#define LOG_GROUP_STOP(group) }

#endif
