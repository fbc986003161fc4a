/* A Crazyflie on the desk: the generated app, and all that surrounds it in the firmware, written from its documentation.
 *
 * Frames are the firmware's: the world is x forward, y left, z up; roll is right side down, pitch nose up, yaw to the left. */

#ifndef DESK_H
#define DESK_H

#include <stdint.h>

/* What measures the position. */
enum { DESK_MOCAP, DESK_FLOW_DECK, DESK_LIGHTHOUSE };

/* What a flight begins with. */
typedef struct {
    uint32_t seed;
    double mass_kg;
    double rotor_lag_s;                 /* time constant of the rotors' speeds */
    double drag_1_s;                    /* acceleration by airspeed */
    double wind_m_s[2];
    double thrust_gain;                 /* thrust over what the firmware asks for */
    double motor_gains[4];              /* of each motor, over that: front right, back right, back left, front left */
    double sag_1_s;                     /* share of the thrust that the cell loses in a second, until a quarter is lost */
    double centre_m[2];                 /* centre of mass, ahead and to the left of the rotors' centre */
    double heading_rad;                 /* of the drone on the floor */
    double table_m;                     /* height of a table under the start; 0: it stands on the floor */
    double table_radius_m;
    double gyroscope_bias_rad_s[3];
    double accelerometer_bias_g[3];
    int sensors;                        /* DESK_MOCAP, DESK_FLOW_DECK or DESK_LIGHTHOUSE */
    int camera_period_ms;
    int camera_delay_ms;                /* at most 200 */
    int camera_offset_ms;               /* of the clock of camera, flow deck or base stations against the estimator's */
    double camera_noise_m;
    double camera_outliers;             /* share of the frames that are off, in a direction at random */
    double camera_outlier_m;            /* by so much */
    double flow_noise_counts;           /* of a frame of the flow deck, tenths of pixels */
    double sweep_reflections;           /* share of the sweeps of base stations that are off, by up to half a radian */
    double initial_yaw_rad;             /* what the estimator believes of the heading */
    double lost_ticks;                  /* share of the milliseconds in which the stabilizer does not run */
} desk_flight_t;

/* The true state. */
typedef struct {
    double position_m[3];
    double velocity_m_s[3];
    double angles_rad[3];               /* roll, pitch, yaw */
    double motors[4];                   /* what the firmware asks of them, as shares of the most */
    double touch_m_s;                   /* the fastest descent at which the drone has met the floor, 0 if it never did */
} desk_state_t;

/* Begin a flight; once in a library's life, since the app has no way back to its start. Returns 0 if a self-test fails. */
int desk_start(const desk_flight_t *flight);

void desk_run(int milliseconds);

/* Set-points by radio, in SI units and rad. */
void desk_full_state(const double position_m[3], const double velocity_m_s[3], const double acceleration_m_s2[3], double yaw_rad);
void desk_stop(void);                   /* motors off */
void desk_yield(void);                  /* no set-points follow: the high-level commander flies */

/* Plans of the high-level commander. */
void desk_take_off(double z_m, double yaw_rad, double duration_s);
void desk_land(double z_m, double yaw_rad, double duration_s);
void desk_go_to(const double position_m[3], double yaw_rad, double duration_s);

/* Write pieces of a trajectory into memory, from a place in 0..30 on, also while it flies: each has 8 coefficients of x, y, z and yaw,
 * lowest first, and its duration. Fly the first `count`. */
void desk_write_pieces(int first, const double *pieces, int count);
void desk_start_trajectory(int count);

/* Whether the camera, the flow deck or the base stations measure. */
void desk_measure(int is_on);

/* Let DESK_MOCAP, DESK_FLOW_DECK or DESK_LIGHTHOUSE measure from now on. */
void desk_switch(int to);

/* Let the camera's next frames be off by a jump; one that is not a number is a frame that is not. */
void desk_jump(const double jump_m[3], int frames);

void desk_kick(const double velocity_m_s[3]);                 /* change the velocity at once */
void desk_hit(const double rates_rad_s[3]);                   /* change the rates about the body's axes at once */
void desk_push(const double force_n[3], int milliseconds);

void desk_state(desk_state_t *state);

/* Return a log variable as "group.name", NaN if there is none; set a parameter, 0 if there is none. */
double desk_log(const char *name);
int desk_set(const char *name, double value);

/* Return the group of the app's log variables and parameters. */
const char *desk_group(void);

/* What was printed. */
const char *desk_console(void);

#endif
