/* SPDX-License-Identifier: MIT-0
 *
 * Observer: a Kalman filter with fixed gains for position, velocity and disturbance (not in the paper).
 *
 * Index k counts control steps of T_s = 0.01 s, which are the unit of time here: m_step is m/T_s and m_step2
 * is m/T_s^2. Along one axis of the world, x or y, let p, v and d be the estimates of position, velocity and
 * disturbance: the acceleration that tilt and drag do not explain, as wind and model errors make it. With the measured
 * position r_k and velocity v_k, the innovations correct the estimates,
 *
 *     n_p = r_k - p,   n_v = T_s v_k - v,   p += L11 n_p + L12 n_v,   v += L21 n_p + L22 n_v,
 *     d += L31 n_p + L32 n_v,
 *
 * and from one control step to the next they follow the acceleration A = a + d - drag v, where a is that of the tilt:
 *
 *     p(k+1) = p + v + A/2,   v(k+1) = v + A,   d(k+1) = d.
 *
 * The gains L are those of the stationary Kalman filter for the noise densities of the settings. Every estimate is
 * limited, so that it stays finite for any input.
 */
#ifndef NMPC_OBSERVER_H
#define NMPC_OBSERVER_H

#include "nmpc.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xF8CA429DUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define NMPC_POSITION_BY_POSITION 0.044412196f /* L11 */
#define NMPC_POSITION_BY_VELOCITY 0.5697748f /* L12 */
#define NMPC_VELOCITY_BY_POSITION 0.001424437f /* L21 */
#define NMPC_VELOCITY_BY_VELOCITY 0.05931779f /* L22 */
#define NMPC_DISTURBANCE_BY_POSITION 1.1298302e-05f /* L31 */
#define NMPC_DISTURBANCE_BY_VELOCITY 0.0005300324f /* L32 */
#define NMPC_VELOCITY_LIMIT_M_STEP 1.0f /* of v */
#define NMPC_DISTURBANCE_LIMIT_M_STEP2 0.0003f /* of d */
#define NMPC_HALF 0.5f
#define NMPC_DRAG_1_STEP 0.00067f /* deceleration per velocity */

/* Forget the estimates: position, velocity and disturbance are 0. */
void nmpc_observer_clear(nmpc_t *self);

/* Set position and velocity to the measured ones. The disturbance stays. */
void nmpc_observer_start(nmpc_t *self, const nmpc_state_t *state);

/* Correct the estimates by a measured state. */
void nmpc_observer_correct(nmpc_t *self, const nmpc_state_t *state);

/* Predict the estimates at the next control step; `tilt_m_step2` is the acceleration of the tilt along x and y. */
void nmpc_observer_predict(nmpc_t *self, const nmpc_real_t tilt_m_step2[2]);

/* The acceleration along `axis` that the tilt does not explain: d - drag v. */
static inline nmpc_real_t nmpc_observer_disturbance(const nmpc_t *self, int axis)
{
    return self->observer.disturbance_m_step2[axis]
           - (NMPC_DRAG_1_STEP * self->observer.velocity_m_step[axis]);
}

#ifdef __cplusplus
}
#endif

#endif
