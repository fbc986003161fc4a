/* What stands between set-points and motors in the firmware. */
#ifndef LOOPS_H
#define LOOPS_H

#include "stabilizer_types.h"

/* Write what is asked of the motors, as shares of the most. */
void mix(const control_t *control, double motors[4]);

#endif
