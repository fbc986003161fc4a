/* ---- Guard ----------------------------------------------------------------------------------------------------------
 *
 * Budgets that bound how much the commands vary (not in the paper). Where target or estimate are noisy the commands
 * rattle, and a mixer that serves attitude first then takes the thrust. Let u* be the command that the cost asks for,
 * of roll, of pitch or of the thrust, and b its budget. In every control step with a new command
 *
 *     b = min(b + rho, full),   u(k) = u(k-1) + clamp(u* - u(k-1), b),   b = b - |u(k) - u(k-1)|.
 *
 * So over n steps u varies by at most full + n rho, while one swing from end to end is free. The attitude model is told
 * u. u is the minimum in the smaller box, since the cost, minimised over all that follows, is convex in u. A command
 * that is held, that levels after an outage, or that the caller sets, takes nothing from a budget.
 */

#include "guard.h"

/* Return the command nearest to `wanted` that a budget allows, and take its distance from `before` from the budget. */
NMPC_SHARED nmpc_real_t guard_spend(nmpc_real_t *budget, nmpc_real_t full, nmpc_real_t growth, nmpc_real_t before,
                                    nmpc_real_t wanted)
{
    const nmpc_real_t grown = *budget + growth;
    const nmpc_real_t allowed = (grown > full) ? full : grown;
    const nmpc_real_t change = clamp(wanted - before, allowed);
    const nmpc_real_t rest = allowed - ((change < (nmpc_real_t)0) ? -change : change);

    /* It is never less than 0; a proof by intervals does not see that. */
    *budget = (rest < (nmpc_real_t)0) ? (nmpc_real_t)0 : rest;
    return (within(wanted - before, allowed) != 0) ? wanted : (before + change);
}
