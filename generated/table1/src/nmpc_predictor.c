/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Position is affine in the moves, so the roll-out of eq 9 over the horizon stands in constant tables.
 * Prediction step: 0.07 s. Attitude lag: roll 0.0 s, pitch 0.0 s.
 */
#include "nmpc_predictor.h"

#include "nmpc_math.h"

#define ROLL 0
#define PITCH 1

/* Time from now to each predicted step, in s. */
static const nmpc_real_t time_s[NMPC_PREDICTION_HORIZON] = {
    0.07f, 0.14f, 0.21f, 0.28f, 0.35f, 0.42f, 0.49f, 0.56f, 0.63f, 0.7f
};

/* Double time integral of the angle that a unit of each move makes, at each predicted step, in s^2.
 * The last move is held to the end of the horizon. */
static const nmpc_real_t response_s2[NMPC_PREDICTION_HORIZON][NMPC_MOVES] = {
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

/* Turn double time integrals of roll and pitch into a displacement along the axis of `gain_m_s2`. */
static nmpc_real_t displacement_m(const nmpc_real_t gain_m_s2[NMPC_AXES], nmpc_real_t roll_rad_s2,
                                  nmpc_real_t pitch_rad_s2)
{
    return (gain_m_s2[ROLL] * roll_rad_s2) + (gain_m_s2[PITCH] * pitch_rad_s2);
}

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
    prediction->gain_x_m_s2[ROLL] = -across_m_s2;
    prediction->gain_x_m_s2[PITCH] = -along_m_s2;
    prediction->gain_y_m_s2[ROLL] = along_m_s2;
    prediction->gain_y_m_s2[PITCH] = -across_m_s2;

    /* Eqs 9-11 without moves: both robot and target keep their velocity. */
    for (i = 0; i < NMPC_PREDICTION_HORIZON; i++) {
        prediction->free_x_m[i] = error_x_m + (time_s[i] * error_x_m_s);
        prediction->free_y_m[i] = error_y_m + (time_s[i] * error_y_m_s);
    }
}

void nmpc_predictor_error(const nmpc_prediction_t *prediction, const nmpc_real_t moves_rad[NMPC_MOVES], int i,
                          nmpc_real_t *error_x_m, nmpc_real_t *error_y_m)
{
    nmpc_real_t roll_rad_s2 = (nmpc_real_t)0;
    nmpc_real_t pitch_rad_s2 = (nmpc_real_t)0;
    int k;

    for (k = 0; k < NMPC_MOVES; k += NMPC_AXES) {
        roll_rad_s2 = roll_rad_s2 + (response_s2[i][k + ROLL] * moves_rad[k + ROLL]);
        pitch_rad_s2 = pitch_rad_s2 + (response_s2[i][k + PITCH] * moves_rad[k + PITCH]);
    }
    *error_x_m = prediction->free_x_m[i] + displacement_m(prediction->gain_x_m_s2, roll_rad_s2, pitch_rad_s2);
    *error_y_m = prediction->free_y_m[i] + displacement_m(prediction->gain_y_m_s2, roll_rad_s2, pitch_rad_s2);
}

void nmpc_predictor_add_gradient(const nmpc_prediction_t *prediction, int i, nmpc_real_t slope_x,
                                 nmpc_real_t slope_y, nmpc_real_t gradient[NMPC_MOVES])
{
    const nmpc_real_t by_roll =
        (slope_x * prediction->gain_x_m_s2[ROLL]) + (slope_y * prediction->gain_y_m_s2[ROLL]);
    const nmpc_real_t by_pitch =
        (slope_x * prediction->gain_x_m_s2[PITCH]) + (slope_y * prediction->gain_y_m_s2[PITCH]);
    int k;

    for (k = 0; k < NMPC_MOVES; k += NMPC_AXES) {
        gradient[k + ROLL] = gradient[k + ROLL] + (by_roll * response_s2[i][k + ROLL]);
        gradient[k + PITCH] = gradient[k + PITCH] + (by_pitch * response_s2[i][k + PITCH]);
    }
}
