/* SPDX-License-Identifier: MIT-0
 *
 * Cost function: the Manhattan distance to the target and the variation of the moves (eq 12).
 */
#include "nmpc_cost.h"

#include "nmpc_math.h"
#include "nmpc_predictor.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x8D00AE40UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* The errors along one axis of the world. */
typedef struct {
    nmpc_real_t distance_m; /* the sum of their sizes */
    nmpc_steps_t below;     /* a bit each, the last one's lowest: 1 below zero */
} nmpc_errors_t;

/* Walk to the next step and take note of the error there. */
static inline void walk_on(nmpc_walk_t *walk, nmpc_errors_t *errors)
{
    nmpc_predictor_walk(walk);
    errors->distance_m = errors->distance_m + (nmpc_real_t)nmpc_absolute(walk->error_m);
    errors->below = (errors->below << 1) | nmpc_is_below(walk->error_m);
}

/* Find the slopes of the distance by the bend of each move: the responses of all steps, each with the sign of its
 * error. They are summed by parts, from the last part to the first. With S(i) the sum of responses of steps 0..i,
 * signs + + - - give 2 S(1) - S(3); the table holds 2 S(i), in its last row S. Errors that are all zero have no
 * slope. */
static inline void find_slopes(const nmpc_errors_t *errors, nmpc_real_t slopes[NMPC_RESPONSES])
{
    static const nmpc_real_t signs[] = { (nmpc_real_t)1, -(nmpc_real_t)1 };
    nmpc_real_t sign = (nmpc_real_t)0;
    nmpc_steps_t changes = (errors->below ^ (errors->below >> 1)) & (((nmpc_steps_t)1 << NMPC_LAST_STEP) - 1U);
    int part;
    int k;

    NMPC_UNROLL
    for (k = 0; k < NMPC_RESPONSES; k++) {
        slopes[k] = nmpc_predictor_response_sum[NMPC_LAST_STEP][k];
    }
    /* Step i is the last before a change of sign. The changes run out first; the count is there to be seen. */
    for (part = 1; (changes != 0U) && (part < NMPC_PREDICTION_HORIZON); part++) {
        const unsigned int i = (NMPC_LAST_STEP - 1U) - nmpc_lowest_one(changes);

        NMPC_UNROLL
        for (k = 0; k < NMPC_RESPONSES; k++) {
            slopes[k] = nmpc_predictor_response_sum[i][k] - slopes[k];
        }
        changes = changes & (changes - 1U);
    }
    if (nmpc_bits(errors->distance_m) != 0U) {
        sign = signs[errors->below >> NMPC_LAST_STEP];
    }
    NMPC_UNROLL
    for (k = 0; k < NMPC_RESPONSES; k++) {
        slopes[k] = sign * slopes[k];
    }
}

nmpc_sum_t nmpc_cost_evaluate(nmpc_t *self)
{
    const nmpc_prediction_t *const prediction = &self->prediction;
    const nmpc_real_t *const moves_rad = self->plan_rad;
    const nmpc_weights_t weight = self->weights;
    nmpc_walk_t walk_x = prediction->x;
    nmpc_walk_t walk_y = prediction->y;
    nmpc_errors_t errors_x = { (nmpc_real_t)0, 0U };
    nmpc_errors_t errors_y = { (nmpc_real_t)0, 0U };
    nmpc_real_t slopes_x[NMPC_RESPONSES];
    nmpc_real_t slopes_y[NMPC_RESPONSES];
    nmpc_sum_t distance_m;
    nmpc_sum_t variation_rad = (nmpc_sum_t)0;
    int axis;
    int i;

    /* Eq 12a. */
    NMPC_UNROLL
    for (i = 0; i < NMPC_CONTROL_HORIZON; i++) {
        nmpc_predictor_turn(prediction, moves_rad, i, &walk_x, &walk_y);
        walk_on(&walk_x, &errors_x);
        walk_on(&walk_y, &errors_y);
    }
    NMPC_UNROLL_STEPS
    for (i = NMPC_CONTROL_HORIZON; i < NMPC_PREDICTION_HORIZON; i++) {
        walk_on(&walk_x, &errors_x);
        walk_on(&walk_y, &errors_y);
    }
    find_slopes(&errors_x, slopes_x);
    find_slopes(&errors_y, slopes_y);
    distance_m = (nmpc_sum_t)errors_x.distance_m + errors_y.distance_m;

    /* Eq 12b: a move counts by its change from the one before, the first by that from the last command; its
     * slope falls to both moves. */
    NMPC_UNROLL
    for (axis = 0; axis < NMPC_AXES; axis++) {
        const nmpc_real_t gain_x_m = prediction->gain_x_m[axis];
        const nmpc_real_t gain_y_m = prediction->gain_y_m[axis];
        nmpc_real_t before_rad = self->command_rad[axis];
        nmpc_sum_t slope = (nmpc_sum_t)0;

        NMPC_UNROLL
        for (i = 0; i < NMPC_CONTROL_HORIZON; i++) {
            const int k = (NMPC_AXES * i) + axis;
            const int response = k / NMPC_AXES_ALIKE;
            const nmpc_real_t change_rad = moves_rad[k] - before_rad;
            const nmpc_real_t distance_by_move_m = nmpc_distance_slope(gain_x_m, slopes_x[response], gain_y_m,
                                                                       slopes_y[response]);
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
                self->gradient[k - NMPC_AXES] = slope - effort;
            }
            slope = nmpc_tracking_slope(weight.tracking, distance_by_move_m) + effort;
            before_rad = moves_rad[k];
        }
        self->gradient[(NMPC_MOVES - NMPC_AXES) + axis] = slope;
    }
    return nmpc_tracking_cost(weight.tracking, distance_m) + nmpc_effort_cost(weight.effort, variation_rad);
}
