/* SPDX-License-Identifier: MIT-0
 *
 * Elementary functions with the same bits on every board.
 * MISRA C:2012: departs from rules 2.3, 10.1, 10.3 and 19.2, for the reasons in deviations.txt.
 */
#ifndef NMPC_MATH_H
#define NMPC_MATH_H

#include "nmpc_config.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xD4C905DCUL)
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

/* -1, 0 or 1; 0 for +0 and -0. */
static inline int nmpc_sign(nmpc_sum_t value)
{
    return (value > (nmpc_sum_t)0) ? 1 : ((value < (nmpc_sum_t)0) ? -1 : 0);
}

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

/* One bit per prediction step, the first step in the most significant bit, the last in bit 0. Steps count from 0
 * to NMPC_LAST_STEP, in the paper from 1 to N_p: step i has bit NMPC_LAST_STEP - i. */
typedef unsigned long nmpc_steps_t;
#define NMPC_LAST_STEP 9U

/* The sign bit: 1 for negative values, else 0. */
static inline nmpc_steps_t nmpc_is_negative(nmpc_real_t value)
{
    const nmpc_bits_t sign = nmpc_bits(value) >> 31U;

    return (nmpc_steps_t)sign;
}

/* Index of the least significant set bit; `word` must not be 0. */
static inline unsigned int nmpc_lowest_set_bit(nmpc_steps_t word)
{
#if defined(__GNUC__)
    return (unsigned int)__builtin_ctzl(word);
#else
    unsigned int index;

    for (index = 0U; ((index + 1U) < NMPC_LAST_STEP) && (((word >> index) & 1U) == 0U); index++) {
        /* Test the next bit. */
    }
    return index;
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

/* Saturate `value` at +/- `limit`. */
static inline nmpc_real_t nmpc_clamp(nmpc_real_t value, nmpc_real_t limit)
{
    return nmpc_smaller(nmpc_larger(value, -limit), limit);
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

/* Shift a sum right by `bits`, rounded to nearest, ties up. */
#define NMPC_ROUNDED(sum, bits) (((sum) + ((nmpc_sum_t)1 << ((bits) - 1))) >> (bits))

/* Products, named after their factors: a multiplication to 64 bits, and a shift to the format of the result.
 * The formats of nmpc_config.h are chosen such that no product overflows for inputs within their ranges. */
static inline nmpc_real_t nmpc_thrust_product(nmpc_real_t thrust_m_s2, nmpc_real_t step_squared_s2)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)thrust_m_s2 * step_squared_s2,
                                     NMPC_THRUST_BITS + NMPC_STEP_SQUARED_BITS - NMPC_GAIN_BITS);
}

static inline nmpc_real_t nmpc_sine_product(nmpc_real_t value, nmpc_real_t sine)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)value * sine, NMPC_SINE_BITS);
}

/* Half of the resolution of an error is added, so that nmpc_error_change() rounds to nearest. */
static inline nmpc_real_t nmpc_velocity_product(nmpc_real_t step_s, nmpc_real_t velocity_m_s)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)step_s * velocity_m_s,
                                     NMPC_STEP_BITS + NMPC_VELOCITY_BITS - NMPC_ACCELERATION_BITS)
           + ((nmpc_real_t)1 << (NMPC_ACCELERATION_BITS - NMPC_ERROR_BITS - 1));
}

/* The products of a roll-out, with a gain and with a share, are rounded down: that halves the instructions of each. */
static inline nmpc_real_t nmpc_gain_product(nmpc_real_t gain_m_step2_rad, nmpc_real_t tilt_rad)
{
    return (nmpc_real_t)(((nmpc_sum_t)gain_m_step2_rad * tilt_rad)
                         >> (NMPC_GAIN_BITS + NMPC_ANGLE_BITS - NMPC_ACCELERATION_BITS));
}

/* The acceleration has room to be shifted left first: then the result is the upper word of the product. */
static inline nmpc_real_t nmpc_share_product(nmpc_real_t share, nmpc_real_t acceleration_m_step2)
{
    return (nmpc_real_t)(((nmpc_sum_t)share
                          * (nmpc_real_t)(acceleration_m_step2 * ((nmpc_real_t)1 << (32 - NMPC_SHARE_BITS))))
                         >> 32);
}

/* Clamping an error whose sign no plan can change changes neither the gradient nor a difference of costs. */
static inline nmpc_real_t nmpc_initial_error(nmpc_real_t difference_m)
{
    return nmpc_clamp(difference_m, NMPC_ERROR_LIMIT_M)
           * ((nmpc_real_t)1 << (NMPC_ERROR_BITS - NMPC_POSITION_BITS));
}

static inline nmpc_real_t nmpc_error_change(nmpc_real_t displacement_m_step)
{
    return displacement_m_step >> (NMPC_ACCELERATION_BITS - NMPC_ERROR_BITS);
}

/* Rounded down as well. */
static inline nmpc_real_t nmpc_distance_gradient(nmpc_real_t gain_x_m_step2_rad, nmpc_real_t subgradient_x,
                                                 nmpc_real_t gain_y_m_step2_rad, nmpc_real_t subgradient_y)
{
    return (nmpc_real_t)((((nmpc_sum_t)gain_x_m_step2_rad * subgradient_x)
                          + ((nmpc_sum_t)gain_y_m_step2_rad * subgradient_y))
                         >> (NMPC_GAIN_BITS + NMPC_RESPONSE_BITS - NMPC_DISTANCE_GRADIENT_BITS));
}

static inline nmpc_sum_t nmpc_tracking_cost(nmpc_real_t weight, nmpc_sum_t distance_m)
{
    return weight * distance_m;
}

static inline nmpc_sum_t nmpc_effort_cost(nmpc_real_t weight, nmpc_sum_t variation_rad)
{
    return NMPC_ROUNDED(weight * variation_rad, NMPC_EFFORT_BITS + NMPC_ANGLE_BITS - NMPC_COST_BITS);
}

static inline nmpc_sum_t nmpc_tracking_gradient(nmpc_real_t weight, nmpc_real_t distance_gradient_m_rad)
{
    return (nmpc_sum_t)weight * distance_gradient_m_rad;
}

static inline nmpc_sum_t nmpc_effort_gradient(nmpc_real_t weight)
{
    return weight * ((nmpc_sum_t)1 << (NMPC_GRADIENT_BITS - NMPC_EFFORT_BITS));
}

/* The step size is shifted left first too, and the product is rounded down. */
static inline nmpc_real_t nmpc_step_product(nmpc_real_t step_rad, nmpc_real_t factor)
{
    return (nmpc_real_t)(((nmpc_sum_t)factor
                          * (nmpc_real_t)(step_rad * ((nmpc_real_t)1 << (32 - NMPC_FACTOR_BITS))))
                         >> 32);
}

/* Sine and cosine for |angle_rad| <= NMPC_YAW_RANGE_RAD, with absolute errors of at most 2e-09. */
void nmpc_sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine);

#ifdef __cplusplus
}
#endif

#endif
