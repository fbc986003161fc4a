/* The estimator: an extended Kalman filter of position, velocity in the body's frame, and attitude, as the firmware's
 * documentation describes its own: M. W. Mueller, M. Hamer, R. D'Andrea, "Fusing ultra-wideband range measurements with
 * accelerometers and rate gyroscopes for quadrocopter state estimation", ICRA 2015; the attitude is a quaternion beside an
 * error that each update moves into it.
 *
 *     p' = R v      v' = f e_z - w x v - g R^T e_z      R' = R [w]x      (f: specific force along the body's z)
 *
 * Drag is not modelled. On the ground, all of the accelerometer counts. */
#ifndef ESTIMATOR_H
#define ESTIMATOR_H

#include "airframe.h"

#define ESTIMATOR_STATES 9 /* position, velocity, attitude error, three of each */

typedef struct {
    double position_m[3];
    double velocity_m_s[3]; /* in the body's frame */
    double attitude[4];
    double variance[ESTIMATOR_STATES][ESTIMATOR_STATES];
    double rates_sum[3];    /* of measurements since the last prediction */
    double force_sum[3];
    double rates_rad_s[3];  /* measured last */
    int measured;
    int since_prediction_ms;
} estimator_t;

void estimator_start(estimator_t *filter, double yaw_rad);

/* Take the gyroscope and the accelerometer of a millisecond, and predict every PREDICTION_MS of them. */
void estimator_advance(estimator_t *filter, const double rates_rad_s[3], const double force_m_s2[3], int is_flying);

void estimator_see_position(estimator_t *filter, const double position_m[3]);

/* Take a frame of the flow deck: what the floor moved in it, in tenths of pixels. */
void estimator_see_flow(estimator_t *filter, const double counts[2], double duration_s);

/* Take the distance to the floor along the body's z. */
void estimator_see_range(estimator_t *filter, double range_m);

/* What a plane of light of a Lighthouse station measures at a sensor: the angle of the station's rotor. */
typedef struct {
    double station_m[3];
    double axes[3][3];   /* of the station, columns: ahead, to the left, along the rotor's axis */
    double tilt_rad;     /* of the plane */
    double sensor_m[3];  /* in the body's frame */
    double angle_rad;
} sweep_t;

/* Return by how much the measured angle exceeds that of a drone at a place; write the sensor's distance to the rotor's axis. */
double sweep_error(const sweep_t *sweep, const double position_m[3], const double attitude[4], double *distance_m);

void estimator_see_sweep(estimator_t *filter, const sweep_t *sweep);

/* The flow chip sees this angle on this many pixels, and counts tenths of them. */
#define FLOW_PIXELS 35.0
#define FLOW_ANGLE_RAD 0.71674
#define FLOW_COUNTS_PER_PIXEL 10.0

/* Return what the firmware takes for the deviation of a measured range. */
double range_deviation(double range_m);

#endif
