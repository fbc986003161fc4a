/* ---- Thrust vector --------------------------------------------------------------------------------------------------
 *
 * The direction of the thrust at roll phi and pitch theta (not in the paper). Of a thrust, over its vertical component,
 *
 *     right = sin phi / c,   forward = -sin theta cos phi / c,   with c = cos phi cos theta,
 *
 * are the horizontal components along the axes of the heading, the slopes. c is at least NMPC_LEAST_SHARE: a steeper
 * tilt counts as if it were. And back, for the slopes that the next command asks for:
 *
 *     theta = -arctan forward,   phi = arctan(right cos theta).
 *
 * The arc tangent is a polynomial up to 1, x (c0 + c1 x^2 + ...), whose largest error is the smallest that so many
 * terms allow; beyond 1 it is pi/2 less that of 1/x. 1/x takes products alone, a line and Newton's steps.
 */

#include "thrust_vector.h"

/* Set `slope`, right and forward, of a thrust at an attitude; returns c. */
NMPC_SHARED nmpc_real_t vector_point(nmpc_real_t roll_rad, nmpc_real_t pitch_rad, nmpc_real_t slope[2])
{
    nmpc_real_t sine[2];
    nmpc_real_t cosine[2];
    nmpc_real_t share;
    nmpc_real_t inverse;

    sine_cosine(angle_to_yaw(roll_rad), &sine[0], &cosine[0]);
    sine_cosine(angle_to_yaw(pitch_rad), &sine[1], &cosine[1]);
    share = to_factor(confine(sine_product(cosine[0], cosine[1]), NMPC_LEAST_SHARE, NMPC_ONE));
    inverse = share_inverse(share);
    slope[0] = sine_product(inverse, sine[0]);
    slope[1] = -sine_product(inverse, sine_product(sine[1], cosine[0]));
    return share;
}

/* The same at the attitude that a command leads to. */
NMPC_INLINE nmpc_real_t vector_point_command(nmpc_real_t roll_rad, nmpc_real_t pitch_rad, nmpc_real_t slope[2])
{
#if WITH_ROLL_TRIM
    const nmpc_real_t tilted_rad = factor_product(roll_rad - NMPC_ROLL_TRIM_COMMAND_RAD, NMPC_ROLL_GAIN);
#else
    const nmpc_real_t tilted_rad = factor_product(roll_rad, NMPC_ROLL_GAIN);
#endif
#if WITH_PITCH_TRIM
    const nmpc_real_t pitched_rad = factor_product(pitch_rad - NMPC_PITCH_TRIM_COMMAND_RAD, NMPC_PITCH_GAIN);
#else
    const nmpc_real_t pitched_rad = factor_product(pitch_rad, NMPC_PITCH_GAIN);
#endif

    return vector_point(tilted_rad, pitched_rad, slope);
}

/* The largest slopes of tilts, right and forward, for commands of roll and pitch without trim. */
static void vector_largest(nmpc_real_t roll_rad, nmpc_real_t pitch_rad, nmpc_real_t slope[2])
{
    nmpc_real_t other[2];

    (void)vector_point((nmpc_real_t)0, -factor_product(pitch_rad, NMPC_PITCH_GAIN), slope);
    (void)vector_point(factor_product(roll_rad, NMPC_ROLL_GAIN), (nmpc_real_t)0, other);
    slope[0] = other[0];
}

/* The angle of a slope. */
NMPC_SHARED nmpc_real_t arc_tangent(nmpc_real_t slope)
{
    const nmpc_real_t size = (slope < (nmpc_real_t)0) ? -slope : slope;
    const int is_steep = size > NMPC_ONE_FACTOR;
    const nmpc_real_t x = factor_to_sine(clamp((is_steep != 0) ? steep_inverse(size) : size, NMPC_ONE_FACTOR));
    const nmpc_real_t square = sine_product(x, x);
    nmpc_real_t angle_rad = arc_terms[NMPC_ARC_TERMS - 1];
    int k;

    NMPC_UNROLL
    for (k = NMPC_ARC_TERMS - 2; k >= 0; k--) {
        angle_rad = arc_terms[k] + sine_product(square, angle_rad);
    }
    angle_rad = sine_product(x, angle_rad);
    if (is_steep != 0) {
        angle_rad = NMPC_QUARTER_TURN - angle_rad;
    }
    return sine_to_angle((slope < (nmpc_real_t)0) ? -angle_rad : angle_rad);
}

/* The slope of an acceleration with the thrust of hover. */
NMPC_INLINE nmpc_real_t vector_slope(nmpc_real_t acceleration_m_step2)
{
#if WITH_FIXED
    const nmpc_sum_t slope =
        NMPC_ROUNDED(wide_product(NMPC_SLOPE_PER_ACCELERATION, acceleration_m_step2), NMPC_SLOPE_SHIFT);

    return (nmpc_real_t)((slope > NMPC_MOST_SLOPE) ? NMPC_MOST_SLOPE
                                                   : ((slope < -NMPC_MOST_SLOPE) ? -NMPC_MOST_SLOPE : slope));
#else
    return clamp(NMPC_SLOPE_PER_ACCELERATION * acceleration_m_step2, NMPC_MOST_SLOPE);
#endif
}

/* Set the commands that stand for accelerations, right and forward, over their weight. */
NMPC_SHARED void vector_command(nmpc_real_t right_m_step2, nmpc_real_t forward_m_step2, nmpc_real_t command_rad[2])
{
    const nmpc_real_t pitch_rad = -arc_tangent(vector_slope(forward_m_step2));
    const nmpc_real_t right = vector_slope(right_m_step2);
    nmpc_real_t sine;
    nmpc_real_t cosine;
    nmpc_real_t roll_rad;

    sine_cosine(angle_to_yaw(pitch_rad), &sine, &cosine);
    (void)sine;
    roll_rad = arc_tangent(sine_product(right, cosine));
#if WITH_ROLL_TRIM
    command_rad[0] = factor_product(roll_rad, NMPC_PER_ROLL_GAIN) + NMPC_ROLL_TRIM_COMMAND_RAD;
#else
    command_rad[0] = factor_product(roll_rad, NMPC_PER_ROLL_GAIN);
#endif
#if WITH_PITCH_TRIM
    command_rad[1] = factor_product(pitch_rad, NMPC_PER_PITCH_GAIN) + NMPC_PITCH_TRIM_COMMAND_RAD;
#else
    command_rad[1] = factor_product(pitch_rad, NMPC_PER_PITCH_GAIN);
#endif
}
