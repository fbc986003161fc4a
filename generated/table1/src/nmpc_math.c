/* SPDX-License-Identifier: MIT-0
 *
 * Sine and cosine: reduction by multiples of pi/2 (Cody and Waite), then Taylor series. The C libraries of
 * different boards differ in the last bit; these functions have the same bits on every board.
 * MISRA C:2012: departs from rule 8.9, for the reason in deviations.txt.
 */
#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#define NMPC_SINE_TERMS 4
#define NMPC_COSINE_TERMS 5

/* 2/pi, and pi/2 as the sum of three parts; the first two have so few bits that quadrant * part is exact. */
static const nmpc_real_t quarter_turns_per_rad = 0.63661975f;
static const nmpc_real_t quarter_turn_rad[3] = {
    1.5707397f, 5.657971e-05f, 9.920936e-10f
};

/* sin r = r + r^3 * (-1/3! + r^2/5! - ...), cos r = 1 + r^2 * (-1/2! + r^2/4! - ...), for |r| <= pi/4 apart
 * from rounding. */
static const nmpc_real_t sine_terms[NMPC_SINE_TERMS] = {
    -0.16666667f, 0.008333334f, -0.0001984127f, 2.7557319e-06f
};
static const nmpc_real_t cosine_terms[NMPC_COSINE_TERMS] = {
    -0.5f, 0.041666668f, -0.0013888889f, 2.4801588e-05f, -2.755732e-07f
};

void nmpc_sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine)
{
    const nmpc_real_t half = 0.5f;
    const nmpc_real_t quarter_turns = angle_rad * quarter_turns_per_rad;
    const int quadrant = (int)(quarter_turns + ((quarter_turns < (nmpc_real_t)0) ? -half : half));
    const nmpc_real_t count = (nmpc_real_t)quadrant;
    const nmpc_real_t rest = ((angle_rad - (count * quarter_turn_rad[0])) - (count * quarter_turn_rad[1]))
                             - (count * quarter_turn_rad[2]);
    const nmpc_real_t one = (nmpc_real_t)1;
    const nmpc_real_t square = rest * rest;
    nmpc_real_t sine_rest = sine_terms[NMPC_SINE_TERMS - 1];
    nmpc_real_t cosine_rest = cosine_terms[NMPC_COSINE_TERMS - 1];
    int k;

    for (k = NMPC_SINE_TERMS - 2; k >= 0; k--) {
        sine_rest = sine_terms[k] + (square * sine_rest);
    }
    for (k = NMPC_COSINE_TERMS - 2; k >= 0; k--) {
        cosine_rest = cosine_terms[k] + (square * cosine_rest);
    }
    sine_rest = rest + (rest * (square * sine_rest));
    cosine_rest = one + (square * cosine_rest);

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
