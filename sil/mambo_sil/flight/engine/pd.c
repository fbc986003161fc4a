/* SPDX-License-Identifier: MIT-0
 *
 * The PD position controllers: sil/mambo_sil/flight/controllers/pd.py.
 */
#undef LANES /* a controller flies one drone */
#include "elementary.h"

int64_t engine_pd_step(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                       double *command_rad)
{
    const engine_pd_t *pd = self;
    const double error_x = target[0] - state[0];
    const double error_y = target[1] - state[1];
    double sine;
    double cosine;
    double forward_m;
    double right_m;

    (void)thrust_acceleration_m_s2;
    sine_cosine(state[6], &sine, &cosine);
    forward_m = clip((cosine * error_x) + (sine * error_y), -pd->error_limit_m, pd->error_limit_m);
    right_m = clip((cosine * error_y) - (sine * error_x), -pd->error_limit_m, pd->error_limit_m);
    command_rad[0] = (pd->position_p_rad_m * right_m)
                     - (pd->position_d_rad_s_m * ((cosine * state[3]) - (sine * state[2])));
    command_rad[1] = (pd->position_d_rad_s_m * ((cosine * state[2]) + (sine * state[3])))
                     - (pd->position_p_rad_m * forward_m);
    return 0;
}

/* Tilt towards the target along one axis of the world. */
static inline double tilt(const engine_pd_feedforward_t *pd, const double *state, const double *target, int axis)
{
    return ((pd->position_rad_m * (target[axis] - state[axis]))
            + (pd->velocity_rad_s_m * (target[2 + axis] - state[2 + axis])))
           + (pd->acceleration_rad_s2_m * target[4 + axis]);
}

int64_t engine_pd_feedforward_step(void *self, const double *state, const double *target,
                                   double thrust_acceleration_m_s2, double *command_rad)
{
    const engine_pd_feedforward_t *pd = self;
    const double tilt_x = tilt(pd, state, target, 0);
    const double tilt_y = tilt(pd, state, target, 1);
    double sine;
    double cosine;

    (void)thrust_acceleration_m_s2;
    sine_cosine(state[6], &sine, &cosine);
    command_rad[0] = clip((cosine * tilt_y) - (sine * tilt_x), -pd->tilt_limit_rad, pd->tilt_limit_rad);
    command_rad[1] = clip(-((cosine * tilt_x) + (sine * tilt_y)), -pd->tilt_limit_rad, pd->tilt_limit_rad);
    return 0;
}
