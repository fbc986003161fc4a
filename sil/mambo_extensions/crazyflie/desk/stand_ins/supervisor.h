/* Stub of the Crazyflie's firmware. */
#ifndef SUPERVISOR_H
#define SUPERVISOR_H

#include <stdbool.h>

bool supervisorIsFlying(void);

#endif
