/* SPDX-License-Identifier: MIT-0
 *
 * What the page calls besides the engine. One module is one drone: CONTROLLER is the step of its controller.
 */
#include "loop.h"

int64_t CONTROLLER(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                   double *command_rad);

engine_controller_t playground_controller(void);
size_t playground_flying_bytes(void);
void playground_eight(double half_width_m, double rate_rad_s, double time_s, double *target);
void playground_circle(double radius_m, double rate_rad_s, double time_s, double *target);
void playground_swing(double height_m, double amplitude_m, double rate_rad_s, double time_s, double *vertical);

engine_controller_t playground_controller(void)
{
    return CONTROLLER;
}

size_t playground_flying_bytes(void)
{
    return sizeof(flying_t);
}

/* Bernoulli of sil/mambo_sil/flight/trajectories.py, operation by operation, from t = 0 on: x, y, vx, vy, ax, ay. */
void playground_eight(double half_width_m, double rate_rad_s, double time_s, double *target)
{
    double sine;
    double cosine;
    double square;
    double denominator;
    double speed;
    double scale;

    sine_cosine(rate_rad_s * time_s, &sine, &cosine);
    square = cosine * cosine;
    denominator = 1.0 + square;
    speed = (half_width_m * rate_rad_s) / (denominator * denominator);
    scale = (((half_width_m * rate_rad_s) * rate_rad_s) * sine) / ((denominator * denominator) * denominator);
    target[0] = (half_width_m * sine) / denominator;
    target[1] = target[0] * cosine;
    target[2] = (speed * cosine) * (denominator + ((2.0 * sine) * sine));
    target[3] = speed * (((3.0 * cosine) * cosine) - 1.0);
    target[4] = scale * (((12.0 - square) * square) - 3.0);
    target[5] = ((2.0 * scale) * cosine) * ((3.0 * square) - 5.0);
}

/* Circle of sil/mambo_sil/flight/trajectories.py likewise. */
void playground_circle(double radius_m, double rate_rad_s, double time_s, double *target)
{
    const double square = rate_rad_s * rate_rad_s;
    double sine;
    double cosine;

    sine_cosine(rate_rad_s * time_s, &sine, &cosine);
    target[0] = radius_m * cosine;
    target[1] = radius_m * sine;
    target[2] = -rate_rad_s * target[1];
    target[3] = rate_rad_s * target[0];
    target[4] = -square * target[0];
    target[5] = -square * target[1];
}

/* Swing of sil/mambo_sil/flight/height_profiles.py likewise, about any height: height, climb, vertical acceleration. */
void playground_swing(double height_m, double amplitude_m, double rate_rad_s, double time_s, double *vertical)
{
    double sine;
    double cosine;
    double swing;

    sine_cosine(rate_rad_s * time_s, &sine, &cosine);
    swing = amplitude_m * sine;
    vertical[0] = height_m + swing;
    vertical[1] = (amplitude_m * rate_rad_s) * cosine;
    vertical[2] = -(rate_rad_s * rate_rad_s) * swing;
}
