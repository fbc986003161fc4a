/* The airframe: a rigid body with four rotors, a floor, and a table under the start. */
#ifndef AIRFRAME_H
#define AIRFRAME_H

#include <stdint.h>

#include "desk.h"

#define GRAVITY_M_S2 9.81
#define MOTORS 4
#define DEGREES 57.295779513082323

typedef struct {
    double position_m[3];
    double velocity_m_s[3];
    double attitude[4];            /* quaternion w, x, y, z: from body to world */
    double rates_rad_s[3];         /* about the body's axes */
    double specific_force_m_s2[3]; /* what an accelerometer in the body's frame reads */
    double speeds[MOTORS];         /* of the rotors, as shares of the most */
    double touch_m_s;
    double time_s;
    double push_n[3];              /* a force from outside, and for how long it lasts */
    double push_s;
} airframe_t;

/* Write the columns of the body's axes in the world. */
void rotation_of(const double attitude[4], double rotation[3][3]);

/* Write roll (right side down), pitch (nose up) and yaw (to the left), rad. */
void angles_of(const double attitude[4], double angles_rad[3]);

/* Turn an attitude by a rotation vector about the body's axes, rad. */
void turn(double attitude[4], const double angle_rad[3]);

/* Return the height of what is below a place. */
double ground_below(const desk_flight_t *flight, const double position_m[3]);

/* Place a drone where a flight begins. */
void airframe_place(airframe_t *airframe, const desk_flight_t *flight);

/* Move on by a millisecond with what the firmware asks of the motors, as shares of the most. */
void airframe_advance(airframe_t *airframe, const desk_flight_t *flight, const double motors[MOTORS]);

#endif
