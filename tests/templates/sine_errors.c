/* SPDX-License-Identifier: MIT-0
 *
 * Prints the largest absolute errors of sine and cosine against the C library's functions of double: for every float
 * from 2^-13 rad to 1024 rad, and every 4099th below; in fixed point for every 101st angle to 1024 rad. */
#include <math.h>
#include <stdio.h>

#include "nmpc.c"

static double largest[2] = { 0.0, 0.0 };

static void compare(double angle_rad, double sine, double cosine)
{
    const double errors[2] = { fabs(sine - sin(angle_rad)), fabs(cosine - cos(angle_rad)) };
    int which;

    for (which = 0; which < 2; which++) {
        largest[which] = (errors[which] > largest[which]) ? errors[which] : largest[which];
    }
}

#ifdef NMPC_SINE_BITS
static void compare_all(void)
{
    const double unit = ldexp(1.0, -NMPC_SINE_BITS);
    long long angle;

    for (angle = -NMPC_YAW_RANGE_RAD; angle <= NMPC_YAW_RANGE_RAD; angle += 101) {
        nmpc_real_t sine;
        nmpc_real_t cosine;

        sine_cosine((nmpc_real_t)angle, &sine, &cosine);
        compare(ldexp((double)angle, -NMPC_YAW_BITS), unit * sine, unit * cosine);
    }
}
#else
static float real_of(nmpc_bits_t bits)
{
    union {
        nmpc_bits_t bits;
        float real;
    } view;

    view.bits = bits;
    return view.real;
}

static void compare_all(void)
{
    const nmpc_bits_t first = bits_of(0x1p-13f);
    const nmpc_bits_t last = bits_of(NMPC_YAW_RANGE_RAD);
    nmpc_bits_t bits;

    for (bits = 0U; bits <= last; bits += (bits < first) ? 4099U : 1U) {
        float sine;
        float cosine;

        sine_cosine(real_of(bits), &sine, &cosine);
        compare((double)real_of(bits), (double)sine, (double)cosine);
    }
}
#endif

int main(void)
{
    compare_all();
    printf("%.9e %.9e\n", largest[0], largest[1]);
    return 0;
}
