/* SPDX-License-Identifier: MIT-0
 *
 * Optimizer: RPROP with a fixed number of iterations, variant rprop+
 * (Riedmiller and Braun 1993; Igel and Huesken 2000).
 */
#include "nmpc_optimizer.h"

#include "nmpc_cost.h"
#include "nmpc_math.h"

/* Update move `k`, downhill and within the tilt limit: RPROP reads nothing of the gradient but its sign, now
 * and before. Once the cost has come to rest all slopes are level: the plan stays, and the work goes on. */
static void update_move(nmpc_t *self, int k)
{
    const int slope = (self->converged == 0U) ? nmpc_sign(self->gradient[k]) : 0;
    const int agreement = slope * (int)self->direction[k];
    const nmpc_real_t move_rad = self->plan_rad[k];

    if (agreement < 0) {
        /* The last update crossed a minimum: take it back, and go on with a shorter step. */
        self->step_rad[k] = nmpc_larger(self->step_rad[k] * NMPC_DECREASE, NMPC_STEP_MIN_RAD);
        self->plan_rad[k] = self->before_rad[k];
        self->direction[k] = 0;
    } else {
        if (agreement > 0) {
            self->step_rad[k] = nmpc_smaller(self->step_rad[k] * NMPC_INCREASE, NMPC_STEP_MAX_RAD);
        }
        self->before_rad[k] = move_rad;
        if (slope > 0) {
            self->plan_rad[k] = nmpc_larger(move_rad - self->step_rad[k], -NMPC_TILT_LIMIT_RAD);
        } else if (slope < 0) {
            self->plan_rad[k] = nmpc_smaller(move_rad + self->step_rad[k], NMPC_TILT_LIMIT_RAD);
        } else {
            /* Level ground: stay. */
        }
        self->direction[k] = (signed char)slope;
    }
}

void nmpc_optimizer_minimize(nmpc_t *self)
{
    int iteration;
    int k;

    for (k = 0; k < NMPC_MOVES; k++) {
        self->step_rad[k] = NMPC_INITIAL_STEP_RAD;
        self->direction[k] = 0;
    }
    self->iterations = 0U;
    self->converged = 0U;

    for (iteration = 0; iteration < NMPC_ITERATIONS; iteration++) {
        const nmpc_real_t previous_cost = self->cost;

        self->cost = nmpc_cost_evaluate(&self->prediction, &self->weights, self->command_rad, self->plan_rad,
                                        self->gradient);
        if ((iteration > 0) && (nmpc_absolute(self->cost - previous_cost) < NMPC_TOLERANCE)) {
            self->converged = 1U;
        }
        for (k = 0; k < NMPC_MOVES; k++) {
            update_move(self, k);
        }
        if (self->converged == 0U) {
            self->iterations++;
        }
    }
}
