#include "lighthouse.h"

#include <math.h>

#include "noise.h"

#define STATIONS 2
#define PLANES 2
#define SENSORS 4
#define SWEEP_NOISE_RAD 0.0004
#define LARGEST_REFLECTION_RAD 0.5

/* A sweep that is off by more, as a distance at the drone, is not believed; the limit widens while sweeps are not. */
#define LEAST_WINDOW_M 0.05
#define MOST_WINDOW_M 10.0
#define CLOSES 0.995
#define OPENS 1.05

static const double STATION_M[STATIONS][3] = { { -2.0, -2.0, 2.4 }, { 2.0, 2.0, 2.4 } };
static const double YAW_RAD[STATIONS] = { 0.25 * M_PI, -0.75 * M_PI };
static const double PITCH_RAD = 0.45; /* downwards */
static const double PERIOD_MS[STATIONS] = { 19.98, 19.94 };
static const double PHASE_MS[STATIONS][PLANES] = { { 0.0, 6.7 }, { 3.1, 9.8 } };
static const double TILT_RAD[PLANES] = { -M_PI / 6.0, M_PI / 6.0 };
static const double SENSOR_M[SENSORS][3] = {
    { -0.015, 0.0075, 0.0 }, { -0.015, -0.0075, 0.0 }, { 0.015, 0.0075, 0.0 }, { 0.015, -0.0075, 0.0 }
};

static double window_m;

void lighthouse_start(void) { window_m = LEAST_WINDOW_M; }

static int passes(int station, int plane, uint32_t clock_ms)
{
    const double turns = (clock_ms - PHASE_MS[station][plane]) / PERIOD_MS[station];

    return floor(turns) > floor(turns - (1.0 / PERIOD_MS[station]));
}

static void place(sweep_t *sweep, int station)
{
    const double c = cos(YAW_RAD[station]), s = sin(YAW_RAD[station]), cp = cos(PITCH_RAD), sp = sin(PITCH_RAD);
    const double axes[3][3] = { { c * cp, -s, c * sp }, { s * cp, c, s * sp }, { -sp, 0.0, cp } };

    for (int i = 0; i < 3; i++) {
        sweep->station_m[i] = STATION_M[station][i];
        for (int k = 0; k < 3; k++) {
            sweep->axes[i][k] = axes[i][k];
        }
    }
}

static void measure(estimator_t *filter, const airframe_t *airframe, sweep_t *sweep, double reflections)
{
    double distance_m, off_rad;

    sweep->angle_rad = 0.0;
    sweep->angle_rad = -sweep_error(sweep, airframe->position_m, airframe->attitude, &distance_m) + (SWEEP_NOISE_RAD * normal());
    if (uniform() < reflections) {
        sweep->angle_rad += LARGEST_REFLECTION_RAD * ((2.0 * uniform()) - 1.0);
    }
    off_rad = sweep_error(sweep, filter->position_m, filter->attitude, &distance_m);
    if (fabs(off_rad) * distance_m < window_m) {
        window_m = fmax(CLOSES * window_m, LEAST_WINDOW_M);
        estimator_see_sweep(filter, sweep);
    } else {
        window_m = fmin(OPENS * window_m, MOST_WINDOW_M);
    }
}

void lighthouse_look(estimator_t *filter, const airframe_t *airframe, double reflections, uint32_t clock_ms)
{
    for (int station = 0; station < STATIONS; station++) {
        sweep_t sweep;

        place(&sweep, station);
        for (int plane = 0; plane < PLANES; plane++) {
            sweep.tilt_rad = TILT_RAD[plane];
            for (int sensor = 0; passes(station, plane, clock_ms) && (sensor < SENSORS); sensor++) {
                for (int k = 0; k < 3; k++) {
                    sweep.sensor_m[k] = SENSOR_M[sensor][k];
                }
                measure(filter, airframe, &sweep, reflections);
            }
        }
    }
}
