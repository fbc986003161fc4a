/* The toolbox's generated code: the estimator and the loops. */
#include <string.h>

#include "HAL.h"
#include "nmpc_mambo.h"

void stock_estimate(const HAL_acquisition_t *sensors, nmpc_mambo_U_t *inputs)
{
    memcpy(inputs, sensors, sizeof *inputs);
}

void stock_fly(const nmpc_mambo_Y_t *angles, HAL_command_t *motors)
{
    motors->pitch = angles->pitch;
    motors->roll = angles->roll;
    motors->status = (float)angles->status;
    motors->refused = (float)angles->refused;
#ifdef NMPC_HAS_HEIGHT
    motors->thrust = angles->thrust;
    motors->has_taken_over = (float)angles->has_taken_over;
#endif
}
