/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 */
#ifndef NMPC_PREDICTOR_H
#define NMPC_PREDICTOR_H

#include "nmpc.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Evaluate eq 8 at the present heading and thrust, and roll robot and target out without moves. */
void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            nmpc_real_t thrust_acceleration_m_s2, nmpc_prediction_t *prediction);

/* Predict position less target at step `i`, 0 .. NMPC_PREDICTION_HORIZON - 1, in m. */
void nmpc_predictor_error(const nmpc_prediction_t *prediction, const nmpc_real_t moves_rad[NMPC_MOVES], int i,
                          nmpc_real_t *error_x_m, nmpc_real_t *error_y_m);

/* Add to `gradient` what slopes `slope_x` and `slope_y` of the cost at step `i` mean for the moves. */
void nmpc_predictor_add_gradient(const nmpc_prediction_t *prediction, int i, nmpc_real_t slope_x,
                                 nmpc_real_t slope_y, nmpc_real_t gradient[NMPC_MOVES]);

#ifdef __cplusplus
}
#endif

#endif
