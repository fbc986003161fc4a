/* ---- Numbers --------------------------------------------------------------------------------------------------------
 *
 * Comparisons, limits and, in fixed point, products with the same bits on every board.
 */

#if WITH_FIXED
/* 1 if `minimum` <= `value` <= `maximum`, else 0; 0 for NaN. Each comparison has a variable of its own, so that a
 * proof by abstract interpretation can conclude that NaN is excluded. */
NMPC_INLINE int between(nmpc_real_t value, nmpc_real_t minimum, nmpc_real_t maximum)
{
    const int is_at_least = (value >= minimum);
    const int is_at_most = (value <= maximum);

    return (is_at_least != 0) && (is_at_most != 0);
}

/* 1 if |`value`| <= `limit`, else 0; 0 for NaN. */
NMPC_INLINE int within(nmpc_real_t value, nmpc_real_t limit)
{
    return between(value, -limit, limit);
}
#if not WITH_QUADRATIC

/* 1 if |`value`| >= `limit`, else 0. */
NMPC_INLINE int reaches(nmpc_real_t value, nmpc_real_t limit)
{
    return (value >= limit) || (value <= -limit);
}
#endif
#else
/* The bits of a value; the most significant one is its sign. Without an FPU, reading bits takes far fewer
 * instructions than a comparison. */
#if WITH_DOUBLE
typedef unsigned long long nmpc_bits_t;
#else
#if defined(__SIZEOF_INT__) && (__SIZEOF_INT__ < 4)
typedef unsigned long nmpc_bits_t;
#else
typedef unsigned int nmpc_bits_t;
#endif
#endif

typedef char nmpc_assert_bits_have_the_size_of_a_scalar[(sizeof(nmpc_bits_t) == sizeof(nmpc_real_t)) ? 1 : -1];

NMPC_INLINE nmpc_bits_t bits_of(nmpc_real_t value)
{
    union {
        nmpc_real_t real;
        nmpc_bits_t bits;
    } view;

    view.real = value;
    return view.bits;
}

#if defined(__GNUC__)
/* The bits of a magnitude are ordered as the magnitudes are, and a NaN's exceed them all. One comparison of whole
 * numbers takes the place of two of floats; the shift lets a Cortex-M drop the sign in the comparison itself. */
#if WITH_DOUBLE
#define NMPC_MAGNITUDE_BITS(value) ((bits_of(value) & 0x7FFFFFFFFFFFFFFFULL) << 1)
#else
#define NMPC_MAGNITUDE_BITS(value) ((bits_of(value) & 0x7FFFFFFFUL) << 1)
#endif
#if WITH_LIMITS or not WITH_HEIGHT

/* 1 if `minimum` <= `value` <= `maximum`, else 0; 0 for NaN. `minimum` must be positive, `maximum` not negative. */
NMPC_INLINE int between(nmpc_real_t value, nmpc_real_t minimum, nmpc_real_t maximum)
{
    return (bits_of(value) >= bits_of(minimum)) && (bits_of(value) <= bits_of(maximum));
}
#endif

/* 1 if |`value`| <= `limit`, else 0; 0 for NaN. */
NMPC_INLINE int within(nmpc_real_t value, nmpc_real_t limit)
{
    return NMPC_MAGNITUDE_BITS(value) <= NMPC_MAGNITUDE_BITS(limit);
}
#if not WITH_QUADRATIC

/* 1 if |`value`| >= `limit`, else 0. */
NMPC_INLINE int reaches(nmpc_real_t value, nmpc_real_t limit)
{
    return NMPC_MAGNITUDE_BITS(value) >= NMPC_MAGNITUDE_BITS(limit);
}
#endif
#else
/* 1 if `minimum` <= `value` <= `maximum`, else 0; 0 for NaN. Each comparison has a variable of its own, so that a
 * proof by abstract interpretation can conclude that NaN is excluded. */
NMPC_INLINE int between(nmpc_real_t value, nmpc_real_t minimum, nmpc_real_t maximum)
{
    const int is_at_least = (value >= minimum);
    const int is_at_most = (value <= maximum);

    return (is_at_least != 0) && (is_at_most != 0);
}

/* 1 if |`value`| <= `limit`, else 0; 0 for NaN. */
NMPC_INLINE int within(nmpc_real_t value, nmpc_real_t limit)
{
    return between(value, -limit, limit);
}
#if not WITH_QUADRATIC

/* 1 if |`value`| >= `limit`, else 0. */
NMPC_INLINE int reaches(nmpc_real_t value, nmpc_real_t limit)
{
    return (value >= limit) || (value <= -limit);
}
#endif
#endif
#endif

/* Clamp `value` at +/- `limit`. */
NMPC_INLINE nmpc_real_t clamp(nmpc_real_t value, nmpc_real_t limit)
{
#if WITH_FIXED
    return (value > limit) ? limit : ((value < -limit) ? -limit : value);
#else
    nmpc_real_t clamped = value;

    if (within(value, limit) == 0) {
        clamped = (value < (nmpc_real_t)0) ? -limit : limit;
    }
    return clamped;
#endif
}
#if WITH_CONFINE

/* Clamp `value` at `low` and `high`. */
NMPC_COMPARISON nmpc_real_t confine(nmpc_real_t value, nmpc_real_t low, nmpc_real_t high)
{
    const nmpc_real_t limited = (value > high) ? high : value;

    return (limited < low) ? low : limited;
}
#endif
#if WITH_HEIGHT

/* clamp() in one copy. */
NMPC_SHARED nmpc_real_t shared_clamp(nmpc_real_t value, nmpc_real_t limit)
{
    return clamp(value, limit);
}
#endif
#if WITH_FIXED

/* Shift a sum right by `bits`, rounded to nearest, ties up. */
#define NMPC_ROUNDED(sum, bits) (((sum) + ((nmpc_sum_t)1 << ((bits)-1))) >> (bits))
#endif
