/* Stub of the Crazyflie's firmware: one group, which the host's program reads by name. */
#ifndef PARAM_H
#define PARAM_H

#include "log.h"

/* The type of a parameter may be `PARAM_FLOAT | PARAM_PERSISTENT`. */
#define PARAM_UINT8 1
#define PARAM_FLOAT 2
#define PARAM_INT32 3
#define PARAM_UINT32 4
#define PARAM_RONLY 0x40
#define PARAM_PERSISTENT 0x100
#define PARAM_TYPE_NAME(kind) \
    (((kind) == PARAM_FLOAT) ? "float" : ((kind) == PARAM_INT32) ? "int32_t" : ((kind) == PARAM_UINT32) ? "uint32_t" : "uint8_t")

#define PARAM_GROUP_START(group) const struct variable host_parameters[] = { { "group", #group, 0 },
#define PARAM_ADD(kind, variable_name, variable_address) \
    { PARAM_TYPE_NAME((kind) & 0x3f), #variable_name, (void *)(variable_address) },
#define PARAM_GROUP_STOP(group) { 0, #group, 0 } };

#endif
