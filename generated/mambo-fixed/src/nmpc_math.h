/* SPDX-License-Identifier: MIT-0
 *
 * Elementary functions with the same bits on every board.
 * MISRA C:2012: departs from rules 2.3, 10.1, 10.3 and 19.2, for the reasons in deviations.txt.
 */
#ifndef NMPC_MATH_H
#define NMPC_MATH_H

#include "nmpc_config.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* Products shift negative numbers to the right, and C leaves the result to the implementation: an array of
 * negative size stops the build where it does not round down. */
typedef char nmpc_assert_shift_rounds_down[(((-3) >> 1) == -2) ? 1 : -1];

#ifdef __cplusplus
extern "C" {
#endif

/* Ask gcc to unroll the next loop: on a Cortex-M4F the arrays of the loop are then kept in registers. Other
 * compilers decide for themselves. */
#if defined(__GNUC__) && !defined(__clang__) && (__GNUC__ >= 8)
#define NMPC_UNROLL _Pragma("GCC unroll 8")
#else
#define NMPC_UNROLL
#endif

/* The bits of a value; the most significant one is its sign. Without an FPU, reading bits takes far fewer
 * instructions than a comparison. */
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

static inline nmpc_real_t nmpc_smaller(nmpc_real_t a, nmpc_real_t b)
{
    return (a < b) ? a : b;
}

static inline nmpc_real_t nmpc_larger(nmpc_real_t a, nmpc_real_t b)
{
    return (a > b) ? a : b;
}

/* 1 if `minimum` <= `value` <= `maximum`, else 0; 0 for NaN. Each comparison has a variable of its own, so that a
 * proof by abstract interpretation can conclude that NaN is excluded. */
static inline int nmpc_between(nmpc_real_t value, nmpc_real_t minimum, nmpc_real_t maximum)
{
    const int is_at_least = (value >= minimum);
    const int is_at_most = (value <= maximum);

    return (is_at_least != 0) && (is_at_most != 0);
}

/* 1 if |`value`| <= `limit`, else 0; 0 for NaN. */
static inline int nmpc_within(nmpc_real_t value, nmpc_real_t limit)
{
    return nmpc_between(value, -limit, limit);
}

/* 1 if |`value`| >= `limit`, else 0. */
static inline int nmpc_reaches(nmpc_real_t value, nmpc_real_t limit)
{
    return (value >= limit) || (value <= -limit);
}

/* Saturate `value` at +/- `limit`. */
static inline nmpc_real_t nmpc_clamp(nmpc_real_t value, nmpc_real_t limit)
{
    return (value > limit) ? limit : ((value < -limit) ? -limit : value);
}

/* Shift a sum right by `bits`, rounded to nearest, ties up. */
#define NMPC_ROUNDED(sum, bits) (((sum) + ((nmpc_sum_t)1 << ((bits) - 1))) >> (bits))

/* Products, named after their factors or their results: multiplications to 64 bits, and a shift to the format of the
 * result. The formats are chosen such that no product and no sum overflows for inputs within their ranges. */
static inline nmpc_real_t nmpc_sine_product(nmpc_real_t value, nmpc_real_t sine)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)value * sine, NMPC_SINE_BITS);
}

/* a b - c d and a b + c d of sines and cosines, at most 1. */
static inline nmpc_real_t nmpc_unit(nmpc_sum_t product)
{
    const nmpc_sum_t value = NMPC_ROUNDED(product, NMPC_SINE_BITS);

    return (nmpc_real_t)((value > NMPC_ONE) ? NMPC_ONE : ((value < -NMPC_ONE) ? -NMPC_ONE : value));
}

static inline nmpc_real_t nmpc_sine_difference(nmpc_real_t a, nmpc_real_t b, nmpc_real_t c, nmpc_real_t d)
{
    return nmpc_unit(((nmpc_sum_t)a * b) - ((nmpc_sum_t)c * d));
}

static inline nmpc_real_t nmpc_sine_sum(nmpc_real_t a, nmpc_real_t b, nmpc_real_t c, nmpc_real_t d)
{
    return nmpc_unit(((nmpc_sum_t)a * b) + ((nmpc_sum_t)c * d));
}

static inline nmpc_real_t nmpc_speed_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 32);
}

static inline nmpc_real_t nmpc_tilt_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 29);
}

static inline nmpc_real_t nmpc_command_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 31);
}

static inline nmpc_real_t nmpc_per_step_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 29);
}

static inline nmpc_real_t nmpc_per_step2_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 24);
}

static inline nmpc_real_t nmpc_drag_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 33);
}

static inline nmpc_real_t nmpc_feedback_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 28);
}

static inline nmpc_real_t nmpc_ratio_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 32);
}

static inline nmpc_real_t nmpc_target_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 24);
}

static inline nmpc_real_t nmpc_tracker_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value, 30);
}

static inline nmpc_real_t nmpc_position_correction(nmpc_real_t by_position, nmpc_real_t innovation_m, nmpc_real_t by_velocity,
                                          nmpc_real_t innovation_m_step)
{
    return (nmpc_real_t)NMPC_ROUNDED(((nmpc_sum_t)by_position * innovation_m)
                                     + ((nmpc_sum_t)by_velocity * innovation_m_step), 35);
}

static inline nmpc_real_t nmpc_velocity_correction(nmpc_real_t by_position, nmpc_real_t innovation_m, nmpc_real_t by_velocity,
                                          nmpc_real_t innovation_m_step)
{
    return (nmpc_real_t)NMPC_ROUNDED(((nmpc_sum_t)by_position * innovation_m)
                                     + ((nmpc_sum_t)by_velocity * innovation_m_step), 31);
}

static inline nmpc_real_t nmpc_disturbance_correction(nmpc_real_t by_position, nmpc_real_t innovation_m, nmpc_real_t by_velocity,
                                          nmpc_real_t innovation_m_step)
{
    return (nmpc_real_t)NMPC_ROUNDED(((nmpc_sum_t)by_position * innovation_m)
                                     + ((nmpc_sum_t)by_velocity * innovation_m_step), 30);
}

/* Changes of format; an input position has that of the estimates. */
static inline nmpc_real_t nmpc_half_change(nmpc_real_t acceleration_m_step2)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)acceleration_m_step2, 9);
}

static inline nmpc_real_t nmpc_velocity_change(nmpc_real_t acceleration_m_step2)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)acceleration_m_step2, 8);
}

static inline nmpc_real_t nmpc_position_change(nmpc_real_t velocity_m_step)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)velocity_m_step, 9);
}

static inline nmpc_real_t nmpc_move_acceleration(nmpc_real_t move_m_step2)
{
    return move_m_step2 * ((nmpc_real_t)1 << 9);
}

/* Sums of the products of a row. */
static inline nmpc_real_t nmpc_attitude_sum(nmpc_sum_t sum)
{
    return (nmpc_real_t)NMPC_ROUNDED(sum, 30);
}

static inline nmpc_real_t nmpc_row_sum(nmpc_sum_t sum)
{
    return (nmpc_real_t)NMPC_ROUNDED(sum, 32);
}

/* Sine and cosine for |angle_rad| <= NMPC_YAW_RANGE_RAD, with absolute errors of at most 2e-09. */
void nmpc_sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine);

#ifdef __cplusplus
}
#endif

#endif
