/* ---- Limits arithmetic ----------------------------------------------------------------------------------------------
 *
 * Roots and products of the limits. An inverse square root takes products alone: Newton's y (3 - x y^2)/2, from a start
 * that a shift of the bits gives.
 */

#include "limits_arithmetic.h"

#if WITH_QUADRATIC
NMPC_COMPARISON nmpc_real_t absolute(nmpc_real_t value)
{
#if WITH_FIXED
    return (value < (nmpc_real_t)0) ? -value : value;
#else
#if defined(__GNUC__)
#if WITH_DOUBLE
    return __builtin_fabs(value);
#else
    return __builtin_fabsf(value);
#endif
#else
    return (value < (nmpc_real_t)0) ? -value : value;
#endif
#endif
}

NMPC_COMPARISON nmpc_real_t smaller(nmpc_real_t a, nmpc_real_t b)
{
    return (a < b) ? a : b;
}

NMPC_COMPARISON nmpc_real_t larger(nmpc_real_t a, nmpc_real_t b)
{
    return (a > b) ? a : b;
}

#endif
#if WITH_FIXED
typedef unsigned long long nmpc_square_t;
#if defined(__SIZEOF_INT__) && (__SIZEOF_INT__ < 4)
typedef unsigned long nmpc_mantissa_t;
#else
typedef unsigned int nmpc_mantissa_t;
#endif

/* 1/sqrt(x) = mantissa / 2^(30 + half); `scaled` is x, shifted into 2^30..2^32. */
typedef struct {
    nmpc_mantissa_t mantissa;
    nmpc_mantissa_t scaled;
    unsigned int half;
} nmpc_root_t;

static nmpc_mantissa_t upper_product(nmpc_mantissa_t a, nmpc_mantissa_t b)
{
    return (nmpc_mantissa_t)(((nmpc_square_t)a * b) >> 32);
}

/* 1/sqrt(x) for a positive x. */
NMPC_SHARED nmpc_root_t inverse_root(nmpc_square_t x)
{
    nmpc_square_t wide = x;
    nmpc_mantissa_t scaled;
    nmpc_mantissa_t mantissa;
    nmpc_root_t root;
    unsigned int half = 32U;
    int k;

    if (wide < ((nmpc_square_t)1 << 32)) {
        wide = wide << 32;
        half -= 16U;
    }
    if (wide < ((nmpc_square_t)1 << 48)) {
        wide = wide << 16;
        half -= 8U;
    }
    if (wide < ((nmpc_square_t)1 << 56)) {
        wide = wide << 8;
        half -= 4U;
    }
    scaled = (nmpc_mantissa_t)(wide >> 32);
    if (scaled < ((nmpc_mantissa_t)1 << 28)) {
        scaled = scaled << 4;
        half -= 2U;
    }
    if (scaled < ((nmpc_mantissa_t)1 << 30)) {
        scaled = scaled << 2;
        half -= 1U;
    }
    mantissa = NMPC_ROOT_START - upper_product(NMPC_ROOT_SLOPE - upper_product(NMPC_ROOT_CURVE, scaled), scaled);
    for (k = 0; k < NMPC_ROOT_ITERATIONS; k++) {
        const nmpc_mantissa_t product = upper_product(upper_product(mantissa, mantissa), scaled);

        mantissa = upper_product(mantissa, ((nmpc_mantissa_t)3 << 28) - product) << 3;
    }
    root.mantissa = mantissa;
    root.scaled = scaled;
    root.half = half;
    return root;
}

static nmpc_square_t squared(nmpc_real_t value)
{
    const nmpc_sum_t product = (nmpc_sum_t)value * value;

    return (nmpc_square_t)product;
}

static nmpc_square_t square_sum(nmpc_real_t a, nmpc_real_t b)
{
    return squared(a) + squared(b);
}

/* The product of two numbers that are not negative. */
static nmpc_square_t size_product(nmpc_real_t a, nmpc_mantissa_t b)
{
    return (nmpc_square_t)(nmpc_mantissa_t)a * b;
}

/* sqrt(x), given 1/sqrt(x). */
static nmpc_square_t length(nmpc_root_t root)
{
    return ((nmpc_square_t)root.scaled * root.mantissa) >> (62U - root.half);
}

/* The smaller of a number and a limit. */
static nmpc_real_t at_most(nmpc_square_t value, nmpc_real_t limit)
{
    return (value < (nmpc_square_t)limit) ? (nmpc_real_t)value : limit;
}

/* Speed over distance, and a length over a length, at most 1, given 1/sqrt of the square of the second. */
static nmpc_real_t approach_ratio(nmpc_real_t speed_m_s, nmpc_root_t root)
{
    return at_most((size_product(speed_m_s, root.mantissa) >> root.half) >> NMPC_RATIO_SHIFT, NMPC_STEEPEST_1_S);
}

static nmpc_real_t length_ratio(nmpc_real_t part, nmpc_root_t root)
{
    return at_most(size_product(part, root.mantissa) >> root.half, (nmpc_real_t)1 << NMPC_SINE_BITS);
}

/* Ratio times distance, m/s, within the range of velocities. */
NMPC_SHARED nmpc_real_t approach_product(nmpc_real_t ratio_1_s, nmpc_real_t distance_m)
{
    const nmpc_sum_t speed_m_s = NMPC_ROUNDED((nmpc_sum_t)ratio_1_s * distance_m, NMPC_APPROACH_SHIFT);

    return (speed_m_s > NMPC_VELOCITY_RANGE_M_S)
               ? NMPC_VELOCITY_RANGE_M_S
               : ((speed_m_s < -NMPC_VELOCITY_RANGE_M_S) ? -NMPC_VELOCITY_RANGE_M_S : (nmpc_real_t)speed_m_s);
}

static nmpc_real_t halved(nmpc_real_t value)
{
    return value >> 1;
}

static nmpc_real_t knee_product(nmpc_real_t knee_s2, nmpc_real_t braking_m_s2)
{
    return (nmpc_real_t)(((nmpc_sum_t)knee_s2 * braking_m_s2) >> NMPC_KNEE_SHIFT);
}

/* The square of a speed, from twice the braking and a distance. */
static nmpc_square_t braking_product(nmpc_real_t braking_m_s2, nmpc_real_t distance_m)
{
    return size_product(braking_m_s2, (nmpc_mantissa_t)distance_m) << NMPC_SQUARE_SHIFT;
}

/* The root of such a square, within the range of velocities. */
static nmpc_real_t braking_speed(nmpc_square_t square)
{
    return at_most((length(inverse_root(square)) << NMPC_ROOT_UP) >> NMPC_ROOT_DOWN, NMPC_VELOCITY_RANGE_M_S);
}

static nmpc_real_t share_product(nmpc_real_t value, nmpc_real_t share)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)value * share, NMPC_SINE_BITS);
}
#else
typedef nmpc_real_t nmpc_square_t;
typedef nmpc_real_t nmpc_root_t;

NMPC_INLINE nmpc_square_t square_sum(nmpc_real_t a, nmpc_real_t b)
{
    return (a * a) + (b * b);
}

/* 1/sqrt(x) for a positive x. */
NMPC_SHARED nmpc_root_t inverse_root(nmpc_square_t x)
{
    const nmpc_real_t half = NMPC_HALF * x;
    nmpc_real_t root;
    union {
        nmpc_real_t real;
        nmpc_bits_t bits;
    } view;

    view.real = x;
    view.bits = (nmpc_bits_t)NMPC_ROOT_START - (view.bits >> 1);
    root = view.real;
    root = root * (NMPC_ROOT_TERM_1 - ((half * root) * root));
    root = root * (NMPC_ROOT_TERM_2 - ((half * root) * root));
#if WITH_DOUBLE
    root = root * (NMPC_ROOT_TERM_3 - ((half * root) * root));
#endif
    return root;
}

/* A speed, from its square. */
static nmpc_real_t braking_speed(nmpc_square_t square)
{
    return square * inverse_root(square);
}
#endif
