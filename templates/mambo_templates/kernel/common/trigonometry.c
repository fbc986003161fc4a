/* ---- Trigonometry ---------------------------------------------------------------------------------------------------
 *
 * The angle less whole quarter turns, r, which floats take off in two parts (Cody and Waite), and for |r| <= pi/4 apart
 * from rounding the Taylor series in float64, and else the polynomials of the smallest largest error,
 *
 *     sin r = r + r^3 (s0 + s1 r^2 + ...),   cos r = 1 + r^2 (c0 + c1 r^2 + ...).
 *
 * The C libraries of different boards differ in the last bit; this function has the same bits on every board.
 */

#include "trigonometry.h"

/* Sine and cosine for |angle_rad| <= NMPC_YAW_RANGE_RAD. */
NMPC_INLINE void sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine)
{
#if WITH_FIXED
    const nmpc_real_t count =
        (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)angle_rad * NMPC_QUARTER_TURNS_PER_RAD, 31 + NMPC_YAW_BITS);
    const nmpc_sum_t fine_rad =
        (angle_rad * ((nmpc_sum_t)1 << (NMPC_FINE_BITS - NMPC_YAW_BITS))) - (count * NMPC_QUARTER_TURN_RAD);
    const nmpc_real_t rest = (nmpc_real_t)NMPC_ROUNDED(fine_rad, NMPC_FINE_BITS - NMPC_SINE_BITS);
    const unsigned int quadrant = (unsigned int)count & 3U;
    const nmpc_real_t one = (nmpc_real_t)1 << NMPC_SINE_BITS;
#else
    const nmpc_real_t sum = (angle_rad * NMPC_QUARTER_TURNS_PER_RAD) + NMPC_ROUNDING;
    const nmpc_real_t count = sum - NMPC_ROUNDING;
    const nmpc_real_t rest = (angle_rad - (count * NMPC_QUARTER_TURN_RAD)) - (count * NMPC_QUARTER_TURN_REST_RAD);
    const nmpc_bits_t quadrant = bits_of(sum);
    const nmpc_real_t one = (nmpc_real_t)1;
#endif
    const nmpc_real_t square = sine_product(rest, rest);
    nmpc_real_t sine_rest = sine_terms[NMPC_SINE_TERMS - 1];
    nmpc_real_t cosine_rest = cosine_terms[NMPC_COSINE_TERMS - 1];
    int k;

    NMPC_UNROLL
    for (k = NMPC_SINE_TERMS - 2; k >= 0; k--) {
        sine_rest = sine_terms[k] + sine_product(square, sine_rest);
    }
    NMPC_UNROLL
    for (k = NMPC_COSINE_TERMS - 2; k >= 0; k--) {
        cosine_rest = cosine_terms[k] + sine_product(square, cosine_rest);
    }
    sine_rest = rest + sine_product(rest, sine_product(square, sine_rest));
    cosine_rest = one + sine_product(square, cosine_rest);

    /* The two lowest bits of the quarter turns say which of them is which, and their signs. */
    *sine = ((quadrant & 1U) == 0U) ? sine_rest : cosine_rest;
    *cosine = ((quadrant & 1U) == 0U) ? cosine_rest : sine_rest;
    if ((quadrant & 2U) != 0U) {
        *sine = -*sine;
    }
    if (((quadrant + 1U) & 2U) != 0U) {
        *cosine = -*cosine;
    }
}
#if WITH_QUADRATIC or WITH_TRACKER

/* Turn a vector along x and y by the angle of which sine and cosine are given; or one along right and forward, which
 * stays in the world, when the heading turns by that angle. */
NMPC_INLINE void turn_vector(nmpc_real_t vector[2], nmpc_real_t sine, nmpc_real_t cosine)
{
    const nmpc_real_t first = vector[0];
    const nmpc_real_t second = vector[1];

    vector[0] = sine_product(first, cosine) - sine_product(second, sine);
    vector[1] = sine_product(second, cosine) + sine_product(first, sine);
}
#endif
