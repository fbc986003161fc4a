/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Prediction step: 0.07 s. Attitude lag: roll 0.0 s, pitch 0.0 s.
 */
#include "nmpc_predictor.h"

/* Time from now to each predicted step, in s. */
static const nmpc_real_t time_s[NMPC_PREDICTION_HORIZON] = {
    0.07f, 0.14f, 0.21f, 0.28f, 0.35f, 0.42f, 0.49f, 0.56f, 0.63f, 0.7f
};

/* The last move is held to the end of the horizon. */
const nmpc_real_t nmpc_predictor_response_s2[NMPC_PREDICTION_HORIZON][NMPC_MOVES] = {
    { 0.00245f, 0.00245f, 0.0f, 0.0f },
    { 0.00735f, 0.00735f, 0.00245f, 0.00245f },
    { 0.01225f, 0.01225f, 0.0098f, 0.0098f },
    { 0.01715f, 0.01715f, 0.02205f, 0.02205f },
    { 0.02205f, 0.02205f, 0.0392f, 0.0392f },
    { 0.02695f, 0.02695f, 0.06125f, 0.06125f },
    { 0.03185f, 0.03185f, 0.0882f, 0.0882f },
    { 0.03675f, 0.03675f, 0.12005f, 0.12005f },
    { 0.04165f, 0.04165f, 0.1568f, 0.1568f },
    { 0.04655f, 0.04655f, 0.19845f, 0.19845f }
};

void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            nmpc_real_t thrust_acceleration_m_s2, nmpc_prediction_t *prediction)
{
    const nmpc_real_t error_x_m = state->position_m[0] - target->position_m[0];
    const nmpc_real_t error_y_m = state->position_m[1] - target->position_m[1];
    const nmpc_real_t error_x_m_s = state->velocity_m_s[0] - target->velocity_m_s[0];
    const nmpc_real_t error_y_m_s = state->velocity_m_s[1] - target->velocity_m_s[1];
    nmpc_real_t sine;
    nmpc_real_t cosine;
    nmpc_real_t across_m_s2;
    nmpc_real_t along_m_s2;
    int i;

    /* Eq 8 with the signs of eq 3. */
    nmpc_sine_cosine(state->yaw_rad, &sine, &cosine);
    across_m_s2 = thrust_acceleration_m_s2 * sine;
    along_m_s2 = thrust_acceleration_m_s2 * cosine;
    prediction->gain_x_m_s2[NMPC_ROLL] = -across_m_s2;
    prediction->gain_x_m_s2[NMPC_PITCH] = -along_m_s2;
    prediction->gain_y_m_s2[NMPC_ROLL] = along_m_s2;
    prediction->gain_y_m_s2[NMPC_PITCH] = -across_m_s2;

    /* Eqs 9-11 without moves: both robot and target keep their velocity. */
    for (i = 0; i < NMPC_PREDICTION_HORIZON; i++) {
        prediction->free_x_m[i] = error_x_m + (time_s[i] * error_x_m_s);
        prediction->free_y_m[i] = error_y_m + (time_s[i] * error_y_m_s);
    }
}
