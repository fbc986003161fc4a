/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Position is affine in the moves, so the roll-out of eq 9 over the horizon stands in constant tables.
 */
#ifndef NMPC_PREDICTOR_H
#define NMPC_PREDICTOR_H

#include "nmpc.h"

#include "nmpc_math.h"

#ifdef __cplusplus
extern "C" {
#endif

#define NMPC_ROLL 0
#define NMPC_PITCH 1

/* Double time integral of the angle that a unit of each move makes, at each predicted step, in s^2. */
extern const nmpc_real_t nmpc_predictor_response_s2[NMPC_PREDICTION_HORIZON][NMPC_MOVES];

/* Evaluate eq 8 at the present heading and thrust, and roll robot and target out without moves. */
void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            nmpc_real_t thrust_acceleration_m_s2, nmpc_prediction_t *prediction);

/* Add up what roll and pitch displace along one axis: acceleration times double time integral, in m. */
static inline nmpc_real_t nmpc_predictor_displacement(const nmpc_real_t gain_m_s2[NMPC_AXES],
                                                      nmpc_real_t roll_s2, nmpc_real_t pitch_s2)
{
    return (gain_m_s2[NMPC_ROLL] * roll_s2) + (gain_m_s2[NMPC_PITCH] * pitch_s2);
}

/* Predict position less target at step `i`, 0 .. NMPC_PREDICTION_HORIZON - 1, in m. */
static inline void nmpc_predictor_error(const nmpc_prediction_t *prediction,
                                        const nmpc_real_t moves_rad[NMPC_MOVES], int i,
                                        nmpc_real_t *error_x_m, nmpc_real_t *error_y_m)
{
    const nmpc_real_t *response_s2 = nmpc_predictor_response_s2[i];
    nmpc_real_t roll_rad_s2 = response_s2[NMPC_ROLL] * moves_rad[NMPC_ROLL];
    nmpc_real_t pitch_rad_s2 = response_s2[NMPC_PITCH] * moves_rad[NMPC_PITCH];
    int k;

    NMPC_UNROLL
    for (k = NMPC_AXES; k < NMPC_MOVES; k += NMPC_AXES) {
        roll_rad_s2 = roll_rad_s2 + (response_s2[k + NMPC_ROLL] * moves_rad[k + NMPC_ROLL]);
        pitch_rad_s2 = pitch_rad_s2 + (response_s2[k + NMPC_PITCH] * moves_rad[k + NMPC_PITCH]);
    }
    *error_x_m = prediction->free_x_m[i]
                 + nmpc_predictor_displacement(prediction->gain_x_m_s2, roll_rad_s2, pitch_rad_s2);
    *error_y_m = prediction->free_y_m[i]
                 + nmpc_predictor_displacement(prediction->gain_y_m_s2, roll_rad_s2, pitch_rad_s2);
}

#ifdef __cplusplus
}
#endif

#endif
