/* SPDX-License-Identifier: MIT-0
 *
 * Sine and cosine: reduction by multiples of pi/2, then Taylor series, in fixed point.
 * MISRA C:2012: departs from rules 8.9 and 10.1, for the reasons in deviations.txt.
 */
#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#define NMPC_SINE_TERMS 5
#define NMPC_COSINE_TERMS 5

/* 2/pi with 31 fractional bits, pi/2 with 40. */
static const nmpc_real_t quarter_turns_per_rad = 1367130551;
static const nmpc_sum_t quarter_turn_rad = 1727108826179LL;

/* sin r = r + r^3 * (-1/3! + r^2/5! - ...), cos r = 1 + r^2 * (-1/2! + r^2/4! - ...), for |r| <= pi/4 apart
 * from rounding. */
static const nmpc_real_t sine_terms[NMPC_SINE_TERMS] = {
    -178956971, 8947849, -213044, 2959, -27
};
static const nmpc_real_t cosine_terms[NMPC_COSINE_TERMS] = {
    -536870912, 44739243, -1491308, 26631, -296
};

void nmpc_sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine)
{
    const nmpc_real_t quadrant =
        (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)angle_rad * quarter_turns_per_rad, 31 + NMPC_YAW_BITS);
    const nmpc_sum_t fine_rad = (angle_rad * ((nmpc_sum_t)1 << (40 - NMPC_YAW_BITS)))
                                - (quadrant * quarter_turn_rad);
    const nmpc_real_t rest = (nmpc_real_t)NMPC_ROUNDED(fine_rad, 40 - NMPC_SINE_BITS);
    const nmpc_real_t one = (nmpc_real_t)1 << NMPC_SINE_BITS;
    const nmpc_real_t square = nmpc_sine_product(rest, rest);
    nmpc_real_t sine_rest = sine_terms[NMPC_SINE_TERMS - 1];
    nmpc_real_t cosine_rest = cosine_terms[NMPC_COSINE_TERMS - 1];
    int k;

    for (k = NMPC_SINE_TERMS - 2; k >= 0; k--) {
        sine_rest = sine_terms[k] + nmpc_sine_product(square, sine_rest);
    }
    for (k = NMPC_COSINE_TERMS - 2; k >= 0; k--) {
        cosine_rest = cosine_terms[k] + nmpc_sine_product(square, cosine_rest);
    }
    sine_rest = rest + nmpc_sine_product(rest, nmpc_sine_product(square, sine_rest));
    cosine_rest = one + nmpc_sine_product(square, cosine_rest);

    switch ((unsigned int)quadrant % 4U) {
    case 0U:
        *sine = sine_rest;
        *cosine = cosine_rest;
        break;
    case 1U:
        *sine = cosine_rest;
        *cosine = -sine_rest;
        break;
    case 2U:
        *sine = -sine_rest;
        *cosine = -cosine_rest;
        break;
    default:
        *sine = -cosine_rest;
        *cosine = sine_rest;
        break;
    }
}
