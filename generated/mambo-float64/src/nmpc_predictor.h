/* SPDX-License-Identifier: MIT-0
 *
 * Predictor: how far robot and target will be apart, given the moves (eqs 8-11).
 *
 * Along each axis of the world the error walks over the horizon by its differences: a step adds the advance
 * to the error and the bend to the advance. That is eq 9 with its velocity update, sums of constants apart.
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

/* What a turn of roll, pitch adds to the advance at once, what it delays, and what remains of that a step
 * later: shares of the bend that it ends in. */
#define NMPC_ROLL_AT_ONCE 0.03228976644343329
#define NMPC_PITCH_AT_ONCE 0.05589621423307961
#define NMPC_ROLL_DELAYED 0.8185285798718096
#define NMPC_PITCH_DELAYED 0.7008401225225181
#define NMPC_ROLL_DECAY 0.8157040254665104
#define NMPC_PITCH_DECAY 0.6930406200864415

/* How far a unit of bend of each move has carried the error, summed over all steps to each; twice that, but for
 * the last step. Axes that settle alike share their responses. */
#define NMPC_AXES_ALIKE 1
#define NMPC_RESPONSES (NMPC_MOVES / NMPC_AXES_ALIKE)
extern const nmpc_real_t nmpc_predictor_response_sum[NMPC_PREDICTION_HORIZON][NMPC_RESPONSES];

/* Evaluate eq 8 at the present heading and thrust, and find where the walks start without moves. */
void nmpc_predictor_prepare(const nmpc_state_t *state, const nmpc_target_t *target,
                            nmpc_real_t thrust_acceleration_m_s2, nmpc_prediction_t *prediction);

/* Bend a walk by a turn of roll and pitch. */
static inline void nmpc_predictor_bend(nmpc_walk_t *walk, const nmpc_real_t gain_m[NMPC_AXES],
                                       nmpc_real_t roll_rad, nmpc_real_t pitch_rad)
{
    const nmpc_real_t roll_m = nmpc_bend(gain_m[NMPC_ROLL], roll_rad);
    const nmpc_real_t pitch_m = nmpc_bend(gain_m[NMPC_PITCH], pitch_rad);

    walk->advance_m = walk->advance_m + (nmpc_part(NMPC_ROLL_AT_ONCE, roll_m) + nmpc_part(NMPC_PITCH_AT_ONCE, pitch_m));
    walk->bend_m = walk->bend_m + (roll_m + pitch_m);
    walk->roll_to_come_m = walk->roll_to_come_m - nmpc_part(NMPC_ROLL_DELAYED, roll_m);
    walk->pitch_to_come_m = walk->pitch_to_come_m - nmpc_part(NMPC_PITCH_DELAYED, pitch_m);
}

/* Make move `i` of the control horizon, a turn from the move before. */
static inline void nmpc_predictor_turn(const nmpc_prediction_t *prediction,
                                       const nmpc_real_t moves_rad[NMPC_MOVES], int i, nmpc_walk_t *x,
                                       nmpc_walk_t *y)
{
    const nmpc_real_t *move_rad = &moves_rad[NMPC_AXES * i];
    const nmpc_real_t *before_rad = (i > 0) ? &moves_rad[NMPC_AXES * (i - 1)] : prediction->tilt_rad;
    const nmpc_real_t roll_rad = move_rad[NMPC_ROLL] - before_rad[NMPC_ROLL];
    const nmpc_real_t pitch_rad = move_rad[NMPC_PITCH] - before_rad[NMPC_PITCH];

    nmpc_predictor_bend(x, prediction->gain_x_m, roll_rad, pitch_rad);
    nmpc_predictor_bend(y, prediction->gain_y_m, roll_rad, pitch_rad);
}

/* Go to the next predicted step. */
static inline void nmpc_predictor_walk(nmpc_walk_t *walk)
{
    walk->error_m = walk->error_m + nmpc_step_of(walk->advance_m);
    walk->advance_m = walk->advance_m + (walk->bend_m + (walk->roll_to_come_m + walk->pitch_to_come_m));
    walk->roll_to_come_m = nmpc_part(NMPC_ROLL_DECAY, walk->roll_to_come_m);
    walk->pitch_to_come_m = nmpc_part(NMPC_PITCH_DECAY, walk->pitch_to_come_m);
}

#ifdef __cplusplus
}
#endif

#endif
