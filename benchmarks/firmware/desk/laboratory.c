#include "laboratory.h"

#include <math.h>
#include <string.h>

#include "board.h"
#include "commander.h"
#include "drone.h"
#include "estimator.h"
#include "estimator_kalman.h"
#include "stabilizer.h"
#include "tasks.h"
#include "variables.h"

#define START_MS 10000
#define DEGREES 57.295779513082323
#define GRAVITY_M_S2 9.81
#define GYROSCOPE_NOISE_RAD_S 0.003
#define ACCELEROMETER_NOISE_G 0.02
#define CAMERA_DEVIATION_M 0.01f    /* that the firmware assumes */
#define CAMERA_DEVIATION_RAD 0.0045f /* likewise, of an attitude */
#define ATTITUDE_NOISE_RAD 0.002
#define HISTORY_MS 64

static laboratory_flight_t flight;
static drone_parameters_t parameters;
static drone_t drone;
static double history[HISTORY_MS][3]; /* of positions */
static double attitudes[HISTORY_MS][4];
static uint64_t elapsed_ms;
static bool is_camera_on = true;
static uint64_t random_state;

/* Marsaglia's xorshift64; in [0, 1). */
static double uniform(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (double)(random_state >> 11) * 0x1p-53;
}

/* Box and Muller. */
static double normal(void) { return sqrt(-2.0 * log(1.0 - uniform())) * cos(2.0 * M_PI * uniform()); }

static void remember(int k)
{
    memcpy(history[k], drone.position_m, sizeof history[k]);
    memcpy(attitudes[k], drone.attitude, sizeof attitudes[k]);
}

bool laboratory_start(const laboratory_flight_t *wanted)
{
    bool is_good;

    flight = *wanted;
    parameters = (drone_parameters_t){ flight.mass_kg, flight.rotor_lag_s, flight.drag_1_s, { flight.wind_m_s[0], flight.wind_m_s[1] } };
    random_state = 0x9E3779B97F4A7C15ULL * (flight.seed + 1ULL);
    drone_place(&drone, flight.place_m, flight.heading_rad);
    for (int k = 0; k < HISTORY_MS; k++) {
        remember(k);
    }

    tasks_advance_clock(START_MS);
    commanderInit();
    estimatorKalmanTaskInit();
    variables_set("kalman.initialX", flight.place_m[0]);
    variables_set("kalman.initialY", flight.place_m[1]);
    variables_set("kalman.initialYaw", flight.heading_rad);
    stabilizerInit(StateEstimatorTypeKalman);
    is_good = stabilizerTest();
    variables_set("stabilizer.controller", flight.controller);
    tasks_run();
    return is_good;
}

static void measure(void)
{
    double rates_deg_s[3], force_g[3];

    for (int k = 0; k < 3; k++) {
        rates_deg_s[k] = DEGREES * (drone.rates_rad_s[k] + (GYROSCOPE_NOISE_RAD_S * normal()));
        force_g[k] = (drone.specific_force_m_s2[k] / GRAVITY_M_S2) + (ACCELEROMETER_NOISE_G * normal());
    }
    board_measure(rates_deg_s, force_g);
}

/* A camera that sees one marker measures positions; one that sees several measures attitudes, too. */
static void look(void)
{
    const size_t k = (size_t)((elapsed_ms - (uint64_t)flight.camera_delay_ms) % HISTORY_MS);
    float seen_m[3];

    for (int i = 0; i < 3; i++) {
        seen_m[i] = (float)(history[k][i] + (flight.camera_noise_m * normal()));
    }
    if (flight.camera_sees_attitude) {
        const double *const q = attitudes[k];
        poseMeasurement_t pose = { .stdDevPos = CAMERA_DEVIATION_M, .stdDevQuat = CAMERA_DEVIATION_RAD };

        memcpy(pose.pos, seen_m, sizeof seen_m);
        pose.quat.w = (float)q[0];
        pose.quat.x = (float)(q[1] + (0.5 * ATTITUDE_NOISE_RAD * normal()));
        pose.quat.y = (float)(q[2] + (0.5 * ATTITUDE_NOISE_RAD * normal()));
        pose.quat.z = (float)(q[3] + (0.5 * ATTITUDE_NOISE_RAD * normal()));
        estimatorEnqueuePose(&pose);
    } else {
        positionMeasurement_t position = { .stdDev = CAMERA_DEVIATION_M };

        memcpy(position.pos, seen_m, sizeof seen_m);
        estimatorEnqueuePosition(&position);
    }
}

void laboratory_run(int milliseconds)
{
    for (int k = 0; k < milliseconds; k++) {
        double thrusts[4];

        board_thrusts(thrusts);
        drone_advance(&drone, &parameters, thrusts);
        tasks_advance_clock(1);
        elapsed_ms++;
        remember((int)(elapsed_ms % HISTORY_MS));

        measure();
        if (is_camera_on && (flight.camera_period_ms > 0) &&
            (((elapsed_ms + (uint64_t)flight.camera_offset_ms) % (uint64_t)flight.camera_period_ms) == 0)) {
            look();
        }
        if (uniform() >= flight.lost_ticks) {
            board_wake_stabilizer();
            tasks_run();
        }
    }
}

void laboratory_send(int port, int channel, const uint8_t *data, int bytes)
{
    board_receive(port, channel, data, bytes);
    tasks_run();
}

void laboratory_switch_camera(bool is_on) { is_camera_on = is_on; }

void laboratory_state(double state[13])
{
    memcpy(&state[0], drone.position_m, sizeof drone.position_m);
    memcpy(&state[3], drone.velocity_m_s, sizeof drone.velocity_m_s);
    drone_angles(&drone, &state[6]);
    board_thrusts(&state[9]);
}

double laboratory_log(const char *name) { return variables_log(name); }
bool laboratory_set(const char *name, double value) { return variables_set(name, value); }
const char *laboratory_console(void) { return board_console(); }
