/* SPDX-License-Identifier: MIT-0
 *
 * Cost function: the Manhattan distance to the target and the variation of the moves (eq 12).
 */
#include "nmpc_cost.h"

#include "nmpc_predictor.h"

/* Return what an error costs, its size, and add its slope to `sums_s2`: the responses with its sign. */
static inline nmpc_real_t weigh(nmpc_real_t error_m, const nmpc_real_t response_s2[NMPC_MOVES],
                                nmpc_real_t sums_s2[NMPC_MOVES])
{
    nmpc_real_t size_m = error_m;
    int k;

    if (error_m > (nmpc_real_t)0) {
        NMPC_UNROLL
        for (k = 0; k < NMPC_MOVES; k++) {
            sums_s2[k] = sums_s2[k] + response_s2[k];
        }
    } else if (error_m < (nmpc_real_t)0) {
        size_m = -error_m;
        NMPC_UNROLL
        for (k = 0; k < NMPC_MOVES; k++) {
            sums_s2[k] = sums_s2[k] - response_s2[k];
        }
    } else {
        /* No error, no slope. */
    }
    return size_m;
}

nmpc_real_t nmpc_cost_evaluate(const nmpc_prediction_t *prediction, const nmpc_weights_t *weights,
                               const nmpc_real_t last_rad[NMPC_AXES], const nmpc_real_t moves_rad[NMPC_MOVES],
                               nmpc_real_t gradient[NMPC_MOVES])
{
    nmpc_real_t sums_x_s2[NMPC_MOVES];
    nmpc_real_t sums_y_s2[NMPC_MOVES];
    nmpc_real_t distance_m = (nmpc_real_t)0;
    nmpc_real_t variation_rad = (nmpc_real_t)0;
    int i;
    int k;

    for (k = 0; k < NMPC_MOVES; k++) {
        sums_x_s2[k] = (nmpc_real_t)0;
        sums_y_s2[k] = (nmpc_real_t)0;
    }

    /* Eq 12a. */
    for (i = 0; i < NMPC_PREDICTION_HORIZON; i++) {
        nmpc_real_t error_x_m;
        nmpc_real_t error_y_m;

        nmpc_predictor_error(prediction, moves_rad, i, &error_x_m, &error_y_m);
        distance_m = distance_m
                     + (weigh(error_x_m, nmpc_predictor_response_s2[i], sums_x_s2)
                        + weigh(error_y_m, nmpc_predictor_response_s2[i], sums_y_s2));
    }

    /* Eq 12b: a move counts by its change from the one before, the first by that from the last command; its
     * slope falls to both moves. */
    NMPC_UNROLL
    for (k = 0; k < NMPC_MOVES; k++) {
        const int axis = k % NMPC_AXES;
        const nmpc_real_t before_rad = (k < NMPC_AXES) ? last_rad[k] : moves_rad[k - NMPC_AXES];
        const nmpc_real_t change_rad = moves_rad[k] - before_rad;
        const nmpc_real_t distance_by_move_m = (prediction->gain_x_m_s2[axis] * sums_x_s2[k])
                                               + (prediction->gain_y_m_s2[axis] * sums_y_s2[k]);
        nmpc_real_t size_rad = change_rad;
        nmpc_real_t effort = (nmpc_real_t)0;

        if (change_rad > (nmpc_real_t)0) {
            effort = weights->effort;
        } else if (change_rad < (nmpc_real_t)0) {
            size_rad = -change_rad;
            effort = -weights->effort;
        } else {
            /* No change, no slope. */
        }
        variation_rad = variation_rad + size_rad;
        gradient[k] = (weights->tracking * distance_by_move_m) + effort;
        if (k >= NMPC_AXES) {
            gradient[k - NMPC_AXES] = gradient[k - NMPC_AXES] - effort;
        }
    }
    return (weights->tracking * distance_m) + (weights->effort * variation_rad);
}
