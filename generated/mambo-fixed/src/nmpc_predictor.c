/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Prediction step: 0.055 s. Attitude lag: roll 0.27 s, pitch 0.15 s.
 */
#include "nmpc_predictor.h"

const nmpc_real_t nmpc_predictor_response_sum[NMPC_PREDICTION_HORIZON + 1][NMPC_RESPONSES] = {
    { 0, 0, 0, 0 },
    { 541732, 937783, 0, 0 },
    { 4128050, 6894636, 541732, 937783 },
    { 13289821, 21479831, 4669782, 7832418 },
    { 30091486, 47194743, 17959604, 29312250 },
    { 56217016, 85772925, 48051090, 76506993 },
    { 93040034, 138415798, 104268106, 162279918 },
    { 141681009, 205955997, 197308140, 300695715 },
    { 203053913, 288970573, 338989150, 506651712 },
    { 277904276, 387859444, 542043063, 795622285 },
    { 183420114, 251449885, 409973669, 591740865 }
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
