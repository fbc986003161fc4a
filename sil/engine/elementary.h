/* SPDX-License-Identifier: MIT-0
 *
 * Elementary functions: sil/plant/elementary.py, operation by operation. constants.h, which Python writes when it
 * builds the engine, holds the constants of that module.
 */
#ifndef ENGINE_ELEMENTARY_H
#define ENGINE_ELEMENTARY_H

#include "constants.h"
#include "engine.h"

#define COUNT(array) ((int)(sizeof(array) / sizeof((array)[0])))

/* Adding and subtracting it rounds a number below 2^51 to the nearest integer. */
#define ROUNDING 6755399441055744.0 /* 1.5 * 2^52 */

/* c[0] + (x * (c[1] + (x * (c[2] + ...)))) */
static inline double polynomial(double x, const double *coefficients, int count)
{
    double value = coefficients[count - 1];
    int i;

    for (i = count - 2; i >= 0; i--) {
        value = coefficients[i] + (x * value);
    }
    return value;
}

static inline void sine_cosine(double angle_rad, double *sine, double *cosine)
{
    static const double turn_sines[4] = { 0.0, 1.0, 0.0, -1.0 };
    static const double turn_cosines[4] = { 1.0, 0.0, -1.0, 0.0 };
    double turns = ((angle_rad * TURNS_PER_RAD) + ROUNDING) - ROUNDING;
    double rest;
    double square;
    double near_sine;
    double near_cosine;
    int quadrant;

    if (!(fabs(turns) <= MOST_TURNS)) {
        angle_rad = NAN;
        turns = 0.0;
    }
    rest = ((angle_rad - (turns * TURN_HIGH)) - (turns * TURN_MIDDLE)) - (turns * TURN_LOW);
    square = rest * rest;
    near_sine = rest + (rest * (square * polynomial(square, SINE, COUNT(SINE))));
    near_cosine = 1.0 + (square * polynomial(square, COSINE, COUNT(COSINE)));
    quadrant = (int)turns & 3;
    *sine = (near_sine * turn_cosines[quadrant]) + (near_cosine * turn_sines[quadrant]);
    *cosine = (near_cosine * turn_cosines[quadrant]) - (near_sine * turn_sines[quadrant]);
}

static inline double arc_tangent(double x)
{
    const double size = fabs(x);
    const int steep = size > 1.0;
    const double b = steep ? (1.0 / size) : size;
    int nearest = 0;
    double c;
    double t;
    double z;
    double y;

    while ((nearest < COUNT(ARC_EDGES)) && (ARC_EDGES[nearest] <= b)) {
        nearest++;
    }
    c = 0.25 * nearest;
    t = (b - c) / (1.0 + (b * c));
    z = t * t;
    y = ARC_HIGH[nearest] + (ARC_LOW[nearest] + (t + (t * (z * polynomial(z, ARC_TANGENT, COUNT(ARC_TANGENT))))));
    return copysign(steep ? (HALF_PI_HIGH - (y - HALF_PI_LOW)) : y, x);
}

static inline double arc_sine(double x)
{
    return arc_tangent(x / sqrt((1.0 - x) * (1.0 + x)));
}

#endif
