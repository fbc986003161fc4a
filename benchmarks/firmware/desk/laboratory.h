/* A flight of the firmware on the desk. One process flies one flight: the firmware has no way back to its start. */
#ifndef LABORATORY_H
#define LABORATORY_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t seed;
    int controller; /* stabilizer.controller */
    double mass_kg;
    double rotor_lag_s;
    double drag_1_s;
    double wind_m_s[2];
    double place_m[2]; /* on the floor, which the estimator knows */
    double heading_rad;
    int camera_period_ms; /* of measured positions; 0: there is no camera */
    int camera_offset_ms; /* of its clock against that of the firmware */
    int camera_delay_ms;
    double camera_noise_m;
    bool camera_sees_attitude; /* else positions only */
    double lost_ticks; /* share of the milliseconds in which the stabilizer does not run */
} laboratory_flight_t;

/* Start the firmware; false if a self-test of its own fails. */
bool laboratory_start(const laboratory_flight_t *flight);

void laboratory_run(int milliseconds);

/* Give the firmware a packet, as the radio would. */
void laboratory_send(int port, int channel, const uint8_t *data, int bytes);

void laboratory_switch_camera(bool is_on);

/* Write position (3) in m, velocity (3) in m/s, roll, pitch (nose up) and yaw in rad, and the thrusts of the motors (4) as
 * shares of the largest; the true ones, in the firmware's frame. */
void laboratory_state(double state[13]);

/* Return a log variable, or NaN; set a parameter, false if there is none of this name. */
double laboratory_log(const char *name);
bool laboratory_set(const char *name, double value);

const char *laboratory_console(void);

#endif
