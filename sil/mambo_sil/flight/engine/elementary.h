/* SPDX-License-Identifier: MIT-0
 *
 * Elementary functions: sil/mambo_sil/drone/plant/elementary.py, operation by operation. constants.h, which Python writes when it
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
static inline real_t polynomial(real_t x, const double *coefficients, int count)
{
    real_t value = splat(coefficients[count - 1]);
    int i;

    for (i = count - 2; i >= 0; i--) {
        value = coefficients[i] + (x * value);
    }
    return value;
}

static inline void sine_cosine(real_t angle_rad, real_t *sine, real_t *cosine)
{
    const real_t sum = (angle_rad * TURNS_PER_RAD) + ROUNDING;
    const mask_t bounded = magnitude(sum - ROUNDING) <= MOST_TURNS;
    const real_t angle = choose(bounded, angle_rad, splat(NAN));
    const real_t rounded = choose(bounded, sum, splat(ROUNDING));
    const real_t turns = rounded - ROUNDING;
    /* The lowest two bits count the quarter turns. */
    const mask_t odd = -(bits_of(rounded) & 1);
    const mask_t half = -((bits_of(rounded) >> 1) & 1);
    const real_t sign = choose(half, splat(-1.0), splat(1.0));
    const real_t turn_sine = choose(odd, sign, splat(0.0));
    const real_t turn_cosine = choose(odd, splat(0.0), sign);
    const real_t rest = ((angle - (turns * TURN_HIGH)) - (turns * TURN_MIDDLE)) - (turns * TURN_LOW);
    const real_t square = rest * rest;
    const real_t near_sine = rest + (rest * (square * polynomial(square, SINE, COUNT(SINE))));
    const real_t near_cosine = 1.0 + (square * polynomial(square, COSINE, COUNT(COSINE)));

    *sine = (near_sine * turn_cosine) + (near_cosine * turn_sine);
    *cosine = (near_cosine * turn_cosine) - (near_sine * turn_sine);
}

static inline real_t arc_tangent(real_t x)
{
    const real_t size = magnitude(x);
    const mask_t steep = size > 1.0;
    const real_t b = choose(steep, 1.0 / size, size);
    real_t c = splat(0.0);
    real_t high = splat(ARC_HIGH[0]);
    real_t low = splat(ARC_LOW[0]);
    real_t t;
    real_t z;
    real_t y;
    int i;

    for (i = 0; i < COUNT(ARC_EDGES); i++) {
        const mask_t beyond = ARC_EDGES[i] <= b;

        c = choose(beyond, splat(0.25 * (i + 1)), c);
        high = choose(beyond, splat(ARC_HIGH[i + 1]), high);
        low = choose(beyond, splat(ARC_LOW[i + 1]), low);
    }
    t = (b - c) / (1.0 + (b * c));
    z = t * t;
    y = high + (low + (t + (t * (z * polynomial(z, ARC_TANGENT, COUNT(ARC_TANGENT))))));
    return with_sign(choose(steep, HALF_PI_HIGH - (y - HALF_PI_LOW), y), x);
}

static inline real_t arc_sine(real_t x)
{
    return arc_tangent(x / square_root((1.0 - x) * (1.0 + x)));
}

#endif
