/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Prediction step: 0.07 s. Attitude lag: roll 0.0 s, pitch 0.0 s.
 */
#include "nmpc_predictor.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xD76A4655UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

const nmpc_real_t nmpc_predictor_response_sum[NMPC_PREDICTION_HORIZON][NMPC_RESPONSES] = {
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

/* Start a walk: robot and target keep their velocity. Bend and tilt stay level, as nmpc_init() set them. */
static void start_walk(nmpc_walk_t *walk, nmpc_real_t error_m, nmpc_real_t velocity_m_s)
{
    walk->error_m = nmpc_first_error(error_m);
    walk->advance_m = nmpc_travel(velocity_m_s);
}

void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            nmpc_real_t thrust_acceleration_m_s2, nmpc_prediction_t *prediction)
{
    const nmpc_real_t push_m = nmpc_push(thrust_acceleration_m_s2);
    nmpc_real_t sine;
    nmpc_real_t cosine;
    nmpc_real_t across_m;
    nmpc_real_t along_m;

    /* Eq 8 with the signs of eq 3, over one step. */
    nmpc_sine_cosine(state->yaw_rad, &sine, &cosine);
    across_m = nmpc_component(push_m, sine);
    along_m = nmpc_component(push_m, cosine);
    prediction->gain_x_m[NMPC_ROLL] = -across_m;
    prediction->gain_x_m[NMPC_PITCH] = -along_m;
    prediction->gain_y_m[NMPC_ROLL] = along_m;
    prediction->gain_y_m[NMPC_PITCH] = -across_m;

    /* Eqs 9-11 without moves. */
    start_walk(&prediction->x, state->position_m[0] - target->position_m[0],
               state->velocity_m_s[0] - target->velocity_m_s[0]);
    start_walk(&prediction->y, state->position_m[1] - target->position_m[1],
               state->velocity_m_s[1] - target->velocity_m_s[1]);
}
