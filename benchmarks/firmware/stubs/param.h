/* In the place of the firmware's param.h: every parameter is entered in a table before main (desk/variables.c). */
#ifndef PARAM_H
#define PARAM_H

#include <stdbool.h>
#include <stdint.h>

#include "desk_variables.h"

#define PARAM_UINT8 DESK_UINT8
#define PARAM_UINT16 DESK_UINT16
#define PARAM_UINT32 DESK_UINT32
#define PARAM_INT8 DESK_INT8
#define PARAM_INT16 DESK_INT16
#define PARAM_INT32 DESK_INT32
#define PARAM_FLOAT DESK_FLOAT
#define PARAM_CORE 0
#define PARAM_RONLY 0
#define PARAM_PERSISTENT 0

#define PARAM_GROUP_START(group) \
    static void __attribute__((constructor)) desk_param_##group(void) { const char *const desk_group = #group; (void)desk_group;
#define PARAM_ADD(type, name, address) desk_add_parameter(desk_group, #name, type, address);
#define PARAM_ADD_CORE(type, name, address) PARAM_ADD(type, name, address)
#define PARAM_ADD_FULL(type, name, address, ...) PARAM_ADD(type, name, address)
#define PARAM_ADD_WITH_CALLBACK(type, name, address, callback) PARAM_ADD(type, name, address)
#define PARAM_ADD_CORE_WITH_CALLBACK(type, name, address, callback) PARAM_ADD(type, name, address)
#define PARAM_GROUP_STOP(group) }

#endif
