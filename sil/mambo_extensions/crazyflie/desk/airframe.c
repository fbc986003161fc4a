#include "airframe.h"

#include <math.h>
#include <string.h>

#define LEAST_CELL 0.75 /* of the thrust, with a cell that is empty */
#define STEPS_PER_MS 10
#define STEP_S 1e-4
#define LARGEST_FORCE_N 0.12       /* of a rotor */
#define ARM_M 0.0325269            /* of a rotor along x and y: 46 mm from the centre */
#define TORQUE_PER_FORCE_M 0.00699 /* about z */

static const double INERTIA_KG_M2[3] = { 1.43e-5, 1.43e-5, 2.89e-5 };

/* The rotors M1 to M4: front right, back right, back left, front left; the sign of their torque about z. */
static const double ROTOR_X_M[MOTORS] = { ARM_M, -ARM_M, -ARM_M, ARM_M };
static const double ROTOR_Y_M[MOTORS] = { -ARM_M, -ARM_M, ARM_M, ARM_M };
static const double ROTOR_TORQUE_M[MOTORS] = { -TORQUE_PER_FORCE_M, TORQUE_PER_FORCE_M, -TORQUE_PER_FORCE_M, TORQUE_PER_FORCE_M };

void rotation_of(const double attitude[4], double rotation[3][3])
{
    const double w = attitude[0], x = attitude[1], y = attitude[2], z = attitude[3];

    rotation[0][0] = 1.0 - (2.0 * ((y * y) + (z * z)));
    rotation[0][1] = 2.0 * ((x * y) - (w * z));
    rotation[0][2] = 2.0 * ((x * z) + (w * y));
    rotation[1][0] = 2.0 * ((x * y) + (w * z));
    rotation[1][1] = 1.0 - (2.0 * ((x * x) + (z * z)));
    rotation[1][2] = 2.0 * ((y * z) - (w * x));
    rotation[2][0] = 2.0 * ((x * z) - (w * y));
    rotation[2][1] = 2.0 * ((y * z) + (w * x));
    rotation[2][2] = 1.0 - (2.0 * ((x * x) + (y * y)));
}

void angles_of(const double attitude[4], double angles_rad[3])
{
    double r[3][3];

    rotation_of(attitude, r);
    angles_rad[0] = atan2(r[2][1], r[2][2]);
    angles_rad[1] = asin(fmax(-1.0, fmin(1.0, r[2][0])));
    angles_rad[2] = atan2(r[1][0], r[0][0]);
}

void turn(double attitude[4], const double angle_rad[3])
{
    const double w = attitude[0], x = attitude[1], y = attitude[2], z = attitude[3];
    const double angle = sqrt((angle_rad[0] * angle_rad[0]) + (angle_rad[1] * angle_rad[1]) + (angle_rad[2] * angle_rad[2]));
    const double share = (angle > 1e-12) ? (sin(0.5 * angle) / angle) : 0.5;
    const double c = cos(0.5 * angle), i = share * angle_rad[0], j = share * angle_rad[1], k = share * angle_rad[2];
    double norm = 0.0;

    attitude[0] = (c * w) - (i * x) - (j * y) - (k * z);
    attitude[1] = (c * x) + (i * w) + (k * y) - (j * z);
    attitude[2] = (c * y) + (j * w) + (i * z) - (k * x);
    attitude[3] = (c * z) + (k * w) + (j * x) - (i * y);
    for (int n = 0; n < 4; n++) {
        norm += attitude[n] * attitude[n];
    }
    norm = sqrt(norm);
    for (int n = 0; n < 4; n++) {
        attitude[n] /= norm;
    }
}

static void level(airframe_t *airframe, double heading_rad)
{
    airframe->attitude[0] = cos(0.5 * heading_rad);
    airframe->attitude[1] = airframe->attitude[2] = 0.0;
    airframe->attitude[3] = sin(0.5 * heading_rad);
}

double ground_below(const desk_flight_t *flight, const double position_m[3])
{
    const double away_m = hypot(position_m[0], position_m[1]);

    return ((away_m < flight->table_radius_m) && (position_m[2] > (flight->table_m - 0.05))) ? flight->table_m : 0.0;
}

void airframe_place(airframe_t *airframe, const desk_flight_t *flight)
{
    memset(airframe, 0, sizeof *airframe);
    airframe->position_m[2] = flight->table_m;
    airframe->specific_force_m_s2[2] = GRAVITY_M_S2;
    level(airframe, flight->heading_rad);
}

/* The floor holds a drone that would sink: it stops it, and turns it upright. */
static void rest(airframe_t *airframe, double ground_m)
{
    double angles_rad[3];

    angles_of(airframe->attitude, angles_rad);
    level(airframe, angles_rad[2]);
    airframe->touch_m_s = fmax(airframe->touch_m_s, -airframe->velocity_m_s[2]);
    airframe->position_m[2] = ground_m;
    for (int k = 0; k < 3; k++) {
        airframe->velocity_m_s[k] = airframe->rates_rad_s[k] = 0.0;
        airframe->specific_force_m_s2[k] = (k == 2) ? GRAVITY_M_S2 : 0.0;
    }
}

/* Euler's equation of a rigid body. */
static void spin(airframe_t *airframe, const double torque_n_m[3])
{
    double *const w = airframe->rates_rad_s;
    const double momentum[3] = { INERTIA_KG_M2[0] * w[0], INERTIA_KG_M2[1] * w[1], INERTIA_KG_M2[2] * w[2] };
    const double gyroscopic[3] = {
        (w[1] * momentum[2]) - (w[2] * momentum[1]),
        (w[2] * momentum[0]) - (w[0] * momentum[2]),
        (w[0] * momentum[1]) - (w[1] * momentum[0]),
    };
    double angle_rad[3];

    for (int k = 0; k < 3; k++) {
        w[k] += STEP_S * (torque_n_m[k] - gyroscopic[k]) / INERTIA_KG_M2[k];
        angle_rad[k] = STEP_S * w[k];
    }
    turn(airframe->attitude, angle_rad);
}

static void step(airframe_t *airframe, const desk_flight_t *flight, const double motors[MOTORS])
{
    double torque_n_m[3] = { 0.0, 0.0, 0.0 }, thrust_n = 0.0, r[3][3], force_m_s2[3];
    const double ground_m = ground_below(flight, airframe->position_m);
    const double cell = fmax(1.0 - (flight->sag_1_s * airframe->time_s), LEAST_CELL);

    airframe->time_s += STEP_S;
    airframe->push_s -= STEP_S;
    for (int k = 0; k < MOTORS; k++) {
        double force_n;

        airframe->speeds[k] += (STEP_S / flight->rotor_lag_s) * (sqrt(motors[k]) - airframe->speeds[k]);
        force_n = cell * flight->thrust_gain * flight->motor_gains[k] * LARGEST_FORCE_N * airframe->speeds[k] * airframe->speeds[k];
        thrust_n += force_n;
        torque_n_m[0] += (ROTOR_Y_M[k] - flight->centre_m[1]) * force_n;
        torque_n_m[1] -= (ROTOR_X_M[k] - flight->centre_m[0]) * force_n;
        torque_n_m[2] += ROTOR_TORQUE_M[k] * force_n;
    }

    rotation_of(airframe->attitude, r);
    for (int k = 0; k < 3; k++) {
        const double airspeed_m_s = airframe->velocity_m_s[k] - ((k < 2) ? flight->wind_m_s[k] : 0.0);

        const double push_n = (airframe->push_s > 0.0) ? airframe->push_n[k] : 0.0;

        force_m_s2[k] = (((r[k][2] * thrust_n) + push_n) / flight->mass_kg) - (flight->drag_1_s * airspeed_m_s);
    }
    if ((airframe->position_m[2] <= ground_m) && ((force_m_s2[2] < GRAVITY_M_S2) || (airframe->velocity_m_s[2] < 0.0))) {
        rest(airframe, ground_m);
        return;
    }
    for (int k = 0; k < 3; k++) {
        airframe->specific_force_m_s2[k] = (r[0][k] * force_m_s2[0]) + (r[1][k] * force_m_s2[1]) + (r[2][k] * force_m_s2[2]);
        airframe->velocity_m_s[k] += STEP_S * (force_m_s2[k] - ((k == 2) ? GRAVITY_M_S2 : 0.0));
        airframe->position_m[k] += STEP_S * airframe->velocity_m_s[k];
    }
    spin(airframe, torque_n_m);
}

void airframe_advance(airframe_t *airframe, const desk_flight_t *flight, const double motors[MOTORS])
{
    for (int k = 0; k < STEPS_PER_MS; k++) {
        step(airframe, flight, motors);
    }
}
