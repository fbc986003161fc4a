/* SPDX-License-Identifier: MIT-0
 *
 * The interface of nmpc.h with floats in SI units, for firmware that computes in floating point. The
 * controller itself does not call these functions: link nmpc_float.c only if you use them.
 */
#ifndef NMPC_FLOAT_H
#define NMPC_FLOAT_H

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The structures of nmpc.h, in SI units. */
typedef struct {
    float position_m[2];
    float velocity_m_s[2];
    float roll_rad;
    float pitch_rad;
    float yaw_rad;
} nmpc_float_state_t;

typedef struct {
    float position_m[2];
    float velocity_m_s[2];
} nmpc_float_target_t;

typedef struct {
    float roll_rad;
    float pitch_rad;
} nmpc_float_command_t;

typedef struct {
    float position_m[2];
    float velocity_m_s[2];
    float disturbance_m_s2[2];
    int is_valid;
} nmpc_float_estimate_t;

/* nmpc_step(), nmpc_reset(), nmpc_set_command() and nmpc_last_estimate() with floats, which are rounded to the
 * nearest number, ties away from zero. NaN, infinity and what overflows become the largest number, which is
 * outside of every range and so refused, as in nmpc.h. */
nmpc_status_t nmpc_float_step(nmpc_t *self, const nmpc_float_state_t *state, const nmpc_float_target_t *target,
                              float thrust_acceleration_m_s2, nmpc_float_command_t *command);
nmpc_status_t nmpc_float_reset(nmpc_t *self, const nmpc_float_command_t *command);
nmpc_status_t nmpc_float_set_command(nmpc_t *self, const nmpc_float_command_t *command);
nmpc_status_t nmpc_float_last_estimate(const nmpc_t *self, nmpc_float_estimate_t *estimate);

#ifdef __cplusplus
}
#endif

#endif
