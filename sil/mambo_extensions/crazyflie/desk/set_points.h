/* Set-points: those that come by radio, and the plans of the high-level commander, polynomials of degree 7.
 *
 * A set-point by radio goes before a plan until the pilot yields. From 0.5 s without one the supervisor levels out, and after
 * 2 s it stops the motors (`supervise`). */
#ifndef SET_POINTS_H
#define SET_POINTS_H

#include <stdbool.h>

#include "crtp_commander_high_level.h"
#include "stabilizer_types.h"

/* Forget all set-points. */
void set_points_start(void);

/* Take a set-point that has come by radio; it ends a plan. */
void set_points_send(const setpoint_t *setpoint, uint32_t now_ms);

/* Let the high-level commander fly. */
void set_points_yield(void);

/* Plan a flight to a place, from where the last set-point or, without one, the estimate is; a landing stops the motors at its end. */
void set_points_plan(const double position_m[3], double yaw_rad, double duration_s, bool lands, uint32_t now_ms);

/* Plan a take-off or a landing: a flight up or down. */
void set_points_lift(double z_m, double yaw_rad, double duration_s, bool lands, uint32_t now_ms);

/* Write pieces of a trajectory into memory, from a place on; fly the first `count` of them. */
void set_points_write(int first, const double *written, int count);
void set_points_follow(int count, uint32_t now_ms);

/* What the high-level commander does. */
enum trajectory_state set_points_state(void);

/* Write the present set-point. */
void set_points_now(setpoint_t *setpoint, const state_t *state, uint32_t now_ms);

/* Write what the firmware's loops ask of the motors, as shares of the most (`loops.c`). */
void mix(const control_t *control, double motors[4]);

#endif
