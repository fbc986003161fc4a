/* SPDX-License-Identifier: MIT-0
 *
 * Commands the drones of crazyflow inside a program of JAX: what CrazyflowPilot.command of crazyflow.py does, in the
 * same numbers. Compiled with the header of the jaxlib that calls it.
 */
#include <math.h>
#include <stdint.h>

#include "xla/ffi/api/c_api.h"

#include "columns.h"

/* What crazyflow_calls.py fills, member by member. */
typedef struct {
    int64_t (*step)(void *controller, const double *state, const double *target, double thrust, double *command);
    void (*reset)(void *controllers, int n, const void *command, int *status);
    void (*slew_heading)(int n, const double *previous, const double *wanted, double most_change, double *next);
    char *controllers;
    int64_t controller_bytes;
    const void *hover; /* the command that a reset takes */
    double most_turn_rad;
    int64_t ticks;
    double *yaw_rad; /* (worlds, drones), as the next two */
    const double *wanted_rad;
    const double *mass_kg;
    const double *targets; /* (commands, rows, curves, TARGET_COLUMNS) */
    int64_t rows;          /* worlds, or 1 if all are of one age */
    int64_t curves;        /* drones, or 1 if they have one curve */
    int64_t refused;       /* out: quaternions of another length than 1 */
} crazyflow_pilot_t;

static double clipped(double value)
{
    return (value > 1.0) ? 1.0 : ((value < -1.0) ? -1.0 : value);
}

/* State in the columns of the closed loop, z down, of one drone with z up. Returns 0 if the quaternion is none. */
static int measure(const float *position, const float *quaternion, const float *velocity, double *state)
{
    const double x = quaternion[0], y = quaternion[1], z = quaternion[2], w = quaternion[3];
    const double length = sqrt((((x * x) + (y * y)) + (z * z)) + (w * w));

    state[POSITION_M] = position[0];
    state[POSITION_M + 1] = -(double)position[1];
    state[VELOCITY_M_S] = velocity[0];
    state[VELOCITY_M_S + 1] = -(double)velocity[1];
    state[ROLL_RAD] = atan2(2.0 * ((w * x) + (y * z)), 1.0 - (2.0 * ((x * x) + (y * y))));
    state[PITCH_RAD] = -asin(clipped(2.0 * ((w * y) - (z * x))));
    state[YAW_RAD] = -atan2(2.0 * ((w * z) + (x * y)), 1.0 - (2.0 * ((y * y) + (z * z))));
    state[HEIGHT_M] = position[2];
    state[CLIMB_M_S] = velocity[2];
    state[ON_GROUND] = ((position[2] < FLOOR_HEIGHT_M) && (fabsf(velocity[2]) < FLOOR_CLIMB_M_S)) ? 1.0 : 0.0;
    return !(fabs(length - 1.0) > LENGTH_TOLERANCE);
}

static void command_drone(crazyflow_pilot_t *pilot, int64_t i, int is_new, const double *state, const double *target,
                          float *given)
{
    void *const controller = pilot->controllers + (i * pilot->controller_bytes);
    double *const yaw_rad = &pilot->yaw_rad[i];
    double command[COMMAND_COLUMNS];
    int status;

    if (is_new) {
        pilot->reset(controller, 1, pilot->hover, &status);
        *yaw_rad = NAN;
    }
    (void)pilot->step(controller, state, target, NAN, command);
    if (isnan(*yaw_rad) && (fabs(state[YAW_RAD]) <= YAW_LIMIT_RAD)) {
        *yaw_rad = state[YAW_RAD];
    }
    if (!isnan(*yaw_rad)) {
        pilot->slew_heading(1, yaw_rad, &pilot->wanted_rad[i], pilot->most_turn_rad, yaw_rad);
    }
    given[0] = (float)command[0];
    given[1] = (float)-command[1];
    given[2] = (float)-*yaw_rad;
    given[3] = (float)(command[2] * pilot->mass_kg[i]);
}

/* Operands: address of the pilot in two words, number of the command, steps (worlds, 1), positions, quaternions and
 * velocities (worlds, drones, 3 or 4). Result: commands (worlds, drones, 4). */
XLA_FFI_Error *crazyflow_command(XLA_FFI_CallFrame *frame)
{
    const XLA_FFI_Extension_Base *const extension = frame->extension_start;
    XLA_FFI_Buffer *const *const given = (XLA_FFI_Buffer *const *)frame->args.args;
    crazyflow_pilot_t *pilot;
    const int32_t *steps;
    float *commands;
    int64_t number, drones, world, drone;

    if ((extension != NULL) && (extension->type == XLA_FFI_Extension_Metadata)) { /* XLA asks for our version */
        XLA_FFI_Metadata *const asked = ((const XLA_FFI_Metadata_Extension *)extension)->metadata;

        asked->api_version.major_version = XLA_FFI_API_MAJOR;
        asked->api_version.minor_version = XLA_FFI_API_MINOR;
        return NULL;
    }
    pilot = *(crazyflow_pilot_t **)given[0]->data;
    number = *(const int32_t *)given[1]->data;
    steps = given[2]->data;
    commands = ((XLA_FFI_Buffer *)frame->rets.rets[0])->data;
    drones = given[3]->dims[1];
    for (world = 0; world < given[3]->dims[0]; world++) {
        for (drone = 0; drone < drones; drone++) {
            const int64_t i = (world * drones) + drone;
            const int64_t row = (number * pilot->rows) + ((pilot->rows > 1) ? world : 0);
            const int64_t curve = (row * pilot->curves) + ((pilot->curves > 1) ? drone : 0);
            double state[STATE_COLUMNS];

            if (!measure((const float *)given[3]->data + (3 * i), (const float *)given[4]->data + (4 * i),
                         (const float *)given[5]->data + (3 * i), state)) {
                pilot->refused++;
            }
            command_drone(pilot, i, steps[world] < pilot->ticks, state, &pilot->targets[curve * TARGET_COLUMNS],
                          &commands[4 * i]);
        }
    }
    return NULL;
}
