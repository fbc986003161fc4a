/* SPDX-License-Identifier: MIT-0
 *
 * Attitude model: how the drone accelerates in answer to the commands (not in the paper).
 *
 * Axes are those of the heading: 0 is right, which roll tilts to, and 1 is forward, which minus pitch tilts to. Along
 * each let u be the commanded acceleration, c the command behind the dead time and the quick lags, a the acceleration
 * that the tilt gives, and i the integral part of the attitude loop, all in m/step^2. They obey
 *
 *     lag a' = c - a + i,   i' = integral (u - a) - i / 1000 s,   delay c' = u - c
 *
 * with these times, in seconds, and rates, in 1/s:        lag      delay    integral
 *     roll                                              0.2300     0.0450      1.0000
 *     pitch                                             0.1540     0.0600      0.7700
 *
 * u is held over a control step; the rows below are the exact solution. Every state is limited, beyond what any
 * command within the limit makes it.
 */
#ifndef NMPC_ATTITUDE_H
#define NMPC_ATTITUDE_H

#include "nmpc.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define NMPC_RIGHT 0
#define NMPC_FORWARD 1

/* Acceleration per measured tilt, and per commanded roll and pitch; commands per acceleration. */
#define NMPC_GAIN_M_STEP2_RAD 1078620907
#define NMPC_ROLL_GAIN_M_STEP2_RAD 1078620907
#define NMPC_PITCH_GAIN_M_STEP2_RAD 1078620907
#define NMPC_ROLL_PER_ACCELERATION 1068884811
#define NMPC_PITCH_PER_ACCELERATION 1068884811


/* The largest |u| that a move may have, and the largest |a|, |i| and |c|, and |u| when it turns. */
#define NMPC_RIGHT_LIMIT_M_STEP2 46084
#define NMPC_FORWARD_LIMIT_M_STEP2 46084
#define NMPC_ATTITUDE_LIMIT_M_STEP2 62212207

/* Set the model to the steady attitude of a command. */
void nmpc_attitude_reset(nmpc_t *self, nmpc_real_t roll_rad, nmpc_real_t pitch_rad);

/* Set the last command of the model, u. */
void nmpc_attitude_set_command(nmpc_t *self, nmpc_real_t roll_rad, nmpc_real_t pitch_rad);

/* The command, in rad, that stands for u; beyond the tilt limit by rounding at most. */
static inline nmpc_real_t nmpc_attitude_roll(const nmpc_t *self)
{
    return nmpc_command_product(NMPC_ROLL_PER_ACCELERATION, self->attitude.command_m_step2[NMPC_RIGHT]);
}

static inline nmpc_real_t nmpc_attitude_pitch(const nmpc_t *self)
{
    return -nmpc_command_product(NMPC_PITCH_PER_ACCELERATION, self->attitude.command_m_step2[NMPC_FORWARD]);
}

/* Set `tilt_m_step2` to the accelerations, right and forward, of a measured attitude. */
void nmpc_attitude_measure(const nmpc_state_t *state, nmpc_real_t tilt_m_step2[2]);

/* Let the model answer the last commands over one control step. */
void nmpc_attitude_advance(nmpc_t *self);

/* Turn tilt and command of the model to the heading with this sine and cosine. The integral part and the dead time
 * live in the axes of the body and stay. */
void nmpc_attitude_turn(nmpc_t *self, nmpc_real_t sine, nmpc_real_t cosine);

#ifdef __cplusplus
}
#endif

#endif
