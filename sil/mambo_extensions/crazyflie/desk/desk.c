#include "desk.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "airframe.h"
#include "controller.h"
#include "controller_pid.h"
#include "debug.h"
#include "estimator.h"
#include "lighthouse.h"
#include "log.h"
#include "noise.h"
#include "param.h"
#include "power_distribution.h"
#include "set_points.h"
#include "supervisor.h"
#include "task.h"
#include "worker.h"

#define START_MS 10000U
#define FLOW_MS 10U
#define RANGE_MS 25U
#define FARTHEST_RANGE_M 4.0
#define SUPERVISOR_MS 40U
#define LEVEL_OUT_MS 500U
#define SHUT_DOWN_MS 2000U
#define LANDED_MS 2000U        /* without thrust */
#define TILTED_MS 1000U        /* a drone tilted beyond 60 degrees for so long has tumbled */
#define GYROSCOPE_NOISE_RAD_S 0.003
#define ACCELEROMETER_NOISE_G 0.02
#define RANGE_NOISE_M 0.0025
#define HISTORY_MS 256
#define CONSOLE_BYTES 4000
#define LONGEST_NAME 40

enum { READY, FLYING, LEVELLING_OUT, STOPPED }; /* what the supervisor allows */
enum { PID = 1, OUT_OF_TREE = 6 };              /* values of stabilizer.controller */

static desk_flight_t flight;
static airframe_t airframe;
static estimator_t filter;
static double motors[MOTORS];
static double history_m[HISTORY_MS][3]; /* of positions */

static uint32_t now_ms;
static uint32_t ticks;
static uint8_t controller_number;
static float initial_yaw;
static state_t estimate;
static setpoint_t setpoint;
static control_t control;
static sensorData_t sensors;

static int supervised;
static uint32_t last_thrust_ms, upright_ms;

static int measures;
static double jump_m[3];
static int jumping_frames;
static double flow_counts[2];

static char console[CONSOLE_BYTES];

/* What the app calls. */

uint32_t xTaskGetTickCount(void) { return now_ms; }
bool supervisorIsFlying(void) { return (supervised == FLYING) || (supervised == LEVELLING_OUT); }
float powerDistributionGetMaxThrust(void) { return 0.48f; }
enum trajectory_state crtpCommanderHighLevelGetPlannerState(void) { return set_points_state(); }

int workerSchedule(void (*function)(void *), void *argument)
{
    function(argument);
    return 0;
}

int consolePrintf(const char *format, ...)
{
    const size_t used = strlen(console);
    va_list arguments;
    int length;

    va_start(arguments, format);
    length = vsnprintf(&console[used], sizeof console - used, format, arguments);
    va_end(arguments);
    return length;
}

/* Variables by name: those of what surrounds the app, and the app's own. */

static float variances[6];
static float target_m[3];

static const struct variable LOGGED[] = {
    { LOG_FLOAT, "kalman.varX", &variances[0] },
    { LOG_FLOAT, "kalman.varPX", &variances[1] },
    { LOG_FLOAT, "kalman.varZ", &variances[2] },
    { LOG_FLOAT, "kalman.varD0", &variances[3] },
    { LOG_FLOAT, "kalman.varD1", &variances[4] },
    { LOG_FLOAT, "kalman.varD2", &variances[5] },
    { LOG_FLOAT, "stateEstimate.x", &estimate.position.x },
    { LOG_FLOAT, "stateEstimate.y", &estimate.position.y },
    { LOG_FLOAT, "stateEstimate.z", &estimate.position.z },
    { LOG_FLOAT, "stateEstimate.vx", &estimate.velocity.x },
    { LOG_FLOAT, "stateEstimate.vy", &estimate.velocity.y },
    { LOG_FLOAT, "stateEstimate.vz", &estimate.velocity.z },
    { LOG_FLOAT, "stateEstimate.roll", &estimate.attitude.roll },
    { LOG_FLOAT, "stateEstimate.pitch", &estimate.attitude.pitch },
    { LOG_FLOAT, "stateEstimate.yaw", &estimate.attitude.yaw },
    { LOG_FLOAT, "ctrltarget.x", &target_m[0] },
    { LOG_FLOAT, "ctrltarget.y", &target_m[1] },
    { LOG_FLOAT, "ctrltarget.z", &target_m[2] },
    { 0, 0, 0 },
};
static const struct variable PARAMETERS[] = {
    { "uint8_t", "stabilizer.controller", &controller_number },
    { "float", "kalman.initialYaw", &initial_yaw },
    { 0, 0, 0 },
};

/* Find a variable among those of the desk, or in the app's table, whose first and last rows have the name of its group. */
static const struct variable *find(const struct variable *desk, const struct variable *app, const char *name)
{
    const char *const dot = strchr(name, '.');
    const struct variable *found;

    for (found = desk; found->type != 0; found++) {
        if (strcmp(found->name, name) == 0) {
            return found;
        }
    }
    if ((dot != 0) && (strlen(app->name) == (size_t)(dot - name)) && (strncmp(app->name, name, (size_t)(dot - name)) == 0)) {
        for (found = &app[1]; found->type != 0; found++) {
            if (strcmp(found->name, &dot[1]) == 0) {
                return found;
            }
        }
    }
    return 0;
}

static double value_of(const struct variable *variable)
{
    if (strcmp(variable->type, "float") == 0) {
        return *(const float *)variable->address;
    }
    if (strcmp(variable->type, "uint8_t") == 0) {
        return *(const uint8_t *)variable->address;
    }
    if (strcmp(variable->type, "uint16_t") == 0) {
        return *(const uint16_t *)variable->address;
    }
    if (strcmp(variable->type, "int32_t") == 0) {
        return *(const int32_t *)variable->address;
    }
    return *(const uint32_t *)variable->address;
}

double desk_log(const char *name)
{
    const struct variable *found = find(LOGGED, host_logged, name);

    return (found == 0) ? NAN : value_of(found);
}

int desk_set(const char *name, double value)
{
    const struct variable *found = find(PARAMETERS, host_parameters, name);

    if (found == 0) {
        return 0;
    }
    if (strcmp(found->type, "float") == 0) {
        *(float *)found->address = (float)value;
    } else {
        *(uint8_t *)found->address = (uint8_t)value;
    }
    return 1;
}

logVarId_t logGetVarId(const char *group, const char *name)
{
    char whole[LONGEST_NAME];
    const struct variable *found;

    (void)snprintf(whole, sizeof whole, "%s.%s", group, name);
    found = find(LOGGED, host_logged, whole);
    return ((found >= LOGGED) && (found < &LOGGED[sizeof LOGGED / sizeof LOGGED[0]])) ? (logVarId_t)(found - LOGGED) : 0xffffU;
}

void *logGetAddress(logVarId_t id) { return LOGGED[id].address; }

const char *desk_group(void) { return host_logged[0].name; }
const char *desk_console(void) { return console; }

/* What measures. */

static void measure_inertia(double rates_rad_s[3], double force_m_s2[3])
{
    for (int k = 0; k < 3; k++) {
        const double bias_rad_s = flight.gyroscope_bias_rad_s[k], bias_g = flight.accelerometer_bias_g[k];

        rates_rad_s[k] = airframe.rates_rad_s[k] + bias_rad_s + (GYROSCOPE_NOISE_RAD_S * normal());
        force_m_s2[k] = airframe.specific_force_m_s2[k] + (GRAVITY_M_S2 * (bias_g + (ACCELEROMETER_NOISE_G * normal())));
    }
    sensors.gyro = (vector_t){ now_ms, (float)(DEGREES * rates_rad_s[0]), (float)(DEGREES * rates_rad_s[1]), (float)(DEGREES * rates_rad_s[2]) };
    sensors.acc = (vector_t){ now_ms, (float)(force_m_s2[0] / GRAVITY_M_S2), (float)(force_m_s2[1] / GRAVITY_M_S2),
                              (float)(force_m_s2[2] / GRAVITY_M_S2) };
}

static void look_by_camera(void)
{
    const double *const seen_m = history_m[(now_ms - (uint32_t)flight.camera_delay_ms) % HISTORY_MS];
    double measured_m[3];

    for (int k = 0; k < 3; k++) {
        measured_m[k] = seen_m[k] + (flight.camera_noise_m * normal()) + ((jumping_frames > 0) ? jump_m[k] : 0.0);
    }
    if ((flight.camera_outliers > 0.0) && (uniform() < flight.camera_outliers)) {
        const double away[3] = { normal(), normal(), normal() };
        const double size = sqrt((away[0] * away[0]) + (away[1] * away[1]) + (away[2] * away[2]));

        for (int k = 0; k < 3; k++) {
            measured_m[k] += flight.camera_outlier_m * away[k] / size;
        }
    }
    jumping_frames -= (jumping_frames > 0) ? 1 : 0;
    estimator_see_position(&filter, measured_m);
}

/* The flow chip adds up what moves below it; once a frame the firmware reads whole counts. */
static void look_down(uint32_t clock_ms)
{
    const double height_m = fmax(airframe.position_m[2] - ground_below(&flight, airframe.position_m), 0.02);
    double r[3][3];

    rotation_of(airframe.attitude, r);
    for (int k = 0; k < 2; k++) {
        const double along_m_s = (r[0][k] * airframe.velocity_m_s[0]) + (r[1][k] * airframe.velocity_m_s[1]) + (r[2][k] * airframe.velocity_m_s[2]);
        const double turned_rad_s = (k == 0) ? airframe.rates_rad_s[1] : -airframe.rates_rad_s[0];

        flow_counts[k] += FLOW_COUNTS_PER_PIXEL * 0.001 * (FLOW_PIXELS / FLOW_ANGLE_RAD) * ((along_m_s * r[2][2] / height_m) - turned_rad_s);
    }
    if (measures && ((clock_ms % FLOW_MS) == 0U)) {
        const double counts[2] = { round(flow_counts[0] + (flight.flow_noise_counts * normal())),
                                   round(flow_counts[1] + (flight.flow_noise_counts * normal())) };

        estimator_see_flow(&filter, counts, 0.001 * FLOW_MS);
    }
    if ((clock_ms % FLOW_MS) == 0U) {
        flow_counts[0] = flow_counts[1] = 0.0;
    }
    if ((clock_ms % RANGE_MS) == 0U) {
        const double range_m = height_m / fmax(r[2][2], 0.5);

        if (range_m < FARTHEST_RANGE_M) {
            estimator_see_range(&filter, range_m + (RANGE_NOISE_M * normal()));
        }
    }
}

static void measure_position(void)
{
    const uint32_t clock_ms = now_ms + (uint32_t)flight.camera_offset_ms;

    if (flight.sensors == DESK_FLOW_DECK) {
        look_down(clock_ms);
    } else if (flight.sensors == DESK_LIGHTHOUSE) {
        if (measures) {
            lighthouse_look(&filter, &airframe, flight.sweep_reflections, clock_ms);
        }
    } else if (measures && ((clock_ms % (uint32_t)flight.camera_period_ms) == 0U)) {
        look_by_camera();
    }
}

static void remember(void)
{
    memcpy(history_m[now_ms % HISTORY_MS], airframe.position_m, sizeof history_m[0]);
}

/* The estimate as the firmware's other parts see it. */
static void externalize(void)
{
    const double *const v = filter.velocity_m_s;
    double r[3][3], angles_rad[3], along_m_s[3];

    rotation_of(filter.attitude, r);
    angles_of(filter.attitude, angles_rad);
    for (int k = 0; k < 3; k++) {
        along_m_s[k] = (r[k][0] * v[0]) + (r[k][1] * v[1]) + (r[k][2] * v[2]);
    }
    estimate.position = (vector_t){ now_ms, (float)filter.position_m[0], (float)filter.position_m[1], (float)filter.position_m[2] };
    estimate.velocity = (vector_t){ now_ms, (float)along_m_s[0], (float)along_m_s[1], (float)along_m_s[2] };
    estimate.attitude = (attitude_t){ now_ms, (float)(DEGREES * angles_rad[0]), (float)(DEGREES * angles_rad[1]), (float)(DEGREES * angles_rad[2]) };
    estimate.attitudeQuaternion =
        (quaternion_t){ (float)filter.attitude[1], (float)filter.attitude[2], (float)filter.attitude[3], (float)filter.attitude[0] };
    variances[0] = (float)filter.variance[0][0];
    variances[1] = (float)filter.variance[3][3];
    variances[2] = (float)filter.variance[2][2];
    for (int k = 0; k < 3; k++) {
        variances[3 + k] = (float)filter.variance[6 + k][6 + k];
    }
}

/* The supervisor: what the age of the set-point, the thrust and the attitude allow. */

static void supervise(void)
{
    const uint32_t age_ms = now_ms - setpoint.timestamp;
    const bool has_thrust = (motors[0] > 0.0) || (motors[1] > 0.0) || (motors[2] > 0.0) || (motors[3] > 0.0);

    if (has_thrust) {
        last_thrust_ms = now_ms;
    }
    if (sensors.acc.z > 0.5f) {
        upright_ms = now_ms;
    }
    if (supervised == READY) {
        supervised = has_thrust ? FLYING : READY;
        return;
    }
    if (supervised != STOPPED) {
        const bool has_tumbled = ((now_ms - upright_ms) > TILTED_MS) && (fabsf(sensors.acc.z) > 0.1f);

        if ((age_ms > SHUT_DOWN_MS) || has_tumbled) {
            supervised = STOPPED;
        } else if (age_ms > LEVEL_OUT_MS) {
            supervised = LEVELLING_OUT;
        } else {
            supervised = ((now_ms - last_thrust_ms) > LANDED_MS) ? READY : FLYING;
        }
    }
}

static void override_set_point(void)
{
    if (supervised == STOPPED) {
        memset(&setpoint, 0, sizeof setpoint);
    } else if (supervised == LEVELLING_OUT) {
        setpoint.mode.x = setpoint.mode.y = modeDisable;
        setpoint.mode.roll = setpoint.mode.pitch = modeAbs;
        setpoint.mode.yaw = modeVelocity;
        setpoint.attitude.roll = setpoint.attitude.pitch = 0.0f;
        setpoint.attitudeRate.yaw = 0.0f;
    }
}

/* A millisecond of the stabilizer's task. */
static void stabilize(void)
{
    set_points_now(&setpoint, &estimate, now_ms);
    if ((ticks % SUPERVISOR_MS) == 0U) {
        supervise();
    }
    override_set_point();
    target_m[0] = setpoint.position.x;
    target_m[1] = setpoint.position.y;
    target_m[2] = setpoint.position.z;
    if (controller_number == PID) {
        controllerPid(&control, &setpoint, &sensors, &estimate, ticks);
    } else {
        controllerOutOfTree(&control, &setpoint, &sensors, &estimate, ticks);
    }
    mix(&control, motors);
    if (supervised == STOPPED) {
        memset(motors, 0, sizeof motors);
    }
    ticks++;
}

int desk_start(const desk_flight_t *wanted)
{
    flight = *wanted;
    noise_start(flight.seed);
    lighthouse_start();
    now_ms = START_MS;
    ticks = 1U;
    controller_number = OUT_OF_TREE;
    initial_yaw = (float)flight.initial_yaw_rad;
    supervised = READY;
    upright_ms = now_ms;
    measures = 1;
    airframe_place(&airframe, &flight);
    for (now_ms = START_MS - HISTORY_MS; now_ms < START_MS; now_ms++) {
        remember();
    }
    estimator_start(&filter, initial_yaw);
    externalize();
    set_points_start();
    if (!controllerOutOfTreeTest()) {
        return 0;
    }
    controllerOutOfTreeInit();
    return 1;
}

void desk_run(int milliseconds)
{
    for (int k = 0; k < milliseconds; k++) {
        double rates_rad_s[3], force_m_s2[3];

        airframe_advance(&airframe, &flight, motors);
        now_ms++;
        remember();
        measure_inertia(rates_rad_s, force_m_s2);
        if (!(uniform() < flight.lost_ticks)) {
            stabilize();
            estimator_advance(&filter, rates_rad_s, force_m_s2, supervisorIsFlying());
        }
        measure_position();
        externalize();
    }
}

/* What the pilot does. */

static vector_t vector(const double values[3]) { return (vector_t){ now_ms, (float)values[0], (float)values[1], (float)values[2] }; }

void desk_full_state(const double position_m[3], const double velocity_m_s[3], const double acceleration_m_s2[3], double yaw_rad)
{
    setpoint_t sent = { .timestamp = now_ms };

    sent.position = vector(position_m);
    sent.velocity = vector(velocity_m_s);
    sent.acceleration = vector(acceleration_m_s2);
    sent.attitudeQuaternion = (quaternion_t){ 0.0f, 0.0f, (float)sin(0.5 * yaw_rad), (float)cos(0.5 * yaw_rad) };
    sent.mode.x = sent.mode.y = sent.mode.z = sent.mode.quat = modeAbs;
    set_points_send(&sent, now_ms);
}

void desk_stop(void)
{
    const setpoint_t nothing = { .timestamp = now_ms };

    set_points_send(&nothing, now_ms);
}

void desk_yield(void) { set_points_yield(); }
void desk_take_off(double z_m, double yaw_rad, double duration_s) { set_points_lift(z_m, yaw_rad, duration_s, false, now_ms); }
void desk_land(double z_m, double yaw_rad, double duration_s) { set_points_lift(z_m, yaw_rad, duration_s, true, now_ms); }

void desk_go_to(const double position_m[3], double yaw_rad, double duration_s)
{
    set_points_plan(position_m, yaw_rad, duration_s, false, now_ms);
}

void desk_write_pieces(int first, const double *pieces, int count) { set_points_write(first, pieces, count); }
void desk_start_trajectory(int count) { set_points_follow(count, now_ms); }

void desk_measure(int is_on) { measures = is_on; }

void desk_jump(const double wanted_m[3], int frames)
{
    memcpy(jump_m, wanted_m, sizeof jump_m);
    jumping_frames = frames;
}

void desk_switch(int to) { flight.sensors = to; }

void desk_kick(const double velocity_m_s[3])
{
    for (int k = 0; k < 3; k++) {
        airframe.velocity_m_s[k] += velocity_m_s[k];
    }
}

void desk_hit(const double rates_rad_s[3])
{
    for (int k = 0; k < 3; k++) {
        airframe.rates_rad_s[k] += rates_rad_s[k];
    }
}

void desk_push(const double force_n[3], int milliseconds)
{
    memcpy(airframe.push_n, force_n, sizeof airframe.push_n);
    airframe.push_s = 0.001 * (double)milliseconds;
}

void desk_state(desk_state_t *state)
{
    memcpy(state->position_m, airframe.position_m, sizeof state->position_m);
    memcpy(state->velocity_m_s, airframe.velocity_m_s, sizeof state->velocity_m_s);
    angles_of(airframe.attitude, state->angles_rad);
    memcpy(state->motors, motors, sizeof state->motors);
    state->touch_m_s = airframe.touch_m_s;
}
