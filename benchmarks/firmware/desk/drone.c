#include "drone.h"

#include <math.h>
#include <string.h>

#define STEPS_PER_MS 10
#define STEP_S 1e-4
#define GRAVITY_M_S2 9.81
#define LARGEST_FORCE_N 0.12    /* of a rotor; THRUST_MAX of the firmware */
#define ARM_M 0.0325269         /* of a rotor along each axis */
#define TORQUE_PER_FORCE_M 0.00699 /* THRUST2TORQUE of the firmware */

static const double INERTIA_KG_M2[3] = { 1.43e-5, 1.43e-5, 2.89e-5 };

/* The rotors M1 to M4: front right, back right, back left, front left; the sign of their torque about z. */
static const double ROTOR_X[4] = { ARM_M, -ARM_M, -ARM_M, ARM_M };
static const double ROTOR_Y[4] = { -ARM_M, -ARM_M, ARM_M, ARM_M };
static const double ROTOR_TORQUE[4] = { -TORQUE_PER_FORCE_M, TORQUE_PER_FORCE_M, -TORQUE_PER_FORCE_M, TORQUE_PER_FORCE_M };

/* Columns are the body's axes in the world. */
static void rotation(const double q[4], double r[3][3])
{
    const double w = q[0], x = q[1], y = q[2], z = q[3];

    r[0][0] = 1.0 - (2.0 * ((y * y) + (z * z)));
    r[0][1] = 2.0 * ((x * y) - (w * z));
    r[0][2] = 2.0 * ((x * z) + (w * y));
    r[1][0] = 2.0 * ((x * y) + (w * z));
    r[1][1] = 1.0 - (2.0 * ((x * x) + (z * z)));
    r[1][2] = 2.0 * ((y * z) - (w * x));
    r[2][0] = 2.0 * ((x * z) - (w * y));
    r[2][1] = 2.0 * ((y * z) + (w * x));
    r[2][2] = 1.0 - (2.0 * ((x * x) + (y * y)));
}

void drone_angles(const drone_t *drone, double angles_rad[3])
{
    double r[3][3];

    rotation(drone->attitude, r);
    angles_rad[0] = atan2(r[2][1], r[2][2]);
    angles_rad[1] = asin(fmax(-1.0, fmin(1.0, r[2][0])));
    angles_rad[2] = atan2(r[1][0], r[0][0]);
}

static void level(drone_t *drone, double heading_rad)
{
    drone->attitude[0] = cos(0.5 * heading_rad);
    drone->attitude[1] = drone->attitude[2] = 0.0;
    drone->attitude[3] = sin(0.5 * heading_rad);
}

void drone_place(drone_t *drone, const double position_m[2], double heading_rad)
{
    memset(drone, 0, sizeof *drone);
    drone->position_m[0] = position_m[0];
    drone->position_m[1] = position_m[1];
    drone->specific_force_m_s2[2] = GRAVITY_M_S2;
    level(drone, heading_rad);
}

/* The floor holds a drone that would sink: it stops it, and turns it upright. */
static void rest(drone_t *drone)
{
    double angles_rad[3];

    drone_angles(drone, angles_rad);
    level(drone, angles_rad[2]);
    drone->position_m[2] = 0.0;
    for (int k = 0; k < 3; k++) {
        drone->velocity_m_s[k] = drone->rates_rad_s[k] = 0.0;
        drone->specific_force_m_s2[k] = (k == 2) ? GRAVITY_M_S2 : 0.0;
    }
}

static void turn(drone_t *drone, const double torque_n_m[3])
{
    double *const q = drone->attitude, *const w = drone->rates_rad_s;
    const double momentum[3] = { INERTIA_KG_M2[0] * w[0], INERTIA_KG_M2[1] * w[1], INERTIA_KG_M2[2] * w[2] };
    const double gyroscopic[3] = {
        (w[1] * momentum[2]) - (w[2] * momentum[1]),
        (w[2] * momentum[0]) - (w[0] * momentum[2]),
        (w[0] * momentum[1]) - (w[1] * momentum[0]),
    };
    double turned[4], norm = 0.0;

    for (int k = 0; k < 3; k++) {
        w[k] += STEP_S * (torque_n_m[k] - gyroscopic[k]) / INERTIA_KG_M2[k];
    }
    turned[0] = -(q[1] * w[0]) - (q[2] * w[1]) - (q[3] * w[2]);
    turned[1] = (q[0] * w[0]) + (q[2] * w[2]) - (q[3] * w[1]);
    turned[2] = (q[0] * w[1]) - (q[1] * w[2]) + (q[3] * w[0]);
    turned[3] = (q[0] * w[2]) + (q[1] * w[1]) - (q[2] * w[0]);
    for (int k = 0; k < 4; k++) {
        q[k] += 0.5 * STEP_S * turned[k];
        norm += q[k] * q[k];
    }
    norm = sqrt(norm);
    for (int k = 0; k < 4; k++) {
        q[k] /= norm;
    }
}

static void step(drone_t *drone, const drone_parameters_t *parameters, const double thrusts[4])
{
    const double share = STEP_S / parameters->rotor_lag_s;
    double torque_n_m[3] = { 0.0, 0.0, 0.0 }, thrust_n = 0.0, r[3][3], force_m_s2[3];

    for (int k = 0; k < 4; k++) {
        double force_n;

        drone->speeds[k] += share * (sqrt(thrusts[k]) - drone->speeds[k]);
        force_n = LARGEST_FORCE_N * drone->speeds[k] * drone->speeds[k];
        thrust_n += force_n;
        torque_n_m[0] += ROTOR_Y[k] * force_n;
        torque_n_m[1] -= ROTOR_X[k] * force_n;
        torque_n_m[2] += ROTOR_TORQUE[k] * force_n;
    }

    rotation(drone->attitude, r);
    for (int k = 0; k < 3; k++) {
        const double wind_m_s = (k < 2) ? parameters->wind_m_s[k] : 0.0;

        force_m_s2[k] = (r[k][2] * thrust_n / parameters->mass_kg) - (parameters->drag_1_s * (drone->velocity_m_s[k] - wind_m_s));
    }
    if ((drone->position_m[2] <= 0.0) && ((force_m_s2[2] < GRAVITY_M_S2) || (drone->velocity_m_s[2] < 0.0))) {
        rest(drone);
        return;
    }
    for (int k = 0; k < 3; k++) {
        drone->specific_force_m_s2[k] = (r[0][k] * force_m_s2[0]) + (r[1][k] * force_m_s2[1]) + (r[2][k] * force_m_s2[2]);
    }
    for (int k = 0; k < 3; k++) {
        drone->velocity_m_s[k] += STEP_S * (force_m_s2[k] - ((k == 2) ? GRAVITY_M_S2 : 0.0));
        drone->position_m[k] += STEP_S * drone->velocity_m_s[k];
    }
    turn(drone, torque_n_m);
}

void drone_advance(drone_t *drone, const drone_parameters_t *parameters, const double thrusts[4])
{
    for (int k = 0; k < STEPS_PER_MS; k++) {
        step(drone, parameters, thrusts);
    }
}
