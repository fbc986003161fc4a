/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: the error between drone and target over the horizon, for given moves (eqs 8-11).
 *
 * tau = 0.07 s; attitude lag: roll 0.0 s, pitch 0.0 s.
 */
#include "nmpc_predictor.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

const nmpc_real_t nmpc_predictor_response_sum[NMPC_HORIZON_PREDICTION][NMPC_RESPONSES] = {
    { 1.0f, 0.0f },
    { 4.0f, 1.0f },
    { 9.0f, 5.0f },
    { 16.0f, 14.0f },
    { 25.0f, 30.0f },
    { 36.0f, 55.0f },
    { 49.0f, 91.0f },
    { 64.0f, 140.0f },
    { 81.0f, 204.0f },
    { 50.0f, 142.5f }
};

/* Start the roll-out along one axis without moves: the acceleration stays 0, as nmpc_init() set it. */
static void start_rollout(nmpc_rollout_t *rollout, nmpc_real_t error_m, nmpc_real_t relative_velocity_m_s)
{
    rollout->error_m = error_m;
    rollout->displacement_m_step = NMPC_PREDICTION_STEP_S * relative_velocity_m_s;
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
    start_rollout(&prediction->x, state->position_m[0] - target->position_m[0],
                  state->velocity_m_s[0] - target->velocity_m_s[0]);
    start_rollout(&prediction->y, state->position_m[1] - target->position_m[1],
                  state->velocity_m_s[1] - target->velocity_m_s[1]);
}
