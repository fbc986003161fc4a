/* SPDX-License-Identifier: MIT-0
 *
 * The few functions that the controller needs beyond + - *, the same bits everywhere.
 * MISRA C:2012: departs from rules 10.3 and 19.2, for the reasons in deviations.txt.
 */
#ifndef NMPC_MATH_H
#define NMPC_MATH_H

#include "nmpc_config.h"

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

/* Put before a loop over the moves to have it written out: on a Cortex-M4F that keeps their sums in registers
 * and saves a third of the instructions of a step. Other compilers judge for themselves. */
#if defined(__GNUC__) && !defined(__clang__) && (__GNUC__ >= 8)
#define NMPC_UNROLL _Pragma("GCC unroll 8")
#else
#define NMPC_UNROLL
#endif

static inline nmpc_real_t nmpc_absolute(nmpc_real_t value)
{
    return (value < (nmpc_real_t)0) ? -value : value;
}

/* The sign of zero, of either sign, is 0. */
static inline int nmpc_sign(nmpc_real_t value)
{
    return (value > (nmpc_real_t)0) ? 1 : ((value < (nmpc_real_t)0) ? -1 : 0);
}

/* The bits of a value; the highest is its sign. Where there is no FPU, reading that is much cheaper than a
 * comparison. */
#if defined(__SIZEOF_INT__) && (__SIZEOF_INT__ < 4)
typedef unsigned long nmpc_bits_t;
#else
typedef unsigned int nmpc_bits_t;
#endif
#define NMPC_SIGN_BIT ((nmpc_bits_t)1 << 31)

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

/* Sine and cosine for |angle_rad| <= NMPC_YAW_RANGE_RAD, each within 1.2e-07 of the true value. */
void nmpc_sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine);

#ifdef __cplusplus
}
#endif

#endif
