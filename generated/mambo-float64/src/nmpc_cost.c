/* SPDX-License-Identifier: MIT-0
 *
 * Cost function: the Manhattan distance to the target and the variation of the moves (eq 12).
 */
#include "nmpc_cost.h"

#include "nmpc_math.h"
#include "nmpc_predictor.h"

/* The errors along one axis of the world; they keep their sign for many steps in a row. */
typedef struct {
    nmpc_real_t run_m;                  /* sum of the errors since the sign last changed */
    nmpc_bits_t sign;                   /* bits of a value with that sign */
    nmpc_sum_t distance_m;              /* sizes of the errors before */
    nmpc_real_t slopes[NMPC_RESPONSES]; /* what they add to the slope of the distance */
} nmpc_errors_t;

static inline void start_errors(nmpc_errors_t *errors, nmpc_real_t error_m)
{
    int k;

    errors->run_m = (nmpc_real_t)0;
    errors->sign = nmpc_bits(error_m);
    errors->distance_m = (nmpc_sum_t)0;
    NMPC_UNROLL
    for (k = 0; k < NMPC_RESPONSES; k++) {
        errors->slopes[k] = (nmpc_real_t)0;
    }
}

/* End the run before step `i`. Its slope is summed by parts: the responses of all steps so far count with its
 * sign, twice if another run follows, which takes them back once. */
static inline void end_run(nmpc_errors_t *errors, int i)
{
    int k;

    if (errors->run_m > (nmpc_real_t)0) {
        errors->distance_m = errors->distance_m + errors->run_m;
        NMPC_UNROLL
        for (k = 0; k < NMPC_RESPONSES; k++) {
            errors->slopes[k] = errors->slopes[k] + nmpc_predictor_response_sum[i][k];
        }
    } else if (errors->run_m < (nmpc_real_t)0) {
        errors->distance_m = errors->distance_m - errors->run_m;
        NMPC_UNROLL
        for (k = 0; k < NMPC_RESPONSES; k++) {
            errors->slopes[k] = errors->slopes[k] - nmpc_predictor_response_sum[i][k];
        }
    } else {
        /* No error, no slope. */
    }
}

/* Walk to step `i` and add the error there. */
static inline void walk_to(nmpc_walk_t *walk, nmpc_errors_t *errors, int i)
{
    nmpc_bits_t sign;

    nmpc_predictor_walk(walk);
    sign = nmpc_bits(walk->error_m);
    if ((((sign ^ errors->sign) & NMPC_SIGN_BIT) != 0U) && (nmpc_sign(walk->error_m) != 0)) {
        end_run(errors, i);
        errors->run_m = (nmpc_real_t)0;
        errors->sign = sign;
    }
    errors->run_m = errors->run_m + walk->error_m;
}

nmpc_sum_t nmpc_cost_evaluate(const nmpc_prediction_t *prediction, const nmpc_weights_t *weights,
                              const nmpc_real_t last_rad[NMPC_AXES], const nmpc_real_t moves_rad[NMPC_MOVES],
                              nmpc_sum_t gradient[NMPC_MOVES])
{
    const nmpc_weights_t weight = *weights;
    nmpc_walk_t walk_x = prediction->x;
    nmpc_walk_t walk_y = prediction->y;
    nmpc_errors_t errors_x;
    nmpc_errors_t errors_y;
    nmpc_sum_t distance_m;
    nmpc_sum_t variation_rad = (nmpc_sum_t)0;
    int axis;
    int i;

    /* Eq 12a. */
    start_errors(&errors_x, walk_x.error_m);
    start_errors(&errors_y, walk_y.error_m);
    for (i = 0; i < NMPC_CONTROL_HORIZON; i++) {
        nmpc_predictor_turn(prediction, moves_rad, i, &walk_x, &walk_y);
        walk_to(&walk_x, &errors_x, i);
        walk_to(&walk_y, &errors_y, i);
    }
    for (i = NMPC_CONTROL_HORIZON; i < NMPC_PREDICTION_HORIZON; i++) {
        walk_to(&walk_x, &errors_x, i);
        walk_to(&walk_y, &errors_y, i);
    }
    end_run(&errors_x, NMPC_PREDICTION_HORIZON);
    end_run(&errors_y, NMPC_PREDICTION_HORIZON);
    distance_m = errors_x.distance_m + errors_y.distance_m;

    /* Eq 12b: a move counts by its change from the one before, the first by that from the last command; its
     * slope falls to both moves. */
    NMPC_UNROLL
    for (axis = 0; axis < NMPC_AXES; axis++) {
        const nmpc_real_t gain_x_m = prediction->gain_x_m[axis];
        const nmpc_real_t gain_y_m = prediction->gain_y_m[axis];
        nmpc_real_t before_rad = last_rad[axis];
        nmpc_sum_t slope = (nmpc_sum_t)0;

        NMPC_UNROLL
        for (i = 0; i < NMPC_CONTROL_HORIZON; i++) {
            const int k = (NMPC_AXES * i) + axis;
            const int response = k / NMPC_AXES_ALIKE;
            const nmpc_real_t change_rad = moves_rad[k] - before_rad;
            const nmpc_real_t distance_by_move_m = nmpc_distance_slope(gain_x_m, errors_x.slopes[response], gain_y_m,
                                                                       errors_y.slopes[response]);
            nmpc_sum_t effort = (nmpc_sum_t)0;

            if (change_rad > (nmpc_real_t)0) {
                variation_rad = variation_rad + change_rad;
                effort = nmpc_effort_slope(weight.effort);
            } else if (change_rad < (nmpc_real_t)0) {
                variation_rad = variation_rad - change_rad;
                effort = -nmpc_effort_slope(weight.effort);
            } else {
                /* No change, no slope. */
            }
            if (i > 0) {
                gradient[k - NMPC_AXES] = slope - effort;
            }
            slope = nmpc_tracking_slope(weight.tracking, distance_by_move_m) + effort;
            before_rad = moves_rad[k];
        }
        gradient[(NMPC_MOVES - NMPC_AXES) + axis] = slope;
    }
    return nmpc_tracking_cost(weight.tracking, distance_m) + nmpc_effort_cost(weight.effort, variation_rad);
}
