/* SPDX-License-Identifier: MIT-0
 *
 * Elementary functions with the same bits on every board.
 * MISRA C:2012: departs from rules 10.3 and 19.2, for the reasons in deviations.txt.
 */
#ifndef NMPC_MATH_H
#define NMPC_MATH_H

#include "nmpc_config.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* Compiler flags that would change the results. */
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && (__FINITE_MATH_ONLY__ > 0))
#error "build without -ffast-math: the input check needs NaN, and the results depend on the order of operations"
#endif
#if defined(__ASSOCIATIVE_MATH__)
#error "build without -fassociative-math: it changes the order of operations"
#endif
/* 0: float and double are evaluated with their own precision; 16: and so is _Float16, which is not used here;
 * 1: float as double; 2: both as long double, as the x87 of an x86 does. */
#if defined(__FLT_EVAL_METHOD__) && (__FLT_EVAL_METHOD__ != 0) && (__FLT_EVAL_METHOD__ != 16)
#if (__FLT_EVAL_METHOD__ == 2)
#error "arithmetic must keep the precision of its type: on x86 build with -msse2 -mfpmath=sse"
#else
#error "arithmetic must keep the precision of its type, FLT_EVAL_METHOD 0; or use code.scalar fixed"
#endif
#endif

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

/* The sign bit: 1 for negative values and -0, else 0. */
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
#if defined(__GNUC__)
    return __builtin_fabsf(value);
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

/* 1 if `minimum` <= `value` <= `maximum`, else 0; 0 for NaN. Each comparison has a variable of its own, so that a
 * proof by abstract interpretation can conclude that NaN is excluded. */
static inline int nmpc_between(nmpc_real_t value, nmpc_real_t minimum, nmpc_real_t maximum)
{
    const int is_at_least = (value >= minimum);
    const int is_at_most = (value <= maximum);

    return (is_at_least != 0) && (is_at_most != 0);
}

#if defined(__GNUC__)
/* The bits of a magnitude are ordered as the magnitudes are, and those of NaN exceed them all. One comparison of whole
 * numbers takes the place of two of floats. */
#define NMPC_MAGNITUDE_BITS ((nmpc_bits_t)0x7FFFFFFFUL)

/* 1 if |`value`| <= `limit`, else 0; 0 for NaN. */
static inline int nmpc_within(nmpc_real_t value, nmpc_real_t limit)
{
    return (nmpc_bits(value) & NMPC_MAGNITUDE_BITS) <= nmpc_bits(limit);
}

/* 1 if |`value`| >= `limit`, else 0. */
static inline int nmpc_reaches(nmpc_real_t value, nmpc_real_t limit)
{
    return (nmpc_bits(value) & NMPC_MAGNITUDE_BITS) >= nmpc_bits(limit);
}
#else
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
#endif

/* Saturate `value` at +/- `limit`. */
static inline nmpc_real_t nmpc_clamp(nmpc_real_t value, nmpc_real_t limit)
{
    nmpc_real_t clamped = value;

    if (nmpc_within(value, limit) == 0) {
        clamped = (value < (nmpc_real_t)0) ? -limit : limit;
    }
    return clamped;
}

/* Sine and cosine for |angle_rad| <= NMPC_YAW_RANGE_RAD, with absolute errors of at most 1.2e-07. */
void nmpc_sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine);

#ifdef __cplusplus
}
#endif

#endif
