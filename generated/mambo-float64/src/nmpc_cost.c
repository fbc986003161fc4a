/* SPDX-License-Identifier: MIT-0
 *
 * Cost function: the Manhattan distance to the target and the variation of the moves (eq 12).
 */
#include "nmpc_cost.h"

#include "nmpc_math.h"
#include "nmpc_predictor.h"

nmpc_real_t nmpc_cost_evaluate(const nmpc_prediction_t *prediction, const nmpc_weights_t *weights,
                               const nmpc_real_t last_rad[NMPC_AXES], const nmpc_real_t moves_rad[NMPC_MOVES],
                               nmpc_real_t gradient[NMPC_MOVES])
{
    nmpc_real_t distance_m = (nmpc_real_t)0;
    nmpc_real_t variation_rad = (nmpc_real_t)0;
    int i;
    int k;

    for (k = 0; k < NMPC_MOVES; k++) {
        gradient[k] = (nmpc_real_t)0;
    }

    /* Eq 12a: an error costs its size; its slope is its sign. */
    for (i = 0; i < NMPC_PREDICTION_HORIZON; i++) {
        nmpc_real_t error_x_m;
        nmpc_real_t error_y_m;

        nmpc_predictor_error(prediction, moves_rad, i, &error_x_m, &error_y_m);
        distance_m = distance_m + (nmpc_absolute(error_x_m) + nmpc_absolute(error_y_m));
        nmpc_predictor_add_gradient(prediction, i, (nmpc_real_t)nmpc_sign(error_x_m),
                                    (nmpc_real_t)nmpc_sign(error_y_m), gradient);
    }

    /* Eq 12b: a move counts by its change from the one before, the first by that from the last command. */
    for (k = 0; k < NMPC_MOVES; k++) {
        const nmpc_real_t before_rad = (k < NMPC_AXES) ? last_rad[k] : moves_rad[k - NMPC_AXES];
        const nmpc_real_t change_rad = moves_rad[k] - before_rad;
        int slope = nmpc_sign(change_rad);

        variation_rad = variation_rad + nmpc_absolute(change_rad);
        if (k < (NMPC_MOVES - NMPC_AXES)) {
            slope = slope - nmpc_sign(moves_rad[k + NMPC_AXES] - moves_rad[k]);
        }
        gradient[k] = (weights->tracking * gradient[k]) + (weights->effort * (nmpc_real_t)slope);
    }
    return (weights->tracking * distance_m) + (weights->effort * variation_rad);
}
