/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Prediction step: 0.055 s. Attitude lag: roll 0.27 s, pitch 0.15 s.
 */
#include "nmpc_predictor.h"

/* Time from now to each predicted step, in s. */
static const nmpc_real_t time_s[NMPC_PREDICTION_HORIZON] = {
    0.055, 0.11, 0.165, 0.22, 0.275, 0.33, 0.385, 0.44, 0.495, 0.55
};

/* Double time integral of a unit of measured roll, pitch as it decays, at each predicted step, in s^2. */
static const nmpc_real_t free_s2[NMPC_PREDICTION_HORIZON][NMPC_AXES] = {
    { 0.0014148234565086143, 0.0013434139519449342 },
    { 0.005305695867129453, 0.004806869274520486 },
    { 0.011216291376871777, 0.00973959938320679 },
    { 0.01877438314889519, 0.015690596600736663 },
    { 0.02767634425400232, 0.02234729428679311 },
    { 0.03767450498380683, 0.029493071063152507 },
    { 0.048566840160191874, 0.03697779951552678 },
    { 0.06018855703212195, 0.04469743524762573 },
    { 0.07240523348920969, 0.0525798712665279 },
    { 0.08510722087490043, 0.06057513449714641 }
};

/* The last move is held to the end of the horizon. */
const nmpc_real_t nmpc_predictor_response_s2[NMPC_PREDICTION_HORIZON][NMPC_MOVES] = {
    { 9.767654349138568e-05, 0.00016908604805506572, 0.0, 0.0 },
    { 0.0006466275893791617, 0.0010740446774244485, 9.767654349138568e-05, 0.00016908604805506572 },
    { 0.0016519044902576774, 0.002629769891313696, 0.0007443041328705473, 0.001243130725479514 },
    { 0.003029408227976587, 0.004636502782470127, 0.002396208623128225, 0.0038729006167932106 },
    { 0.004710538894892872, 0.006955802313943552, 0.005425616851104812, 0.008509403399263338 },
    { 0.00663933927019549, 0.009491723223640603, 0.010136155745997685, 0.015465205713206889 },
    { 0.008770164823614958, 0.012177771547625733, 0.016775495016193173, 0.02495692893684749 },
    { 0.011065783128069929, 0.014967864267901051, 0.02554565983980813, 0.03713470048447322 },
    { 0.01349582354291226, 0.017830063981097835, 0.036611442967878056, 0.052102564752374264 },
    { 0.016035512614309265, 0.020742236769381486, 0.05010726651079032, 0.0699326287334721 }
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
    nmpc_real_t push_x_m_s2[NMPC_AXES];
    nmpc_real_t push_y_m_s2[NMPC_AXES];
    int i;

    /* Eq 8 with the signs of eq 3. */
    nmpc_sine_cosine(state->yaw_rad, &sine, &cosine);
    across_m_s2 = thrust_acceleration_m_s2 * sine;
    along_m_s2 = thrust_acceleration_m_s2 * cosine;
    prediction->gain_x_m_s2[NMPC_ROLL] = -across_m_s2;
    prediction->gain_x_m_s2[NMPC_PITCH] = -along_m_s2;
    prediction->gain_y_m_s2[NMPC_ROLL] = along_m_s2;
    prediction->gain_y_m_s2[NMPC_PITCH] = -across_m_s2;
    push_x_m_s2[NMPC_ROLL] = prediction->gain_x_m_s2[NMPC_ROLL] * state->roll_rad;
    push_x_m_s2[NMPC_PITCH] = prediction->gain_x_m_s2[NMPC_PITCH] * state->pitch_rad;
    push_y_m_s2[NMPC_ROLL] = prediction->gain_y_m_s2[NMPC_ROLL] * state->roll_rad;
    push_y_m_s2[NMPC_PITCH] = prediction->gain_y_m_s2[NMPC_PITCH] * state->pitch_rad;

    /* Eqs 9-11 without moves: both robot and target keep their velocity, and the present tilt keeps pushing
     * while it decays. */
    for (i = 0; i < NMPC_PREDICTION_HORIZON; i++) {
        prediction->free_x_m[i] =
            (error_x_m + (time_s[i] * error_x_m_s))
            + nmpc_predictor_displacement(push_x_m_s2, free_s2[i][NMPC_ROLL], free_s2[i][NMPC_PITCH]);
        prediction->free_y_m[i] =
            (error_y_m + (time_s[i] * error_y_m_s))
            + nmpc_predictor_displacement(push_y_m_s2, free_s2[i][NMPC_ROLL], free_s2[i][NMPC_PITCH]);
    }
}
