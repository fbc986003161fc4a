/* SPDX-License-Identifier: MIT-0
 *
 * Optimizer: the exact minimum of the quadratic cost (not in the paper).
 *
 * Along one axis of the heading, right or forward, let e and v be the errors of position and velocity, w the
 * disturbance less the target's acceleration, j the target's jerk, and a, i, c, u the attitude model's states
 * (nmpc_attitude.h). In seconds and metres
 *
 *     e' = v,   v' = a + w,   w' = -j,   j' = -j / 1 s,
 *
 * and the cost is the sum over all control steps to come of
 *
 *     e^2 + (velocity_weight v)^2 + (response_time^3 (u(k+i) - u(k+i-1)) / T_s)^2.
 *
 * Free are U1, the command of this control step, and U2, to which the command then runs in a ramp of 0.4 s; behind
 * it the cost to go is that of the Riccati equation. Without limits the minimum is U = rows [e v w j a i c u]. Each of
 * U1 and U2 is limited to the same box. With H the second derivatives of the cost, the minimum in the box has
 *
 *     U1 = clamp(U1 - H12/H11 (clamp(U2) - U2)):
 *
 * the best U1 beside U2 at its limit, if U2 is beyond it. The minimum could be elsewhere only with U1 at its limit and
 * U2 within: then U1 is so far beyond, H12^2 being less than H11 H22, that this line cuts it off at the same limit.
 * The axes do not interact, so there is one such problem for each.
 */
#ifndef NMPC_OPTIMIZER_H
#define NMPC_OPTIMIZER_H

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define NMPC_STATES 8

/* Return the first free move along `axis` that minimises the cost from `state`, which is e (m), v (m/step), and
 * w, j, a, i, c, u (m/step^2). The moves lie within +/- `limit_m_step2`. */
nmpc_real_t nmpc_optimizer_minimize(int axis, const nmpc_real_t state[NMPC_STATES], nmpc_real_t limit_m_step2);

#ifdef __cplusplus
}
#endif

#endif
