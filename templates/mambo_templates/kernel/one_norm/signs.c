/* ---- Signs ----------------------------------------------------------------------------------------------------------
 *
 * RPROP and the 1-norm read signs; without an FPU, reading the sign's bit takes far fewer instructions than a
 * comparison.
 */

/* -1, 0 or 1; 0 for +0 and -0. */
NMPC_INLINE int sign_of(nmpc_sum_t value)
{
    return (value > (nmpc_sum_t)0) ? 1 : ((value < (nmpc_sum_t)0) ? -1 : 0);
}

#if WITH_FIXED
#if defined(__SIZEOF_INT__) && (__SIZEOF_INT__ < 4)
typedef unsigned long nmpc_bits_t;
#else
typedef unsigned int nmpc_bits_t;
#endif

/* The bits of a value; the most significant one is its sign. */
NMPC_INLINE nmpc_bits_t bits_of(nmpc_real_t value)
{
    return (nmpc_bits_t)value;
}

#endif
/* One bit per prediction step, the last step in bit 0. Steps count from 0 to NMPC_LAST_STEP, in the paper from 1 to
 * N_p: step i has bit NMPC_LAST_STEP - i. More than 32 steps take an unsigned long long. */
#if WITH_LONG_HORIZON
typedef unsigned long long nmpc_steps_t;
#else
typedef unsigned long nmpc_steps_t;
#endif
#define NMPC_LAST_STEP ((unsigned int)NMPC_HORIZON_PREDICTION - 1U)

typedef char nmpc_assert_every_step_has_a_bit[((8U * sizeof(nmpc_steps_t)) > NMPC_LAST_STEP) ? 1 : -1];

/* The sign bit: 1 for negative values, and with floats for -0; else 0. */
NMPC_INLINE nmpc_steps_t is_negative(nmpc_real_t value)
{
#if WITH_DOUBLE
    const nmpc_bits_t sign = bits_of(value) >> 63U;
#else
    const nmpc_bits_t sign = bits_of(value) >> 31U;
#endif

    return (nmpc_steps_t)sign;
}

#if WITH_LATER_STEPS and WITH_LONG_HORIZON
/* Index of the least significant set bit; `word` must not be 0. A loop on AVR: the stack of libgcc's function has no
 * known bound. */
#if defined(__GNUC__) && !defined(__AVR__)
#define NMPC_TRAILING_ZEROS(word) __builtin_ctzll(word)
#endif
#elif WITH_LATER_STEPS
/* Index of the least significant set bit; `word` must not be 0. */
#if defined(__GNUC__)
#define NMPC_TRAILING_ZEROS(word) __builtin_ctzl(word)
#endif
#endif
#if WITH_LATER_STEPS
NMPC_INLINE unsigned int lowest_set_bit(nmpc_steps_t word)
{
#if defined(NMPC_TRAILING_ZEROS)
    return (unsigned int)NMPC_TRAILING_ZEROS(word);
#else
    unsigned int index;

    for (index = 0U; ((index + 1U) < NMPC_LAST_STEP) && (((word >> index) & 1U) == 0U); index++) {
        /* Test the next bit. */
    }
    return index;
#endif
}

#endif
NMPC_INLINE nmpc_real_t absolute(nmpc_real_t value)
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

NMPC_INLINE nmpc_sum_t absolute_sum(nmpc_sum_t value)
{
#if WITH_FIXED
    return (value < (nmpc_sum_t)0) ? -value : value;
#else
    return absolute(value);
#endif
}

NMPC_INLINE nmpc_real_t smaller(nmpc_real_t a, nmpc_real_t b)
{
    return (a < b) ? a : b;
}

NMPC_INLINE nmpc_real_t larger(nmpc_real_t a, nmpc_real_t b)
{
    return (a > b) ? a : b;
}
