/* ---- Optimizer ------------------------------------------------------------------------------------------------------
 *
 * The exact minimum of the quadratic cost (not in the paper).
 *
 * Along one axis of the heading, right or forward, let e and v be the errors of position and velocity, w the
 * disturbance, with drag, less the target's acceleration, j the target's jerk, and a, i, c, u the attitude model's
 * states; a is the measured tilt's acceleration where the tilt is measured. In seconds and metres
 *
 *     e' = v,   v' = a + w,   w' = -j - w / 1000 s,   j' = -j / 1 s,
 *
 * where a jerk fades within a second, so that a corner of the target's path is not continued for ever, and the slow
 * decay of w gives the cost of a lasting one a bound. The cost is the sum over all control steps to come of
 *
 *     e^2 + (velocity_weight v)^2 + (response_time^3 (u(k+i) - u(k+i-1)) / T_s)^2.
 *
 * The axes do not interact, so there is one such problem for each.
 */

#if WITH_TWO_MOVES
/* Free are U1, the command of this control step, and U2, to which the command then runs in a ramp; behind it the cost
 * to go is that of the Riccati equation. Without limits the minimum is U = rows * state. Each of U1 and U2 is limited
 * to the same box. With H the second derivatives of the cost, the minimum in the box has
 *
 *     U1 = clamp(U1 - H12/H11 (clamp(U2) - U2)):
 *
 * the best U1 beside U2 at its limit, if U2 is beyond it. The minimum could be elsewhere only with U1 at its limit and
 * U2 within: then U1 is so far beyond, H12^2 being less than H11 H22, that this line cuts it off at the same limit. */
#else
/* Free is U1, the command of this control step; behind it the cost to go is that of the Riccati equation. The minimum
 * is U1 = row * state, cut off at the limit: for one free variable that is the exact minimum in the box. */
#endif
#include "optimizer.h"

/* A row times the state. */
NMPC_INLINE nmpc_real_t optimizer_row(const nmpc_real_t row[NMPC_STATES], const nmpc_real_t state[NMPC_STATES])
{
    nmpc_sum_t sum = wide_product(row[0], state[0]);
    int k;

    NMPC_UNROLL
    for (k = 1; k < NMPC_STATES; k++) {
        sum = sum + wide_product(row[k], state[k]);
    }
    return row_sum(sum);
}

/* Return the first free move along `axis` that minimises the cost from `state`, of the members that the rows name, in
 * m, m/step and m/step^2. The moves lie within +/- `limit_m_step2`. */
NMPC_INLINE nmpc_real_t optimizer_minimize(int axis, const nmpc_real_t state[NMPC_STATES], nmpc_real_t limit_m_step2)
{
    nmpc_real_t move_m_step2 = optimizer_row(move_rows[axis][0], state);
#if WITH_TWO_MOVES
    const nmpc_real_t second_m_step2 = optimizer_row(move_rows[axis][1], state);

    if (within(second_m_step2, limit_m_step2) == 0) {
#if WITH_HEIGHT
        const nmpc_real_t change_m_step2 = shared_clamp(second_m_step2, limit_m_step2) - second_m_step2;
#else
        const nmpc_real_t change_m_step2 =
            ((second_m_step2 < (nmpc_real_t)0) ? -limit_m_step2 : limit_m_step2) - second_m_step2;
#endif

        move_m_step2 = move_m_step2 - ratio_product(move_ratios[axis], change_m_step2);
    }
#endif

    return clamp(move_m_step2, limit_m_step2);
}
