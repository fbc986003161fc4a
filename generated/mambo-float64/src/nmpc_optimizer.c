/* SPDX-License-Identifier: MIT-0
 *
 * Optimizer: RPROP with a fixed number of iterations, variant rprop+
 * (Riedmiller and Braun 1993; Igel and Huesken 2000).
 */
#include "nmpc_optimizer.h"

#include "nmpc_cost.h"
#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x8D00AE40UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* What RPROP remembers of a move from one iteration to the next. */
typedef struct {
    nmpc_real_t step_rad;
    nmpc_real_t before_rad; /* the move before its last update */
    int direction;          /* sign of the slope at its last update, 0 after a step back */
} nmpc_rprop_t;

/* Update a move, downhill and within the tilt limit: RPROP reads nothing of the gradient but its sign, the
 * slope, now and before. */
static nmpc_real_t update(nmpc_rprop_t *rprop, nmpc_real_t move_rad, int slope)
{
    const int agreement = slope * rprop->direction;
    nmpc_real_t next_rad = move_rad;

    if (agreement < 0) {
        /* The last update crossed a minimum: take it back, and go on with a shorter step. */
        next_rad = rprop->before_rad;
        rprop->step_rad = nmpc_larger(nmpc_scaled(rprop->step_rad, NMPC_DECREASE), NMPC_STEP_MIN_RAD);
        rprop->direction = 0;
    } else {
        if (agreement > 0) {
            rprop->step_rad = nmpc_smaller(nmpc_scaled(rprop->step_rad, NMPC_INCREASE), NMPC_STEP_MAX_RAD);
        }
        if (slope > 0) {
            next_rad = nmpc_larger(move_rad - rprop->step_rad, -NMPC_TILT_LIMIT_RAD);
        } else if (slope < 0) {
            next_rad = nmpc_smaller(move_rad + rprop->step_rad, NMPC_TILT_LIMIT_RAD);
        } else {
            /* Level ground: stay. */
        }
        rprop->before_rad = move_rad;
        rprop->direction = slope;
    }
    return next_rad;
}

void nmpc_optimizer_minimize(nmpc_t *self)
{
    nmpc_rprop_t rprop[NMPC_MOVES];
    int updates = 0;
    int converged = 0;
    int iteration;
    int k;

    NMPC_UNROLL
    for (k = 0; k < NMPC_MOVES; k++) {
        rprop[k].step_rad = NMPC_INITIAL_STEP_RAD;
        rprop[k].before_rad = self->plan_rad[k];
        rprop[k].direction = 0;
    }

    for (iteration = 0; iteration < NMPC_ITERATIONS; iteration++) {
        const nmpc_sum_t previous_cost = self->cost;

        self->cost = nmpc_cost_evaluate(self);
        if ((iteration > 0) && (nmpc_absolute(self->cost - previous_cost) < NMPC_TOLERANCE)) {
            converged = 1;
        }
        if (converged == 0) {
            updates++;
        }
        /* Once the cost has come to rest all slopes are level: the plan stays, and the work goes on. */
        for (k = 0; k < NMPC_MOVES; k++) {
            const int slope = (converged == 0) ? nmpc_sign(self->gradient[k]) : 0;

            self->plan_rad[k] = update(&rprop[k], self->plan_rad[k], slope);
        }
    }
    self->iterations = (unsigned char)updates;
    self->converged = (unsigned char)converged;
}
