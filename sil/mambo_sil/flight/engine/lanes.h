/* SPDX-License-Identifier: MIT-0
 *
 * LANES flights at once, one in each lane of a vector: an operation on a real_t is the one on a double, in every lane.
 * With one lane a real_t is a double. A comparison gives a mask, for `choose`; & and | join masks.
 */
#ifndef ENGINE_LANES_H
#define ENGINE_LANES_H

#include <math.h>
#include <stdint.h>

#ifndef LANES
#define LANES 1
#endif

#if LANES == 1
typedef double real_t;
typedef int64_t whole_t;
#else
typedef double real_t __attribute__((vector_size(8 * LANES), aligned(8)));
typedef int64_t whole_t __attribute__((vector_size(8 * LANES), aligned(8)));
#endif
typedef whole_t mask_t;

/* The numbers of the lanes, and their bits. */
typedef union {
    real_t real;
    whole_t whole;
    double lane[LANES];
    int64_t whole_lane[LANES];
} lanes_t;

/* A number in every lane; x - 0.0 has the bits of x. */
static inline real_t splat(double number)
{
    return number - (real_t){ 0.0 };
}

static inline whole_t bits_of(real_t value)
{
    const lanes_t lanes = { value };

    return lanes.whole;
}

static inline real_t of_bits(whole_t bits)
{
    lanes_t lanes;

    lanes.whole = bits;
    return lanes.real;
}

static inline double lane_of(real_t value, int lane)
{
    const lanes_t lanes = { value };

    return lanes.lane[lane];
}

/* a where the mask is set, else b. */
static inline real_t choose(mask_t mask, real_t a, real_t b)
{
#if LANES == 1
    return mask ? a : b;
#else
    return of_bits((bits_of(a) & mask) | (bits_of(b) & ~mask));
#endif
}

/* Whether the mask is set in any lane. */
static inline int any(mask_t mask)
{
    lanes_t lanes;
    int found = 0;
    int lane;

    lanes.whole = mask;
    for (lane = 0; lane < LANES; lane++) {
        found = found || (lanes.whole_lane[lane] != 0);
    }
    return found;
}

static inline real_t magnitude(real_t value)
{
    return of_bits(bits_of(value) & INT64_MAX);
}

static inline real_t with_sign(real_t value, real_t sign)
{
    return of_bits((bits_of(value) & INT64_MAX) | (bits_of(sign) & INT64_MIN));
}

static inline real_t square_root(real_t value)
{
    lanes_t lanes = { value };
    int lane;

    for (lane = 0; lane < LANES; lane++) {
        lanes.lane[lane] = sqrt(lanes.lane[lane]);
    }
    return lanes.real;
}

/* np.clip, np.maximum, np.minimum: NaN stays NaN. */
static inline real_t clip(real_t value, double low, double high)
{
    return choose(value < low, splat(low), choose(value > high, splat(high), value));
}

static inline real_t maximum(real_t a, real_t b)
{
    return choose((a > b) | (a != a), a, b);
}

static inline real_t minimum(real_t a, real_t b)
{
    return choose((a < b) | (a != a), a, b);
}

#endif
