/* SPDX-License-Identifier: MIT-0
 *
 * Attitude model: how the drone accelerates in answer to the commands (not in the paper).
 * MISRA C:2012: departs from rule 8.9, for the reason in deviations.txt.
 */
#include "nmpc_attitude.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#define NMPC_ATTITUDE_STATES 4

/* The next a and i of each axis from a, i, c, u; and the share of u - c that c takes in a step. */
static const nmpc_real_t tilt_rows[2][NMPC_ATTITUDE_STATES] = {
    { 1027830970, 45680558, 40928012, 4982843 },
    { 1005976784, 67501993, 62120795, 5644245 }
};
static const nmpc_real_t integral_rows[2][NMPC_ATTITUDE_STATES] = {
    { -10506528, 1073501021, -213874, 10720403 },
    { -8004386, 1073468381, -248626, 8253013 }
};
static const nmpc_real_t lagged_shares[2] = { 213956584, 164838993 };

static nmpc_real_t next(const nmpc_real_t row[NMPC_ATTITUDE_STATES], const nmpc_real_t state[NMPC_ATTITUDE_STATES])
{
    nmpc_sum_t sum = (nmpc_sum_t)row[0] * state[0];
    int k;

    NMPC_UNROLL
    for (k = 1; k < NMPC_ATTITUDE_STATES; k++) {
        sum = sum + ((nmpc_sum_t)row[k] * state[k]);
    }
    return nmpc_clamp(nmpc_attitude_sum(sum), NMPC_ATTITUDE_LIMIT_M_STEP2);
}

void nmpc_attitude_set_command(nmpc_t *self, nmpc_real_t roll_rad, nmpc_real_t pitch_rad)
{
    self->attitude.command_m_step2[NMPC_RIGHT] =
        nmpc_tilt_product(NMPC_ROLL_GAIN_M_STEP2_RAD, roll_rad);
    self->attitude.command_m_step2[NMPC_FORWARD] =
        -nmpc_tilt_product(NMPC_PITCH_GAIN_M_STEP2_RAD, pitch_rad);
}

void nmpc_attitude_reset(nmpc_t *self, nmpc_real_t roll_rad, nmpc_real_t pitch_rad)
{
    int axis;

    nmpc_attitude_set_command(self, roll_rad, pitch_rad);
    for (axis = 0; axis < 2; axis++) {
        self->attitude.tilt_m_step2[axis] = self->attitude.command_m_step2[axis];
        self->attitude.integral_m_step2[axis] = (nmpc_real_t)0;
        self->attitude.lagged_m_step2[axis] = self->attitude.command_m_step2[axis];
    }
    self->attitude.sine = (nmpc_real_t)0;
    self->attitude.cosine = NMPC_ONE;
}

void nmpc_attitude_measure(const nmpc_state_t *state, nmpc_real_t tilt_m_step2[2])
{
    tilt_m_step2[NMPC_RIGHT] = nmpc_tilt_product(NMPC_GAIN_M_STEP2_RAD, state->roll_rad);
    tilt_m_step2[NMPC_FORWARD] = -nmpc_tilt_product(NMPC_GAIN_M_STEP2_RAD, state->pitch_rad);
}

void nmpc_attitude_advance(nmpc_t *self)
{
    nmpc_attitude_t *const attitude = &self->attitude;
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t state[NMPC_ATTITUDE_STATES] = { attitude->tilt_m_step2[axis],
                                                          attitude->integral_m_step2[axis],
                                                          attitude->lagged_m_step2[axis],
                                                          attitude->command_m_step2[axis] };

        attitude->tilt_m_step2[axis] = next(tilt_rows[axis], state);
        attitude->integral_m_step2[axis] = next(integral_rows[axis], state);
        attitude->lagged_m_step2[axis] =
            nmpc_clamp(state[2] + nmpc_sine_product(state[3] - state[2], lagged_shares[axis]),
                       NMPC_ATTITUDE_LIMIT_M_STEP2);
    }
}

/* Turn the vector (right, forward) by the angle of which sine and cosine are given. */
static void turn(nmpc_real_t vector_m_step2[2], nmpc_real_t sine, nmpc_real_t cosine)
{
    const nmpc_real_t right = vector_m_step2[NMPC_RIGHT];
    const nmpc_real_t forward = vector_m_step2[NMPC_FORWARD];

    vector_m_step2[NMPC_RIGHT] =
        nmpc_clamp(nmpc_sine_product(right, cosine) - nmpc_sine_product(forward, sine), NMPC_ATTITUDE_LIMIT_M_STEP2);
    vector_m_step2[NMPC_FORWARD] =
        nmpc_clamp(nmpc_sine_product(forward, cosine) + nmpc_sine_product(right, sine), NMPC_ATTITUDE_LIMIT_M_STEP2);
}

void nmpc_attitude_turn(nmpc_t *self, nmpc_real_t sine, nmpc_real_t cosine)
{
    nmpc_attitude_t *const attitude = &self->attitude;
    /* Sine and cosine of the change of the heading. */
    const nmpc_real_t sine_change =
        nmpc_sine_difference(sine, attitude->cosine, cosine, attitude->sine);
    const nmpc_real_t cosine_change =
        nmpc_sine_sum(cosine, attitude->cosine, sine, attitude->sine);

    turn(attitude->tilt_m_step2, sine_change, cosine_change);
    turn(attitude->command_m_step2, sine_change, cosine_change);
    attitude->sine = sine;
    attitude->cosine = cosine;
}
