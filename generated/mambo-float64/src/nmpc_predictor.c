/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: the error between drone and target over the horizon, for given moves (eqs 8-11).
 *
 * tau = 0.055 s; attitude lag: roll 0.27 s, pitch 0.15 s.
 */
#include "nmpc_predictor.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x8D00AE40UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

const nmpc_real_t nmpc_predictor_response_sum[NMPC_PREDICTION_HORIZON][NMPC_RESPONSES] = {
    { 0.06457953288686658, 0.11179242846615922, 0.0, 0.0 },
    { 0.49210190603011394, 0.8219046118872821, 0.06457953288686658, 0.11179242846615922 },
    { 1.584270164051719, 2.560595449119478, 0.5566814389169805, 0.9336970403534414 },
    { 3.5871846949453303, 5.626051834223693, 2.1409516029686992, 3.4942924894729193 },
    { 6.701590575866238, 10.224929397161578, 5.72813629791403, 9.120344323696612 },
    { 11.091236374342595, 16.500448883866106, 12.429726873780268, 19.345273720858188 },
    { 16.889692456071494, 24.551868088907913, 23.52096324812286, 35.845722604724294 },
    { 24.205912706035082, 34.44797669578464, 40.410655704194355, 60.3975906936322 },
    { 33.12877124680352, 46.23644874940304, 64.61656841022943, 94.84556738941683 },
    { 21.86538152895854, 29.975162149703664, 48.87266982851648, 70.54100806940993 }
};

/* Start the roll-out along one axis at the measured tilt, which stays constant until the first moves. */
static void start_rollout(nmpc_rollout_t *rollout, nmpc_real_t error_m, nmpc_real_t relative_velocity_m_s,
                          const nmpc_real_t gain_m_step2_rad[NMPC_ANGLES], const nmpc_real_t tilt_rad[NMPC_ANGLES])
{
    rollout->error_m = error_m;
    rollout->acceleration_m_step2 = (gain_m_step2_rad[NMPC_ROLL] * tilt_rad[NMPC_ROLL])
                                    + (gain_m_step2_rad[NMPC_PITCH] * tilt_rad[NMPC_PITCH]);
    rollout->displacement_m_step = (NMPC_PREDICTION_STEP_S * relative_velocity_m_s)
                                   + (NMPC_DISPLACEMENT_SHARE * rollout->acceleration_m_step2);
    rollout->roll_deficit_m_step2 = (nmpc_real_t)0;
    rollout->pitch_deficit_m_step2 = (nmpc_real_t)0;
}

void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            nmpc_real_t thrust_acceleration_m_s2, nmpc_prediction_t *prediction)
{
    const nmpc_real_t thrust_m_step2 = thrust_acceleration_m_s2 * NMPC_PREDICTION_STEP_SQUARED_S2;
    nmpc_real_t sine;
    nmpc_real_t cosine;
    nmpc_real_t sine_m_step2;
    nmpc_real_t cosine_m_step2;

    /* tau^2 times the matrix of eq 8. Eq 8 prints both sin psi with the opposite sign of what eqs 3 and 6 give. */
    nmpc_sine_cosine(state->yaw_rad, &sine, &cosine);
    sine_m_step2 = thrust_m_step2 * sine;
    cosine_m_step2 = thrust_m_step2 * cosine;
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
