/* The firmware's PID controller, as its documentation describes it: angle and rate loops at 500 Hz, position and velocity loops
 * at 100 Hz, with the gains of the Crazyflie 2.1. */

#include <math.h>
#include <string.h>

#include "controller_pid.h"
#include "set_points.h"

#define TICKS_PER_ATTITUDE 2U
#define TICKS_PER_POSITION 10U
#define ATTITUDE_S 0.002f
#define POSITION_S 0.01f
#define RAD_PER_DEG 0.0174532925f

/* Thrust of the velocity loop, in the firmware's units of 16 bits. */
#define THRUST_BASE 36000.0f
#define THRUST_LEAST 20000.0f
#define THRUST_SCALE 1000.0f
#define THRUST_MOST 65535.0f

typedef struct {
    float p, i, d;
    float most_sum; /* of the integral of the error; 0: no bound */
    float most;     /* of the output; 0: no bound */
} gains_t;

typedef struct {
    float sum, last;
    bool has_last;
} memory_t;

enum { ROLL, PITCH, YAW, ROLL_RATE, PITCH_RATE, YAW_RATE, X, Y, Z, VX, VY, VZ, LOOPS };

static const gains_t GAINS[LOOPS] = {
    [ROLL] = { 6.0f, 3.0f, 0.0f, 20.0f, 0.0f },
    [PITCH] = { 6.0f, 3.0f, 0.0f, 20.0f, 0.0f },
    [YAW] = { 6.0f, 1.0f, 0.35f, 360.0f, 0.0f },
    [ROLL_RATE] = { 250.0f, 500.0f, 2.5f, 33.3f, 32767.0f },
    [PITCH_RATE] = { 250.0f, 500.0f, 2.5f, 33.3f, 32767.0f },
    [YAW_RATE] = { 120.0f, 16.7f, 0.0f, 166.7f, 32767.0f },
    [X] = { 2.0f, 0.0f, 0.0f, 0.0f, 1.1f },
    [Y] = { 2.0f, 0.0f, 0.0f, 0.0f, 1.1f },
    [Z] = { 2.0f, 0.5f, 0.0f, 0.0f, 1.1f },
    [VX] = { 25.0f, 1.0f, 0.0f, 0.0f, 22.0f },
    [VY] = { 25.0f, 1.0f, 0.0f, 0.0f, 22.0f },
    [VZ] = { 25.0f, 15.0f, 0.0f, 0.0f, 32.767f },
};

static memory_t memories[LOOPS];
static setpoint_mode_t last_mode;
static attitude_t wanted; /* degrees */
static float thrust;

static float bounded(float value, float most)
{
    return (most > 0.0f) ? fmaxf(fminf(value, most), -most) : value;
}

static float wrapped(float angle_deg) { return remainderf(angle_deg, 360.0f); }

/* A PID loop whose derivative is that of the measured value. */
static float run(int loop, float error, float measured, float period_s)
{
    const gains_t *const gains = &GAINS[loop];
    memory_t *const memory = &memories[loop];
    const float difference = memory->has_last ? (memory->last - measured) : 0.0f;
    const float change = (loop == YAW) ? wrapped(difference) : difference;

    memory->last = measured;
    memory->has_last = true;
    memory->sum = bounded(memory->sum + (error * period_s), gains->most_sum);
    return bounded((gains->p * error) + (gains->d * change / period_s) + (gains->i * memory->sum), gains->most);
}

static void forget(int first, int end)
{
    memset(&memories[first], 0, (size_t)(end - first) * sizeof memories[0]);
}

void controllerPidInit(void)
{
    forget(0, LOOPS);
    memset(&last_mode, 0, sizeof last_mode);
}

bool controllerPidTest(void) { return true; }

static void fly_position(const setpoint_t *setpoint, const state_t *state)
{
    const float cosine = cosf(RAD_PER_DEG * state->attitude.yaw), sine = sinf(RAD_PER_DEG * state->attitude.yaw);
    const float off_x = setpoint->position.x - state->position.x, off_y = setpoint->position.y - state->position.y;
    const float vx = (cosine * state->velocity.x) + (sine * state->velocity.y);
    const float vy = (cosine * state->velocity.y) - (sine * state->velocity.x);
    float to_x = setpoint->velocity.x, to_y = setpoint->velocity.y, to_z = setpoint->velocity.z;

    if (!setpoint->velocity_body) {
        to_x = (cosine * setpoint->velocity.x) + (sine * setpoint->velocity.y);
        to_y = (cosine * setpoint->velocity.y) - (sine * setpoint->velocity.x);
    }
    if (setpoint->mode.x == modeAbs) {
        to_x = run(X, (cosine * off_x) + (sine * off_y), 0.0f, POSITION_S);
    }
    if (setpoint->mode.y == modeAbs) {
        to_y = run(Y, (cosine * off_y) - (sine * off_x), 0.0f, POSITION_S);
    }
    if (setpoint->mode.z == modeAbs) {
        to_z = run(Z, setpoint->position.z - state->position.z, state->position.z, POSITION_S);
    }
    wanted.pitch = bounded(-run(VX, to_x - vx, vx, POSITION_S), 20.0f);
    wanted.roll = bounded(-run(VY, to_y - vy, vy, POSITION_S), 20.0f);
    thrust = THRUST_BASE + (THRUST_SCALE * run(VZ, to_z - state->velocity.z, state->velocity.z, POSITION_S));
    thrust = fminf(fmaxf(thrust, THRUST_LEAST), THRUST_MOST);
}

static void fly_attitude(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state)
{
    const float rates[3] = { sensors->gyro.x, -sensors->gyro.y, sensors->gyro.z };
    float to_rates[3];

    to_rates[0] = run(ROLL, wanted.roll - state->attitude.roll, state->attitude.roll, ATTITUDE_S);
    to_rates[1] = run(PITCH, wanted.pitch - state->attitude.pitch, state->attitude.pitch, ATTITUDE_S);
    to_rates[2] = run(YAW, wrapped(wanted.yaw - state->attitude.yaw), state->attitude.yaw, ATTITUDE_S);
    if (setpoint->mode.roll == modeVelocity) {
        to_rates[0] = setpoint->attitudeRate.roll;
    }
    if (setpoint->mode.pitch == modeVelocity) {
        to_rates[1] = setpoint->attitudeRate.pitch;
    }
    control->roll = run(ROLL_RATE, to_rates[0] - rates[0], rates[0], ATTITUDE_S);
    control->pitch = run(PITCH_RATE, to_rates[1] - rates[1], rates[1], ATTITUDE_S);
    control->yaw = -run(YAW_RATE, to_rates[2] - rates[2], rates[2], ATTITUDE_S);
}

void controllerPid(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                   const stabilizerStep_t step)
{
    control->controlMode = controlModeLegacy;
    if (memcmp(&setpoint->mode, &last_mode, sizeof last_mode) != 0) {
        forget(0, LOOPS);
        last_mode = setpoint->mode;
    }
    if ((step % TICKS_PER_ATTITUDE) == 0U) {
        if (setpoint->mode.yaw == modeVelocity) {
            wanted.yaw = wrapped(wanted.yaw + (setpoint->attitudeRate.yaw * ATTITUDE_S));
        } else if (setpoint->mode.yaw == modeAbs) {
            wanted.yaw = wrapped(setpoint->attitude.yaw);
        }
    }
    if ((step % TICKS_PER_POSITION) == 0U) {
        fly_position(setpoint, state);
    }
    if ((step % TICKS_PER_ATTITUDE) == 0U) {
        if (setpoint->mode.z == modeDisable) {
            thrust = setpoint->thrust;
        }
        if ((setpoint->mode.x == modeDisable) || (setpoint->mode.y == modeDisable)) {
            wanted.roll = setpoint->attitude.roll;
            wanted.pitch = setpoint->attitude.pitch;
        }
        fly_attitude(control, setpoint, sensors, state);
    }
    control->thrust = thrust;
    if (thrust == 0.0f) {
        control->roll = control->pitch = control->yaw = 0.0f;
        forget(0, LOOPS);
        wanted.yaw = state->attitude.yaw;
    }
}

/* Attitude goes before thrust: where a motor is asked for more than it has, all get less by the excess. */
void mix(const control_t *control, double motors[4])
{
    const float roll = 0.5f * control->roll, pitch = 0.5f * control->pitch, yaw = control->yaw;
    const float asked[4] = {
        control->thrust - roll + pitch + yaw,
        control->thrust - roll - pitch - yaw,
        control->thrust + roll - pitch + yaw,
        control->thrust + roll + pitch - yaw,
    };
    const float excess = fmaxf(fmaxf(fmaxf(asked[0], asked[1]), fmaxf(asked[2], asked[3])) - THRUST_MOST, 0.0f);

    for (int k = 0; k < 4; k++) {
        motors[k] = fmaxf(asked[k] - excess, 0.0f) / THRUST_MOST;
    }
}
