/* Stub of the Crazyflie's firmware: one group, which the host's program reads by name. */
#ifndef PARAM_H
#define PARAM_H

#include "log.h"

#define PARAM_UINT8 "uint8_t"
#define PARAM_FLOAT "float"

#define PARAM_GROUP_START(group) const struct variable host_parameters[] = { { "group", #group, 0 },
#define PARAM_ADD(variable_type, variable_name, variable_address) LOG_ADD(variable_type, variable_name, variable_address)
#define PARAM_GROUP_STOP(group) { 0, #group, 0 } };

#endif
