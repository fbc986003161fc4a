/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Prediction step: 0.055 s. Attitude lag: roll 0.27 s, pitch 0.15 s.
 */
#include "nmpc_predictor.h"

/* Time from now to each predicted step, in s. */
static const nmpc_real_t time_s[NMPC_PREDICTION_HORIZON] = {
    0.055f, 0.11f, 0.165f, 0.22f, 0.275f, 0.33f, 0.385f, 0.44f, 0.495f, 0.55f
};

/* Double time integral of a unit of measured roll, pitch as it decays, at each predicted step, in s^2. */
static const nmpc_real_t free_s2[NMPC_PREDICTION_HORIZON][NMPC_AXES] = {
    { 0.0014148235f, 0.001343414f },
    { 0.005305696f, 0.004806869f },
    { 0.011216291f, 0.009739599f },
    { 0.018774383f, 0.015690597f },
    { 0.027676344f, 0.022347294f },
    { 0.037674505f, 0.029493071f },
    { 0.04856684f, 0.036977798f },
    { 0.060188558f, 0.044697434f },
    { 0.072405234f, 0.052579872f },
    { 0.08510722f, 0.060575135f }
};

/* The last move is held to the end of the horizon. */
const nmpc_real_t nmpc_predictor_response_s2[NMPC_PREDICTION_HORIZON][NMPC_MOVES] = {
    { 9.7676544e-05f, 0.00016908605f, 0.0f, 0.0f },
    { 0.00064662757f, 0.0010740447f, 9.7676544e-05f, 0.00016908605f },
    { 0.0016519045f, 0.00262977f, 0.00074430415f, 0.0012431308f },
    { 0.0030294082f, 0.004636503f, 0.0023962087f, 0.0038729005f },
    { 0.004710539f, 0.0069558024f, 0.0054256166f, 0.008509403f },
    { 0.0066393395f, 0.009491723f, 0.010136155f, 0.015465206f },
    { 0.008770165f, 0.012177772f, 0.016775494f, 0.024956929f },
    { 0.011065783f, 0.014967864f, 0.02554566f, 0.0371347f },
    { 0.013495823f, 0.017830065f, 0.03661144f, 0.052102566f },
    { 0.016035512f, 0.020742238f, 0.050107267f, 0.06993263f }
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
