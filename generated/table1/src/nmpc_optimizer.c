/* SPDX-License-Identifier: MIT-0
 *
 * Optimizer: RPROP with a fixed number of iterations, variant rprop+
 * (Riedmiller and Braun 1993; Igel and Huesken 2000).
 */
#include "nmpc_optimizer.h"

#include "nmpc_cost.h"
#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* State of RPROP for one move. */
typedef struct {
    nmpc_real_t step_rad;     /* Delta: the step size */
    nmpc_real_t previous_rad; /* the move before its last update */
    int previous_sign;        /* sign of dJ/du at the last update; 0 after a step back */
} nmpc_rprop_t;

/* Return the updated move, within the tilt limit. RPROP uses the sign of the gradient dJ/du, not its size:
 * while the sign stays the same the step size is multiplied by eta+, where it changes by eta-. */
static nmpc_real_t update(nmpc_rprop_t *rprop, nmpc_real_t move_rad, int sign)
{
    const int agreement = sign * rprop->previous_sign;
    nmpc_real_t next_rad = move_rad;

    if (agreement < 0) {
        /* The last update stepped over a minimum: undo it and reduce the step size. */
        next_rad = rprop->previous_rad;
        rprop->step_rad = nmpc_larger(rprop->step_rad * NMPC_DECREASE, NMPC_STEP_MIN_RAD);
        rprop->previous_sign = 0;
    } else {
        if (agreement > 0) {
            rprop->step_rad = nmpc_smaller(rprop->step_rad * NMPC_INCREASE, NMPC_STEP_MAX_RAD);
        }
        if (sign > 0) {
            next_rad = nmpc_larger(move_rad - rprop->step_rad, -NMPC_TILT_LIMIT_RAD);
        } else if (sign < 0) {
            next_rad = nmpc_smaller(move_rad + rprop->step_rad, NMPC_TILT_LIMIT_RAD);
        } else {
            /* Zero gradient: the move stays. */
        }
        rprop->previous_rad = move_rad;
        rprop->previous_sign = sign;
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
        rprop[k].previous_rad = self->plan_rad[k];
        rprop[k].previous_sign = 0;
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
        /* After convergence the signs are taken as 0: the plan is frozen, and the iterations still run, so
         * that the work of a control step is constant. */
        for (k = 0; k < NMPC_MOVES; k++) {
            const int sign = (converged == 0) ? nmpc_sign(self->gradient[k]) : 0;

            self->plan_rad[k] = update(&rprop[k], self->plan_rad[k], sign);
        }
    }
    self->iterations = (unsigned char)updates;
    self->converged = (unsigned char)converged;
}
