/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: the error between drone and target over the horizon, for given moves (eqs 8-11).
 *
 * tau = 0.055 s; attitude lag: roll 0.27 s, pitch 0.15 s.
 */
#include "nmpc_predictor.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xD4C905DCUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

const nmpc_real_t nmpc_predictor_response_sum[NMPC_PREDICTION_HORIZON][NMPC_RESPONSES] = {
    { 67717, 117223, 0, 0 },
    { 516006, 861829, 67717, 117223 },
    { 1661228, 2684979, 583723, 979052 },
    { 3761436, 5899343, 2244950, 3664031 },
    { 7027127, 10721616, 6006386, 9563374 },
    { 11630004, 17301975, 13033513, 20284990 },
    { 17710126, 25744500, 24663518, 37586964 },
    { 25381739, 36121322, 42373644, 63331464 },
    { 34738034, 48482430, 67755383, 99452786 },
    { 22927514, 31431236, 51246709, 73967608 }
};

/* Start the roll-out along one axis at the measured tilt, which stays constant until the first moves. */
static void start_rollout(nmpc_rollout_t *rollout, nmpc_real_t error_m, nmpc_real_t relative_velocity_m_s,
                          const nmpc_real_t gain_m_step2_rad[NMPC_ANGLES], const nmpc_real_t tilt_rad[NMPC_ANGLES])
{
    rollout->error_m = nmpc_initial_error(error_m);
    rollout->acceleration_m_step2 = nmpc_gain_product(gain_m_step2_rad[NMPC_ROLL], tilt_rad[NMPC_ROLL])
                                    + nmpc_gain_product(gain_m_step2_rad[NMPC_PITCH], tilt_rad[NMPC_PITCH]);
    rollout->displacement_m_step = nmpc_velocity_product(NMPC_PREDICTION_STEP_S, relative_velocity_m_s)
                                   + nmpc_share_product(NMPC_DISPLACEMENT_SHARE, rollout->acceleration_m_step2);
    rollout->roll_deficit_m_step2 = (nmpc_real_t)0;
    rollout->pitch_deficit_m_step2 = (nmpc_real_t)0;
}

void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            nmpc_real_t thrust_acceleration_m_s2, nmpc_prediction_t *prediction)
{
    const nmpc_real_t thrust_m_step2 = nmpc_thrust_product(thrust_acceleration_m_s2, NMPC_PREDICTION_STEP_SQUARED_S2);
    nmpc_real_t sine;
    nmpc_real_t cosine;
    nmpc_real_t sine_m_step2;
    nmpc_real_t cosine_m_step2;

    /* tau^2 times the matrix of eq 8. Eq 8 prints both sin psi with the opposite sign of what eqs 3 and 6 give. */
    nmpc_sine_cosine(state->yaw_rad, &sine, &cosine);
    sine_m_step2 = nmpc_sine_product(thrust_m_step2, sine);
    cosine_m_step2 = nmpc_sine_product(thrust_m_step2, cosine);
    prediction->gain_x_m_step2_rad[NMPC_ROLL] = -sine_m_step2;
    prediction->gain_x_m_step2_rad[NMPC_PITCH] = -cosine_m_step2;
    prediction->gain_y_m_step2_rad[NMPC_ROLL] = cosine_m_step2;
    prediction->gain_y_m_step2_rad[NMPC_PITCH] = -sine_m_step2;

    /* r - Tp and v - Tv, of eqs 9 to 11, at the present control step. */
    prediction->tilt_rad[NMPC_ROLL] = state->roll_rad;
    prediction->tilt_rad[NMPC_PITCH] = state->pitch_rad;
    start_rollout(&prediction->x, state->position_m[0] - target->position_m[0],
                  state->velocity_m_s[0] - target->velocity_m_s[0],
                  prediction->gain_x_m_step2_rad, prediction->tilt_rad);
    start_rollout(&prediction->y, state->position_m[1] - target->position_m[1],
                  state->velocity_m_s[1] - target->velocity_m_s[1],
                  prediction->gain_y_m_step2_rad, prediction->tilt_rad);
}
