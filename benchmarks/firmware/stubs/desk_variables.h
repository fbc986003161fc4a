/* Tables of the firmware's log variables and parameters. */
#ifndef DESK_VARIABLES_H
#define DESK_VARIABLES_H

enum { DESK_UINT8, DESK_UINT16, DESK_UINT32, DESK_INT8, DESK_INT16, DESK_INT32, DESK_FLOAT };

void desk_add_log(const char *group, const char *name, int type, const volatile void *address);
void desk_add_parameter(const char *group, const char *name, int type, volatile void *address);

#endif
