/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: the error between drone and target over the horizon, for given moves (eqs 8-11).
 *
 * tau = 0.055 s; attitude lag: roll 0.27 s, pitch 0.15 s.
 */
#include "nmpc_predictor.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xD149173FUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

const nmpc_real_t nmpc_predictor_response_sum[NMPC_PREDICTION_HORIZON][NMPC_RESPONSES] = {
    { 0.06457953f, 0.11179243f, 0.0f, 0.0f },
    { 0.4921019f, 0.8219046f, 0.06457953f, 0.11179243f },
    { 1.5842701f, 2.5605955f, 0.55668145f, 0.93369704f },
    { 3.5871847f, 5.626052f, 2.1409516f, 3.4942925f },
    { 6.7015905f, 10.22493f, 5.728136f, 9.120344f },
    { 11.091236f, 16.500448f, 12.429727f, 19.345274f },
    { 16.889692f, 24.551868f, 23.520964f, 35.845722f },
    { 24.205914f, 34.447975f, 40.410656f, 60.39759f },
    { 33.128773f, 46.23645f, 64.61657f, 94.845566f },
    { 21.865381f, 29.975163f, 48.87267f, 70.54101f }
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

/* Let the target accelerate: the error's acceleration is the drone's less the target's. */
static void accelerate_target(nmpc_rollout_t *rollout, nmpc_real_t target_acceleration_m_step2)
{
    rollout->acceleration_m_step2 = rollout->acceleration_m_step2 - target_acceleration_m_step2;
    rollout->displacement_m_step =
        rollout->displacement_m_step
        - (NMPC_DISPLACEMENT_SHARE * target_acceleration_m_step2);
}

void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            const nmpc_real_t target_acceleration_m_step2[2],
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
    accelerate_target(&prediction->x, target_acceleration_m_step2[0]);
    accelerate_target(&prediction->y, target_acceleration_m_step2[1]);
}
