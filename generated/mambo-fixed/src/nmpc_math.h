/* SPDX-License-Identifier: MIT-0
 *
 * The few functions that the controller needs beyond + - *, the same bits everywhere.
 * MISRA C:2012: departs from rules 2.3, 10.1, 10.3 and 19.2, for the reasons in deviations.txt.
 */
#ifndef NMPC_MATH_H
#define NMPC_MATH_H

#include "nmpc_config.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xD4C905DCUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* Products shift negative numbers to the right, and C leaves open what that does: an array of negative size stops
 * the build where it is not rounding down. */
typedef char nmpc_assert_shift_rounds_down[(((-3) >> 1) == -2) ? 1 : -1];

#ifdef __cplusplus
extern "C" {
#endif

/* Put before a loop over moves, axes or responses to have it written out: on a Cortex-M4F that keeps their sums in
 * registers. Other compilers judge for themselves. */
#if defined(__GNUC__) && !defined(__clang__) && (__GNUC__ >= 8)
#define NMPC_UNROLL _Pragma("GCC unroll 8")
#else
#define NMPC_UNROLL
#endif

/* The same for the loop over predicted steps; on a desk it runs a tenth faster as it stands. */
#if defined(__x86_64__)
#define NMPC_UNROLL_STEPS
#else
#define NMPC_UNROLL_STEPS NMPC_UNROLL
#endif

/* The sign of zero, of either sign, is 0. */
static inline int nmpc_sign(nmpc_sum_t value)
{
    return (value > (nmpc_sum_t)0) ? 1 : ((value < (nmpc_sum_t)0) ? -1 : 0);
}

/* The bits of a value; the highest is its sign. Where there is no FPU, reading bits is much cheaper than a
 * comparison. */
#if defined(__SIZEOF_INT__) && (__SIZEOF_INT__ < 4)
typedef unsigned long nmpc_bits_t;
#else
typedef unsigned int nmpc_bits_t;
#endif

static inline nmpc_bits_t nmpc_bits(nmpc_real_t value)
{
    union {
        nmpc_real_t real;
        nmpc_bits_t bits;
    } view;

    view.real = value;
    return view.bits;
}

/* A word with a bit for each predicted step, counted from 0: the last step's is the lowest, the first step's that at
 * place NMPC_LAST_STEP. */
typedef unsigned long nmpc_steps_t;
#define NMPC_LAST_STEP 9U

/* 1 if `value` is below zero, or the negative zero. */
static inline nmpc_steps_t nmpc_is_below(nmpc_real_t value)
{
    const nmpc_bits_t sign = nmpc_bits(value) >> 31U;

    return (nmpc_steps_t)sign;
}

/* The place of the lowest one in `word`, which has one. */
static inline unsigned int nmpc_lowest_one(nmpc_steps_t word)
{
#if defined(__GNUC__)
    return (unsigned int)__builtin_ctzl(word);
#else
    unsigned int place;

    for (place = 0U; ((place + 1U) < NMPC_LAST_STEP) && (((word >> place) & 1U) == 0U); place++) {
        /* Nothing to do on the way. */
    }
    return place;
#endif
}

static inline nmpc_sum_t nmpc_absolute(nmpc_sum_t value)
{
    return (value < (nmpc_sum_t)0) ? -value : value;
}

static inline nmpc_real_t nmpc_smaller(nmpc_real_t a, nmpc_real_t b)
{
    return (a < b) ? a : b;
}

static inline nmpc_real_t nmpc_larger(nmpc_real_t a, nmpc_real_t b)
{
    return (a > b) ? a : b;
}

/* Bring `value` within +/- `limit`. */
static inline nmpc_real_t nmpc_clamp(nmpc_real_t value, nmpc_real_t limit)
{
    return nmpc_smaller(nmpc_larger(value, -limit), limit);
}

/* Tell whether `value` is a number from `least` to `most`. Both comparisons have a name, so that a proof by
 * abstract interpretation keeps what they say about NaN. */
static inline int nmpc_between(nmpc_real_t value, nmpc_real_t least, nmpc_real_t most)
{
    const int is_enough = (value >= least);
    const int is_no_more = (value <= most);

    return (is_enough != 0) && (is_no_more != 0);
}

/* Tell whether `value` is a number within +/- `limit`. */
static inline int nmpc_within(nmpc_real_t value, nmpc_real_t limit)
{
    return nmpc_between(value, -limit, limit);
}

/* A sum, shifted `bits` to the right, to the nearest number, ties up. */
#define NMPC_ROUNDED(sum, bits) (((sum) + ((nmpc_sum_t)1 << ((bits) - 1))) >> (bits))

/* Products, by what they mean: one multiplication to 64 bits, and one shift to the format of the result.
 * nmpc_config.h chooses the formats such that none overflows for inputs within their ranges. */
static inline nmpc_real_t nmpc_push(nmpc_real_t thrust_acceleration_m_s2)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)thrust_acceleration_m_s2 * NMPC_PREDICTION_STEP_SQUARED_S2,
                                     NMPC_THRUST_BITS + NMPC_STEP_SQUARED_BITS - NMPC_GAIN_BITS);
}

static inline nmpc_real_t nmpc_component(nmpc_real_t push_m, nmpc_real_t sine)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)push_m * sine, NMPC_SINE_BITS);
}

/* The advance carries half the resolution of an error on its way, so that what it adds to one is rounded. */
static inline nmpc_real_t nmpc_travel(nmpc_real_t velocity_m_s)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)NMPC_PREDICTION_STEP_S * velocity_m_s,
                                     NMPC_STEP_BITS + NMPC_VELOCITY_BITS - NMPC_BEND_BITS)
           + ((nmpc_real_t)1 << (NMPC_BEND_BITS - NMPC_ERROR_BITS - 1));
}

/* The two products of a walk are rounded down: that is half the work, and by far the most of it. */
static inline nmpc_real_t nmpc_bend(nmpc_real_t gain_m, nmpc_real_t turn_rad)
{
    return (nmpc_real_t)(((nmpc_sum_t)gain_m * turn_rad) >> (NMPC_GAIN_BITS + NMPC_ANGLE_BITS - NMPC_BEND_BITS));
}

/* The bend has room for the shift, so that only the upper word of the product is needed. */
static inline nmpc_real_t nmpc_part(nmpc_real_t share, nmpc_real_t bend_m)
{
    return (nmpc_real_t)(((nmpc_sum_t)share * (bend_m * ((nmpc_real_t)1 << (32 - NMPC_SHARE_BITS)))) >> 32);
}

/* Errors beyond what the horizon can change are clamped: that moves no slope and no difference of costs. */
static inline nmpc_real_t nmpc_first_error(nmpc_real_t difference_m)
{
    return nmpc_clamp(difference_m, NMPC_ERROR_LIMIT_M)
           * ((nmpc_real_t)1 << (NMPC_ERROR_BITS - NMPC_POSITION_BITS));
}

static inline nmpc_real_t nmpc_step_of(nmpc_real_t advance_m)
{
    return advance_m >> (NMPC_BEND_BITS - NMPC_ERROR_BITS);
}

/* Rounded down as well. */
static inline nmpc_real_t nmpc_distance_slope(nmpc_real_t gain_x_m, nmpc_real_t slope_x, nmpc_real_t gain_y_m,
                                              nmpc_real_t slope_y)
{
    return (nmpc_real_t)((((nmpc_sum_t)gain_x_m * slope_x) + ((nmpc_sum_t)gain_y_m * slope_y))
                         >> (NMPC_GAIN_BITS + NMPC_RESPONSE_BITS - NMPC_SLOPE_BITS));
}

static inline nmpc_sum_t nmpc_tracking_cost(nmpc_real_t weight, nmpc_sum_t distance_m)
{
    return weight * distance_m;
}

static inline nmpc_sum_t nmpc_effort_cost(nmpc_real_t weight, nmpc_sum_t variation_rad)
{
    return NMPC_ROUNDED(weight * variation_rad, NMPC_EFFORT_BITS + NMPC_ANGLE_BITS - NMPC_COST_BITS);
}

static inline nmpc_sum_t nmpc_tracking_slope(nmpc_real_t weight, nmpc_real_t slope_m)
{
    return (nmpc_sum_t)weight * slope_m;
}

static inline nmpc_sum_t nmpc_effort_slope(nmpc_real_t weight)
{
    return weight * ((nmpc_sum_t)1 << (NMPC_GRADIENT_BITS - NMPC_EFFORT_BITS));
}

/* A step has room for the shift too, and is rounded down. */
static inline nmpc_real_t nmpc_scaled(nmpc_real_t step_rad, nmpc_real_t factor)
{
    return (nmpc_real_t)(((nmpc_sum_t)factor * (step_rad * ((nmpc_real_t)1 << (32 - NMPC_FACTOR_BITS)))) >> 32);
}

/* Sine and cosine for |angle_rad| <= NMPC_YAW_RANGE_RAD, each within 2e-09 of the true value. */
void nmpc_sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine);

#ifdef __cplusplus
}
#endif

#endif
