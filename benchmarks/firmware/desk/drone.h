/* A Crazyflie as a rigid body with four rotors, in the firmware's world frame: x forward, y left, z up; floor at z = 0. */
#ifndef DRONE_H
#define DRONE_H

typedef struct {
    double mass_kg;
    double rotor_lag_s; /* of the rotors' speeds */
    double drag_1_s;    /* acceleration by airspeed */
    double wind_m_s[2];
} drone_parameters_t;

typedef struct {
    double position_m[3];
    double velocity_m_s[3];
    double attitude[4];          /* quaternion w, x, y, z: from body to world */
    double rates_rad_s[3];       /* about the body's axes */
    double specific_force_m_s2[3]; /* what an accelerometer in the body's frame reads */
    double speeds[4];            /* of the rotors, as shares of the largest */
} drone_t;

/* Place a drone on the floor. */
void drone_place(drone_t *drone, const double position_m[2], double heading_rad);

/* Move on by a millisecond with the thrusts of the motors as shares of the largest. */
void drone_advance(drone_t *drone, const drone_parameters_t *parameters, const double thrusts[4]);

/* Write roll, pitch (nose up) and yaw in rad. */
void drone_angles(const drone_t *drone, double angles_rad[3]);

#endif
