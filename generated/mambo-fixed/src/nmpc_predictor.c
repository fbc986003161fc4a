/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Prediction step: 0.055 s. Attitude lag: roll 0.27 s, pitch 0.15 s.
 */
#include "nmpc_predictor.h"

const nmpc_real_t nmpc_predictor_response_sum[NMPC_PREDICTION_HORIZON][NMPC_RESPONSES] = {
    { 135433, 234446, 0, 0 },
    { 1032012, 1723659, 135433, 234446 },
    { 3322455, 5369958, 1167446, 1958105 },
    { 7522872, 11798686, 4489901, 7328062 },
    { 14054254, 21443231, 12012772, 19126748 },
    { 23260009, 34603949, 26067027, 40569979 },
    { 35420252, 51488999, 49327035, 75173929 },
    { 50763478, 72242643, 84747287, 126662928 },
    { 69476069, 96964861, 135510766, 198905571 },
    { 45855029, 62862471, 102493417, 147935216 }
};

/* Start a walk: robot and target keep their velocity, and the robot its tilt. */
static void start_walk(nmpc_walk_t *walk, nmpc_real_t error_m, nmpc_real_t velocity_m_s,
                       const nmpc_real_t gain_m[NMPC_AXES], const nmpc_real_t tilt_rad[NMPC_AXES])
{
    walk->error_m = nmpc_first_error(error_m);
    walk->bend_m = nmpc_bend(gain_m[NMPC_ROLL], tilt_rad[NMPC_ROLL]) + nmpc_bend(gain_m[NMPC_PITCH], tilt_rad[NMPC_PITCH]);
    walk->advance_m = nmpc_travel(velocity_m_s) + nmpc_part(1073741824, walk->bend_m);
    walk->roll_to_come_m = (nmpc_real_t)0;
    walk->pitch_to_come_m = (nmpc_real_t)0;
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
    prediction->tilt_rad[NMPC_ROLL] = state->roll_rad;
    prediction->tilt_rad[NMPC_PITCH] = state->pitch_rad;
    start_walk(&prediction->x, state->position_m[0] - target->position_m[0],
               state->velocity_m_s[0] - target->velocity_m_s[0], prediction->gain_x_m, prediction->tilt_rad);
    start_walk(&prediction->y, state->position_m[1] - target->position_m[1],
               state->velocity_m_s[1] - target->velocity_m_s[1], prediction->gain_y_m, prediction->tilt_rad);
}
