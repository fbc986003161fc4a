/* SPDX-License-Identifier: MIT-0
 *
 * Target tracker: the target's acceleration and its rate, estimated by an alpha-beta filter (not in the paper).
 *
 * Index k counts control steps, which are T_s = 0.01 s apart. Along one axis, x or y, let Tv_k be the velocity of the
 * target, A_T = tau^2 a_T its acceleration, and J_T the change of A_T from one control step to the next: the jerk. In
 * every control step the measured acceleration M, the predicted one P and the new estimates are
 *
 *     M = tau^2/T_s (Tv_k - Tv_k-1)          P = A_T(k-1) + J_T(k-1)
 *     A_T(k) = P + alpha (M - P)             J_T(k) = J_T(k-1) + beta (M - P)
 *
 * with alpha = 0.5 and beta = alpha^2 / (2 - alpha) (T. R. Benedict, G. W. Bordner, Synthesis of an optimal set of
 * radar track-while-scan smoothing equations, IRE Transactions on Automatic Control 7(4), 1962). So an acceleration
 * that rises at a constant rate is estimated without a lag. A_T and J_T are limited.
 *
 * A change of velocity of more than 1.5 times what gravity and the tilt limit let the drone follow is a jump: the
 * target was set elsewhere. Then A_T stays and J_T is 0. In the first control step there is no Tv_k-1, and both are 0.
 */
#ifndef NMPC_TRACKER_H
#define NMPC_TRACKER_H

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define NMPC_TARGET_CHANGE_LIMIT_M_S 432034 /* of Tv in T_s: 1.5 g times the tilt limit, or less */
#define NMPC_STEP_SQUARED_PER_UPDATE_S 1374389535 /* tau^2/T_s */
#define NMPC_TARGET_ACCELERATION_LIMIT_M_STEP2 35392249 /* of A_T: the largest M */
#define NMPC_TARGET_JERK_LIMIT_M_STEP2_UPDATE 3539225 /* of J_T: a tenth of that */
#define NMPC_TRACKER_GAIN 536870912 /* alpha */
#define NMPC_TRACKER_JERK_GAIN 178956971 /* beta */

/* Forget the target: no velocity, no acceleration, no jerk. */
void nmpc_tracker_clear(nmpc_t *self);

/* Take the target's velocity of this control step into the estimates. */
void nmpc_tracker_update(nmpc_t *self, const nmpc_real_t velocity_m_s[2]);

#ifdef __cplusplus
}
#endif

#endif
