/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Prediction step: 0.055 s. Attitude lag: roll 0.27 s, pitch 0.15 s.
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
