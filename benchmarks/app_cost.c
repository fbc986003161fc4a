/* What surrounds the Crazyflie's app when its instructions are counted: a drone on a circle of 1 m at 1.5 rad/s, a set-point and a
 * measurement every 10 ms, each at its own time. The PID controller does nothing. Functions of the C library are the shortest that do
 * their work. */
#include "controller.h"
#include "controller_pid.h"
#include "crtp_commander_high_level.h"
#include "debug.h"
#include "log.h"
#include "power_distribution.h"
#include "supervisor.h"
#include "task.h"
#include "worker.h"

#define PERIOD_MS 10U
#define MEASURED_MS 3U         /* from a set-point to the measurement */
#define COSINE 0.99988750211f  /* of the angle that the circle turns in a period */
#define SINE 0.01499943751f
#define SPEED_1_S 1.5f
#define ACCELERATION_1_S2 2.25f
#define JERK_1_S3 3.375f

static setpoint_t setpoint;
static state_t state;
static control_t control;
static sensorData_t sensors;
static float variances[6] = { 1e-5f, 1e-4f, 1e-5f, 1e-4f, 1e-4f, 1e-4f };
static float x = 1.0f, y;
static uint32_t now_ms = 10000U, ticks = 1U;

void controllerPidInit(void) {}
bool controllerPidTest(void) { return true; }

void controllerPid(control_t *out, const setpoint_t *flown, const sensorData_t *measured, const state_t *estimate, const stabilizerStep_t step)
{
    (void)measured;
    (void)estimate;
    (void)step;
    out->thrust = flown->thrust;
}

uint32_t xTaskGetTickCount(void) { return now_ms; }
bool supervisorIsFlying(void) { return true; }
float powerDistributionGetMaxThrust(void) { return 0.48f; }
enum trajectory_state crtpCommanderHighLevelGetPlannerState(void) { return TRAJECTORY_STATE_IDLE; }

int workerSchedule(void (*function)(void *), void *argument)
{
    (void)function;
    (void)argument;
    return 0;
}

int consolePrintf(const char *format, ...)
{
    (void)format;
    return 0;
}

static const char *const NAMES[6] = { "varX", "varPX", "varZ", "varD0", "varD1", "varD2" };
logVarId_t logGetVarId(const char *group, const char *name)
{
    (void)group;
    for (unsigned short k = 0; k < 6; k++) {
        const char *known = NAMES[k], *asked = name;

        while ((*known != '\0') && (*known == *asked)) {
            known++;
            asked++;
        }
        if (*known == *asked) {
            return k;
        }
    }
    return 0xffffU;
}

void *logGetAddress(logVarId_t id) { return &variances[id]; }

/* The C library. */

float fmaxf(float a, float b) { return ((a >= b) || (b != b)) ? a : b; }
float fminf(float a, float b) { return ((a <= b) || (b != b)) ? a : b; }

float cosf(float angle)
{
    const float square = angle * angle;

    return 1.0f - (square * (0.5f - (square * (0.0416666f - (square * 0.0013888f)))));
}

float atan2f(float to_y, float to_x)
{
    const float slope = to_y / to_x, square = slope * slope;

    return slope * (1.0f - (square * (0.3333f - (square * (0.2f - (square * 0.14f))))));
}

void *memcpy(void *to, const void *from, unsigned int size)
{
    unsigned int *into = to;
    const unsigned int *out = from;

    for (; size >= 4U; size -= 4U) {
        *into++ = *out++;
    }
    return to;
}

void *memset(void *to, int value, unsigned int size)
{
    unsigned char *into = to;

    while (size-- > 0U) {
        *into++ = (unsigned char)value;
    }
    return to;
}

int memcmp(const void *a, const void *b, unsigned int size)
{
    const unsigned char *one = a, *other = b;

    while ((size > 0U) && (*one == *other)) {
        one++;
        other++;
        size--;
    }
    return (size > 0U) ? (*one - *other) : 0;
}

/* Move the drone and its target on, as a radio, a camera and the filter do. */
void cost_move(void)
{
    now_ms++;
    if ((now_ms % PERIOD_MS) == 0U) {
        const float before = x;

        x = (COSINE * x) - (SINE * y);
        y = (COSINE * y) + (SINE * before);
        setpoint.timestamp = now_ms;
        setpoint.position = (vector_t){ now_ms, x, y, 1.0f };
        setpoint.velocity = (vector_t){ now_ms, -SPEED_1_S * y, SPEED_1_S * x, 0.0f };
        setpoint.acceleration = (vector_t){ now_ms, -ACCELERATION_1_S2 * x, -ACCELERATION_1_S2 * y, 0.0f };
        setpoint.jerk = (vector_t){ now_ms, JERK_1_S3 * y, -JERK_1_S3 * x, 0.0f };
        setpoint.attitudeQuaternion = (quaternion_t){ 0.0f, 0.0f, 0.05f, 0.99875f };
        setpoint.mode.x = setpoint.mode.y = setpoint.mode.z = setpoint.mode.quat = modeAbs;
    }
    for (int k = 0; k < 6; k++) {
        variances[k] += (k < 3) ? 1e-9f : 1e-8f;
    }
    if ((now_ms % PERIOD_MS) == MEASURED_MS) {
        state.position = setpoint.position;
        state.velocity = setpoint.velocity;
        state.attitude = (attitude_t){ now_ms, -13.0f * y, 13.0f * x, 3.0f };
        state.attitudeQuaternion = (quaternion_t){ 0.05f, 0.05f, 0.02f, 0.997f };
        for (int k = 0; k < 6; k++) {
            variances[k] *= 0.9f;
        }
    }
}

void cost_start(void)
{
    state.position.z = 1.0f;
    control.thrust = 0.29f;
    controllerOutOfTreeInit();
}

void cost_call(void) { controllerOutOfTree(&control, &setpoint, &sensors, &state, ticks++); }
