/* SPDX-License-Identifier: MIT-0
 *
 * The position controllers without a model: sil/mambo_sil/flight/controllers/pd.py.
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

int64_t engine_pid_feedforward_step(void *self, const double *state, const double *target,
                                    double thrust_acceleration_m_s2, double *command_rad)
{
    engine_pid_feedforward_t *pid = self;
    double sine;
    double cosine;
    double measured_rad[2];
    double tilt_rad[2];
    double integral_rad[2];
    int axis;

    (void)thrust_acceleration_m_s2;
    sine_cosine(state[6], &sine, &cosine);
    measured_rad[0] = -((cosine * state[5]) + (sine * state[4]));
    measured_rad[1] = (cosine * state[4]) - (sine * state[5]);
    for (axis = 0; axis < 2; axis++) {
        const double error_m = target[axis] - state[axis];
        const double acceleration_m_s2 = target[4 + axis];
        const double change = (acceleration_m_s2 - pid->acceleration_m_s2[axis]) / pid->update_period_s;
        const double jerk_m_s3 = (magnitude(change) <= pid->jerk_limit_m_s3) ? change : 0.0;
        const double wanted_rad = ((((pid->position_rad_m * error_m)
                                     + (pid->velocity_rad_s_m * (target[2 + axis] - state[2 + axis])))
                                    + (pid->acceleration_rad_s2_m * acceleration_m_s2))
                                   + (pid->jerk_rad_s3_m * jerk_m_s3))
                                  + pid->integral_rad[axis];
        const double excess_rad = (measured_rad[axis] - (acceleration_m_s2 / pid->gravity_m_s2))
                                  - pid->integral_rad[axis];

        tilt_rad[axis] = wanted_rad - (pid->tilt_feedback * excess_rad);
        integral_rad[axis] = clip(pid->integral_rad[axis]
                                      + (pid->update_period_s * (pid->integral_rad_m_s * error_m)),
                                  -pid->integral_limit_rad, pid->integral_limit_rad);
    }
    if ((magnitude(target[0] - state[0]) < pid->integrated_error_m)
        && (magnitude(target[1] - state[1]) < pid->integrated_error_m)
        && (((tilt_rad[0] * tilt_rad[0]) + (tilt_rad[1] * tilt_rad[1]))
            < (pid->tilt_limit_rad * pid->tilt_limit_rad))) {
        pid->integral_rad[0] = integral_rad[0];
        pid->integral_rad[1] = integral_rad[1];
    }
    /* NaN changes no memory. */
    if ((tilt_rad[0] + tilt_rad[1]) == (tilt_rad[0] + tilt_rad[1])) {
        for (axis = 0; axis < 2; axis++) {
            pid->acceleration_m_s2[axis] = target[4 + axis];
            pid->tilt_rad[axis] = pid->tilt_rad[axis] + (pid->low_pass_share * (tilt_rad[axis] - pid->tilt_rad[axis]));
        }
    }
    command_rad[0] = clip((cosine * pid->tilt_rad[1]) - (sine * pid->tilt_rad[0]), -pid->tilt_limit_rad,
                          pid->tilt_limit_rad);
    command_rad[1] = clip(-((cosine * pid->tilt_rad[0]) + (sine * pid->tilt_rad[1])), -pid->tilt_limit_rad,
                          pid->tilt_limit_rad);
    return 0;
}
