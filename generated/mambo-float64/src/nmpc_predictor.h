/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: the error between drone and target over the horizon, for given moves (eqs 8-11).
 *
 * Along one axis of the world let r be the position, v the velocity and a the acceleration of the drone,
 * linear in roll and pitch by eq 8, and e = r - Tp the error. Eqs 9 to 11 say
 *
 *     r(k+1) = r(k) + tau v(k) + tau^2/2 a(k),   v(k+1) = v(k) + tau a(k),   Tp(k+1) = Tp(k) + tau Tv
 *
 * (eq 9 prints tau/2). So the displacement d(k) = e(k+1) - e(k) is tau (v(k) - Tv) + s A(k), with A = tau^2 a
 * and s = 1/2, and
 *
 *     e(k+1) = e(k) + d(k),   d(k+1) = d(k) + A(k) + s (A(k+1) - A(k)).
 *
 * A step is two additions. A changes only where a move changes the tilt: only there a product is needed.
 *
 * Roll and pitch follow a move with a first-order lag. Let A be the acceleration at the commanded tilt; what
 * the lag still withholds of it, the deficit D <= 0 for a step up, is added: d(k+1) = d(k) + A(k) + D(k).
 * Solved exactly, with h = tau/lag and c = 1 - exp(-h), a change of A by dA adds (1/2 - (h - c)/h^2) dA to d
 * and -(c/h)^2 dA to D, and D decays by exp(-h) per step.
 */
#ifndef NMPC_PREDICTOR_H
#define NMPC_PREDICTOR_H

#include "nmpc.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x8D00AE40UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define NMPC_ROLL 0
#define NMPC_PITCH 1

/* s: the share of A that displaces the drone within the same step. */
#define NMPC_DISPLACEMENT_SHARE 0.5

/* The same for a change of A that roll or pitch follows with its lag, the share of the change that enters the
 * deficit, and the factor by which the deficit decays per step. */
#define NMPC_ROLL_DISPLACEMENT_SHARE 0.03228976644343329
#define NMPC_PITCH_DISPLACEMENT_SHARE 0.05589621423307961
#define NMPC_ROLL_DEFICIT_SHARE 0.8185285798718096
#define NMPC_PITCH_DEFICIT_SHARE 0.7008401225225181
#define NMPC_ROLL_DEFICIT_DECAY 0.8157040254665104
#define NMPC_PITCH_DEFICIT_DECAY 0.6930406200864415

/* The response of a move: the change of the error at each step per unit of A of that move. The table holds
 * twice the sum of the response from the first step to each, and once the sum over the whole horizon in its
 * last row. Axes with the same lag share a response. */
#define NMPC_AXES_PER_RESPONSE 1
#define NMPC_RESPONSES (NMPC_MOVES / NMPC_AXES_PER_RESPONSE)
extern const nmpc_real_t nmpc_predictor_response_sum[NMPC_PREDICTION_HORIZON][NMPC_RESPONSES];

/* Evaluate eq 8 at the present yaw and thrust, and start the roll-out along each axis of the world. */
void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            nmpc_real_t thrust_acceleration_m_s2, nmpc_prediction_t *prediction);

/* Apply a change of tilt to the roll-out along one axis. */
static inline void nmpc_predictor_change_tilt(nmpc_rollout_t *rollout, const nmpc_real_t gain_m_step2[NMPC_AXES],
                                              nmpc_real_t roll_change_rad, nmpc_real_t pitch_change_rad)
{
    const nmpc_real_t roll_m_step2 = gain_m_step2[NMPC_ROLL] * roll_change_rad;
    const nmpc_real_t pitch_m_step2 = gain_m_step2[NMPC_PITCH] * pitch_change_rad;

    rollout->displacement_m_step = rollout->displacement_m_step
                                   + ((NMPC_ROLL_DISPLACEMENT_SHARE * roll_m_step2)
                                      + (NMPC_PITCH_DISPLACEMENT_SHARE * pitch_m_step2));
    rollout->acceleration_m_step2 = rollout->acceleration_m_step2 + (roll_m_step2 + pitch_m_step2);
    rollout->roll_deficit_m_step2 = rollout->roll_deficit_m_step2
                                    - (NMPC_ROLL_DEFICIT_SHARE * roll_m_step2);
    rollout->pitch_deficit_m_step2 = rollout->pitch_deficit_m_step2
                                     - (NMPC_PITCH_DEFICIT_SHARE * pitch_m_step2);
}

/* Apply the moves of step `i` of the control horizon: the change from the moves before, or the initial tilt. */
static inline void nmpc_predictor_apply_moves(const nmpc_prediction_t *prediction,
                                              const nmpc_real_t moves_rad[NMPC_MOVES], int i, nmpc_rollout_t *x,
                                              nmpc_rollout_t *y)
{
    const nmpc_real_t *move_rad = &moves_rad[NMPC_AXES * i];
    const nmpc_real_t *previous_rad = (i > 0) ? &moves_rad[NMPC_AXES * (i - 1)] : prediction->tilt_rad;
    const nmpc_real_t roll_change_rad = move_rad[NMPC_ROLL] - previous_rad[NMPC_ROLL];
    const nmpc_real_t pitch_change_rad = move_rad[NMPC_PITCH] - previous_rad[NMPC_PITCH];

    nmpc_predictor_change_tilt(x, prediction->gain_x_m_step2, roll_change_rad, pitch_change_rad);
    nmpc_predictor_change_tilt(y, prediction->gain_y_m_step2, roll_change_rad, pitch_change_rad);
}

/* Advance the roll-out along one axis by one prediction step. */
static inline void nmpc_predictor_step(nmpc_rollout_t *rollout)
{
    rollout->error_m = rollout->error_m + rollout->displacement_m_step;
    rollout->displacement_m_step = rollout->displacement_m_step
                                   + (rollout->acceleration_m_step2
                                      + (rollout->roll_deficit_m_step2 + rollout->pitch_deficit_m_step2));
    rollout->roll_deficit_m_step2 = NMPC_ROLL_DEFICIT_DECAY * rollout->roll_deficit_m_step2;
    rollout->pitch_deficit_m_step2 = NMPC_PITCH_DEFICIT_DECAY * rollout->pitch_deficit_m_step2;
}

#ifdef __cplusplus
}
#endif

#endif
