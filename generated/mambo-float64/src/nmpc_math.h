/* SPDX-License-Identifier: MIT-0
 *
 * The few functions that the controller needs beyond + - *, the same bits everywhere.
 * MISRA C:2012: departs from rules 10.3 and 19.2, for the reasons in deviations.txt.
 */
#ifndef NMPC_MATH_H
#define NMPC_MATH_H

#include "nmpc_config.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x8D00AE40UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* Flags that would change the arithmetic of this library. */
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && (__FINITE_MATH_ONLY__ > 0))
#error "build without -ffast-math: the input check relies on NaN, the bits on the order of operations"
#endif
#if defined(__ASSOCIATIVE_MATH__)
#error "build without -fassociative-math: it changes the order of operations"
#endif
#if defined(__FLT_EVAL_METHOD__) && (__FLT_EVAL_METHOD__ != 0) && (__FLT_EVAL_METHOD__ != 16)
#error "arithmetic must keep the precision of its type: on x86 build with -mfpmath=sse"
#endif

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
typedef unsigned long long nmpc_bits_t;

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
    const nmpc_bits_t sign = nmpc_bits(value) >> 63U;

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
#if defined(__GNUC__)
    return __builtin_fabs(value);
#else
    return (value < (nmpc_sum_t)0) ? -value : value;
#endif
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

/* Products, by what they mean. */
static inline nmpc_real_t nmpc_push(nmpc_real_t thrust_acceleration_m_s2)
{
    return thrust_acceleration_m_s2 * NMPC_PREDICTION_STEP_SQUARED_S2;
}

static inline nmpc_real_t nmpc_component(nmpc_real_t push_m, nmpc_real_t sine)
{
    return push_m * sine;
}

static inline nmpc_real_t nmpc_travel(nmpc_real_t velocity_m_s)
{
    return NMPC_PREDICTION_STEP_S * velocity_m_s;
}

static inline nmpc_real_t nmpc_bend(nmpc_real_t gain_m, nmpc_real_t turn_rad)
{
    return gain_m * turn_rad;
}

static inline nmpc_real_t nmpc_part(nmpc_real_t share, nmpc_real_t bend_m)
{
    return share * bend_m;
}

static inline nmpc_real_t nmpc_first_error(nmpc_real_t difference_m)
{
    return difference_m;
}

static inline nmpc_real_t nmpc_step_of(nmpc_real_t advance_m)
{
    return advance_m;
}

static inline nmpc_real_t nmpc_distance_slope(nmpc_real_t gain_x_m, nmpc_real_t slope_x, nmpc_real_t gain_y_m,
                                              nmpc_real_t slope_y)
{
    return (gain_x_m * slope_x) + (gain_y_m * slope_y);
}

static inline nmpc_sum_t nmpc_tracking_cost(nmpc_real_t weight, nmpc_sum_t distance_m)
{
    return weight * distance_m;
}

static inline nmpc_sum_t nmpc_effort_cost(nmpc_real_t weight, nmpc_sum_t variation_rad)
{
    return weight * variation_rad;
}

static inline nmpc_sum_t nmpc_tracking_slope(nmpc_real_t weight, nmpc_real_t slope_m)
{
    return weight * slope_m;
}

static inline nmpc_sum_t nmpc_effort_slope(nmpc_real_t weight)
{
    return weight;
}

static inline nmpc_real_t nmpc_scaled(nmpc_real_t step_rad, nmpc_real_t factor)
{
    return step_rad * factor;
}

/* Sine and cosine for |angle_rad| <= NMPC_YAW_RANGE_RAD, each within 2.3e-16 of the true value. */
void nmpc_sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine);

#ifdef __cplusplus
}
#endif

#endif
