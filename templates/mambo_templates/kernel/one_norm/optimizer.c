/* ---- Optimizer ------------------------------------------------------------------------------------------------------
 *
 * RPROP with a fixed number of iterations (Riedmiller and Braun 1993; Igel and Huesken 2000). Each move u has a step
 * size Delta. From the signs of the gradient g = dJ/du in this iteration and the one before,
 *
 *     equal:     Delta = min(eta+ Delta, Delta_max),   u -= sign(g) Delta
 *     opposite:  Delta = max(eta- Delta, Delta_min),   u before its last update (rprop+), or u (irprop-)
 *     else:                                            u -= sign(g) Delta.
 */

/* The limit of each angle, either way. */
NMPC_INLINE nmpc_real_t tilt_limit(const nmpc_t *self)
{
#if WITH_LIMITS
    return self->bounds.tilt_rad;
#else
    (void)self;
    return NMPC_TILT_LIMIT_RAD;
#endif
}

/* State of RPROP for one move. */
typedef struct {
    nmpc_real_t step_rad; /* Delta: the step size */
#if WITH_BACKTRACKING
    nmpc_real_t previous_rad; /* the move before its last update */
#endif
    int previous_sign; /* sign of dJ/du at the last update; 0 after a change of sign */
} nmpc_rprop_t;

/* Return the updated move, within the tilt limit. RPROP uses the sign of the gradient dJ/du, not its size:
 * while the sign stays the same the step size is multiplied by eta+, where it changes by eta-. */
static nmpc_real_t update(nmpc_rprop_t *rprop, nmpc_real_t move_rad, int sign, nmpc_real_t limit_rad)
{
    const int agreement = sign * rprop->previous_sign;
    nmpc_real_t next_rad = move_rad;

    if (agreement < 0) {
#if WITH_BACKTRACKING
        /* The last update stepped over a minimum: undo it and reduce the step size. */
        next_rad = rprop->previous_rad;
#else
        /* The last update stepped over a minimum: stay and reduce the step size. */
#endif
        rprop->step_rad = larger(step_product(rprop->step_rad, NMPC_DECREASE), NMPC_STEP_MIN_RAD);
        rprop->previous_sign = 0;
    } else {
        if (agreement > 0) {
            rprop->step_rad = smaller(step_product(rprop->step_rad, NMPC_INCREASE), NMPC_STEP_MAX_RAD);
        }
        if (sign > 0) {
            next_rad = larger(move_rad - rprop->step_rad, -limit_rad);
        } else if (sign < 0) {
            next_rad = smaller(move_rad + rprop->step_rad, limit_rad);
        } else {
            /* Zero gradient: the move stays. */
        }
#if WITH_BACKTRACKING
        rprop->previous_rad = move_rad;
#endif
        rprop->previous_sign = sign;
    }
    return next_rad;
}

/* Run I_max iterations of RPROP on `self->plan_rad`, starting from its present value. The cost may rise from one
 * iteration to the next; the plan after the last update is not evaluated, unless the search has converged. */
static void optimizer_minimize(nmpc_t *self)
{
    nmpc_rprop_t rprop[NMPC_MOVES];
    int updates = 0;
    int converged = 0;
    int iteration;
    int k;

    NMPC_UNROLL
    for (k = 0; k < NMPC_MOVES; k++) {
        rprop[k].step_rad = NMPC_INITIAL_STEP_RAD;
#if WITH_BACKTRACKING
        rprop[k].previous_rad = self->plan_rad[k];
#endif
        rprop[k].previous_sign = 0;
    }

    for (iteration = 0; iteration < NMPC_ITERATIONS; iteration++) {
        const nmpc_sum_t previous_cost = self->cost;

        self->cost = cost_evaluate(self);
        if ((iteration > 0) && (absolute_sum(self->cost - previous_cost) < NMPC_TOLERANCE)) {
            converged = 1;
        }
        if (converged == 0) {
            updates++;
        }
        /* After convergence the signs are taken as 0: the plan is frozen, and the iterations still run, so
         * that the work of a control step is constant. */
        for (k = 0; k < NMPC_MOVES; k++) {
            const int sign = (converged == 0) ? sign_of(self->gradient[k]) : 0;

            self->plan_rad[k] = update(&rprop[k], self->plan_rad[k], sign, tilt_limit(self));
        }
    }
    self->iterations = (unsigned char)updates;
    self->converged = (unsigned char)converged;
}
