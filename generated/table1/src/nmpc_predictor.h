/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: the error between drone and target over the horizon, for given moves (eqs 8-11).
 *
 * Index i counts prediction steps of length tau from the present control step k on: the paper writes k + i in
 * eq 12. Along one axis, x or y, let r, v and a be position, velocity and acceleration of the drone, a being linear
 * in roll and pitch by eq 8; let Tp and Tv be position and velocity of the target, and e = r - Tp the error. Eq 12a
 * prints Tp_k; here the target is propagated by eq 11. Eqs 9 and 11, and the velocity for constant acceleration over
 * a step, which the paper does not print, are
 *
 *     r(i+1) = r(i) + tau v(i) + tau^2/2 a(i),   v(i+1) = v(i) + tau a(i),   Tp(i+1) = Tp(i) + tau Tv
 *
 * (eq 9 prints tau/2). So the displacement d(i) = e(i+1) - e(i) is tau (v(i) - Tv) + s A(i), with A = tau^2 a
 * and s = 1/2, and
 *
 *     e(i+1) = e(i) + d(i),   d(i+1) = d(i) + A(i) + s dA(i+1),   dA(i+1) = A(i+1) - A(i).
 *
 * A prediction step is two additions. A changes only where a move changes: only there products are needed.
 */
#ifndef NMPC_PREDICTOR_H
#define NMPC_PREDICTOR_H

#include "nmpc.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define NMPC_ROLL 0
#define NMPC_PITCH 1

#define NMPC_DISPLACEMENT_SHARE 0.5f /* s */

/* The response R(i) of a move is the change of the error e(i+1) per unit of A of that move. S(i) = R(0) + ... + R(i).
 * Row i of the table holds 2 S(i); the last row holds S. Columns: steps of the control horizon; roll and pitch,
 * which have equal lags, share one. */
#define NMPC_ANGLES_PER_RESPONSE 2 /* 2 if roll and pitch have one response, else 1 */
#define NMPC_RESPONSES (NMPC_MOVES / NMPC_ANGLES_PER_RESPONSE)
extern const nmpc_real_t nmpc_predictor_response_sum[NMPC_HORIZON_PREDICTION][NMPC_RESPONSES];

/* Evaluate eq 8 at the present yaw and thrust, and start the roll-out along x and along y. */
void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            nmpc_real_t thrust_acceleration_m_s2, nmpc_prediction_t *prediction);

/* Apply a change of the moves of roll and pitch to the roll-out along one axis: the terms with dA. */
static inline void nmpc_predictor_change_tilt(nmpc_rollout_t *rollout, const nmpc_real_t gain_m_step2_rad[NMPC_ANGLES],
                                              nmpc_real_t roll_change_rad, nmpc_real_t pitch_change_rad)
{
    const nmpc_real_t roll_m_step2 = gain_m_step2_rad[NMPC_ROLL] * roll_change_rad;
    const nmpc_real_t pitch_m_step2 = gain_m_step2_rad[NMPC_PITCH] * pitch_change_rad;
    const nmpc_real_t change_m_step2 = roll_m_step2 + pitch_m_step2;

    rollout->displacement_m_step = rollout->displacement_m_step
                                   + (NMPC_DISPLACEMENT_SHARE * change_m_step2);
    rollout->acceleration_m_step2 = rollout->acceleration_m_step2 + change_m_step2;
}

/* Apply the moves of step `i` of the control horizon: their change from the moves before, or from the initial tilt. */
static inline void nmpc_predictor_apply_moves(const nmpc_prediction_t *prediction,
                                              const nmpc_real_t moves_rad[NMPC_MOVES], int i, nmpc_rollout_t *x,
                                              nmpc_rollout_t *y)
{
    const nmpc_real_t *move_rad = &moves_rad[NMPC_ANGLES * i];
    const nmpc_real_t *previous_rad = (i > 0) ? &moves_rad[NMPC_ANGLES * (i - 1)] : prediction->tilt_rad;
    const nmpc_real_t roll_change_rad = move_rad[NMPC_ROLL] - previous_rad[NMPC_ROLL];
    const nmpc_real_t pitch_change_rad = move_rad[NMPC_PITCH] - previous_rad[NMPC_PITCH];

    nmpc_predictor_change_tilt(x, prediction->gain_x_m_step2_rad, roll_change_rad, pitch_change_rad);
    nmpc_predictor_change_tilt(y, prediction->gain_y_m_step2_rad, roll_change_rad, pitch_change_rad);
}

/* Advance the roll-out along one axis by one prediction step: e(i+1), and d(i+1) without its terms with dA. */
static inline void nmpc_predictor_step(nmpc_rollout_t *rollout)
{
    rollout->error_m = rollout->error_m + rollout->displacement_m_step;
    rollout->displacement_m_step = rollout->displacement_m_step + rollout->acceleration_m_step2;
}

#ifdef __cplusplus
}
#endif

#endif
