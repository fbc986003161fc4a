/* ---- Height ---------------------------------------------------------------------------------------------------------
 *
 * The third axis, whose command is the thrust (not in the paper). Up is positive. With the measured roll and pitch, let
 *
 *     t = (g + u) / (kg c),   c = cos roll cos pitch, but at least a bound,
 *
 * be the thrust over mass, so that u is the vertical acceleration that it stands for. kg is a factor of the thrust that
 * the observer learns, or 1: weight, battery and propellers change it. Its vertical share su = c t is delayed by rotors
 * and dead time:
 *
 *     lag sa' = sc - sa,   delay sc' = su - sc,
 *
 * and a = kg sa - g is the acceleration that the thrust gives. The rows below are the exact solution: weighted means.
 *
 * Model, observer, tracker and cost are those of the other axes, without the integral part. The observer knows a from
 * the model alone: a measured acceleration would contain what it is to learn, kg or a disturbance d.
 *
 * Floor: while the drone touches it, the floor can only push up. So where a + d is not more than 0 the drone lies on
 * it, at rest, and nothing is learnt; else only what makes the drone heavier is.
 *
 * While the state is missing, the last command stands for roll and pitch.
 *
 * Coupling: the tilt of a climbing drone counts for more. Measured tilts count (g + a)/g times as much, commands for an
 * acceleration are divided by f = (g + u)/g, and the largest acceleration of the tilt limit is multiplied by f; both
 * factors are limited.
 */

/* 1/x takes products alone: y = A - B x, then Newton's y (2 - x y), whose error is the square of that before. In fixed
 * point y is limited, which changes nothing: it tells a proof by intervals how large it is. */
#include "height.h"

/* (g + acceleration)/g, by which a tilt counts for more than in hover. */
NMPC_SHARED nmpc_real_t height_weight(nmpc_real_t acceleration_m_step2)
{
    const nmpc_real_t limited_m_step2 =
        confine(acceleration_m_step2, NMPC_LEAST_WEIGHT_M_STEP2, NMPC_MOST_WEIGHT_M_STEP2);

    return NMPC_ONE_FACTOR + gravity_product(NMPC_PER_GRAVITY, limited_m_step2);
}

#if WITH_THRUST_VECTOR
/* c at the attitude of a command. */
NMPC_INLINE nmpc_real_t height_tilt(nmpc_real_t roll_rad, nmpc_real_t pitch_rad)
{
    nmpc_real_t slope[2];

    return vector_point_command(roll_rad, pitch_rad, slope);
}
#else
/* cos x, less than NMPC_LEAST_COSINE for steep angles. */
NMPC_INLINE nmpc_real_t height_cosine(nmpc_real_t angle_rad)
{
    const nmpc_real_t square = angle_square(angle_rad);
    const nmpc_real_t cosine =
        NMPC_ONE - sine_product(square, NMPC_COSINE_SECOND - sine_product(square, NMPC_COSINE_FOURTH));

#if WITH_FIXED
    /* The clamp changes nothing: it tells a proof by intervals how large the cosine is. */
    return clamp(cosine, NMPC_ONE);
#else
    return cosine;
#endif
}

/* c */
NMPC_SHARED nmpc_real_t height_tilt(nmpc_real_t roll_rad, nmpc_real_t pitch_rad)
{
    const nmpc_real_t cosine = sine_product(height_cosine(roll_rad), height_cosine(pitch_rad));

    return to_factor((cosine < NMPC_LEAST_COSINE) ? NMPC_LEAST_COSINE : cosine);
}
#endif

/* Let the model of the thrust answer the last command over one control step. */
NMPC_INLINE void height_advance(nmpc_height_t *height)
{
    const nmpc_real_t thrust = height->thrust_m_step2;
    const nmpc_real_t lagged = height->lagged_m_step2;
    const nmpc_real_t command = height->command_m_step2;

    height->thrust_m_step2 = attitude_sum((wide_product(thrust_row[0], thrust) + wide_product(thrust_row[1], lagged))
                                          + wide_product(thrust_row[2], command));
    height->lagged_m_step2 =
        attitude_sum(wide_product(thrust_lagged_row[0], lagged) + wide_product(thrust_lagged_row[1], command));
}

/* The vertical share of a thrust, s. */
NMPC_SHARED nmpc_real_t height_vertical(nmpc_real_t share, nmpc_real_t thrust_m_s2)
{
    return factor_product(step2_product(NMPC_STEP2_S2, thrust_m_s2), share);
}

/* The acceleration that such a share gives. */
NMPC_INLINE nmpc_real_t height_lift(const nmpc_height_t *height, nmpc_real_t vertical_m_step2)
{
#if WITH_THRUST_GAIN
    return factor_product(vertical_m_step2, height->gain) - NMPC_GRAVITY_M_STEP2;
#else
    (void)height;
    return vertical_m_step2 - NMPC_GRAVITY_M_STEP2;
#endif
}

/* The acceleration of the height: a + d. */
NMPC_INLINE nmpc_real_t height_acceleration(const nmpc_height_t *height)
{
#if WITH_LIFT
    return height_lift(height, height->thrust_m_step2) + height->disturbance_m_step2;
#else
    return height_lift(height, height->thrust_m_step2);
#endif
}

/* Correct the estimates by a measured state, whose climb is `climb_m_step`; `acceleration_m_step2` is a + d. */
NMPC_INLINE void height_correct(nmpc_height_t *height, const nmpc_state_t *state, nmpc_real_t climb_m_step,
                                nmpc_real_t acceleration_m_step2, int lies_on_floor)
{
    nmpc_real_t n[2];
#if WITH_THRUST_GAIN or WITH_LIFT
    nmpc_real_t change;
#endif

    axis_innovate(height->height_m, height->velocity_m_step, acceleration_m_step2, state->height_m, climb_m_step, n);
    axis_correct(&height->height_m, &height->velocity_m_step, height_gains, n);
#if WITH_THRUST_GAIN
    change = gain_correction(height_gains[2][0], n[0], height_gains[2][1], n[1]);
#elif WITH_LIFT
    change = disturbance_correction(height_gains[2][0], n[0], height_gains[2][1], n[1]);
#endif
#if WITH_THRUST_GAIN or WITH_LIFT
    if ((state->on_ground != 0) && ((lies_on_floor != 0) || (change > (nmpc_real_t)0))) {
        change = (nmpc_real_t)0;
    }
#else
    (void)lies_on_floor;
#endif
#if WITH_THRUST_GAIN
    height->gain = confine(height->gain + change, NMPC_GAIN_MIN, NMPC_GAIN_MAX);
#elif WITH_LIFT
    height->disturbance_m_step2 = clamp(height->disturbance_m_step2 + change, NMPC_LIFT_LIMIT_M_STEP2);
#endif
}

/* Take a measured state into the estimates. The first one also says at which tilt the last command was flown. Returns 1
 * if the drone lies on the floor. */
NMPC_INLINE int height_measure(nmpc_height_t *height, const nmpc_state_t *state, int is_first)
{
    const nmpc_real_t climb_m_step = speed_product(NMPC_UPDATE_STEP_S, state->climb_m_s);
    const nmpc_real_t acceleration_m_step2 = height_acceleration(height);
    const int lies_on_floor = (state->on_ground != 0) && (acceleration_m_step2 <= (nmpc_real_t)0);

    if (is_first != 0) {
        height->height_m = state->height_m;
        height->velocity_m_step = climb_m_step;
        height->command_m_step2 = height_vertical(height->share, height->thrust_m_s2);
        height->thrust_m_step2 = height->command_m_step2;
        height->lagged_m_step2 = height->command_m_step2;
    } else {
        height_correct(height, state, climb_m_step, acceleration_m_step2, lies_on_floor);
    }
    if (lies_on_floor != 0) {
        height->height_m = state->height_m;
        height->velocity_m_step = (nmpc_real_t)0;
    }
    return lies_on_floor;
}

/* Take the target of this control step into the estimate of its motion. */
NMPC_INLINE void height_track(nmpc_height_t *height, const nmpc_target_t *target, int is_known)
{
    nmpc_set_point_t point;

    point.velocity_m_s = target->climb_m_s;
    point.acceleration_m_s2 = target->climb_acceleration_m_s2;
    point.ahead_m_s2 = target->climb_ahead_m_s2;
    point.known = target->known;
    motion_observe(&height->target, &point, motion_limits[1], is_known == 0);
    motion_feed(&height->target, point.known,
                (point.known > 1) ? NMPC_AHEAD_SNAP_TO_CLIMB_JERK_S : NMPC_SNAP_TO_CLIMB_JERK_S,
                &height->target_acceleration_m_step2, &height->target_jerk_m_step2_update);
    height->target_jerk_m_step2_update = clamp(height->target_jerk_m_step2_update,
                                               target_product(NMPC_STEP_TO_STEP2_S, motion_limits[1][NMPC_MOST_JERK]));
}

/* Forget the target. */
NMPC_INLINE void height_clear_target(nmpc_height_t *height)
{
    height->target_acceleration_m_step2 = (nmpc_real_t)0;
    height->target_jerk_m_step2_update = (nmpc_real_t)0;
    motion_clear(&height->target);
}

/* Predict the estimates at the next control step; a drone that lies on the floor stays there. */
NMPC_INLINE void height_predict(nmpc_height_t *height, int lies_on_floor)
{
    axis_predict(&height->height_m, &height->velocity_m_step,
                 (lies_on_floor != 0) ? (nmpc_real_t)0 : height_acceleration(height));
}

/* The thrust was `thrust_m_s2` in place of the last command. */
static void height_set_thrust(nmpc_height_t *height, nmpc_real_t thrust_m_s2)
{
    height->thrust_m_s2 = confine(thrust_m_s2, NMPC_THRUST_MIN_M_S2, NMPC_THRUST_MAX_M_S2);
    height->command_m_step2 = height_vertical(height->share, height->thrust_m_s2);
}

/* The frame has jumped, and the measured height and climb with it. */
static void height_shift(nmpc_height_t *height, nmpc_real_t change_m, nmpc_real_t change_m_s)
{
    axis_shift(&height->height_m, &height->velocity_m_step, change_m, speed_product(NMPC_UPDATE_STEP_S, change_m_s));
    height->target.velocity_m_s = clamp(height->target.velocity_m_s + change_m_s, NMPC_VELOCITY_RANGE_M_S);
}

/* Forget everything; the drone holds a thrust with the attitude of a command. */
static void height_reset(nmpc_height_t *height, nmpc_real_t thrust_m_s2, nmpc_real_t roll_rad, nmpc_real_t pitch_rad)
{
    height->height_m = (nmpc_real_t)0;
    height->velocity_m_step = (nmpc_real_t)0;
#if WITH_THRUST_GAIN
    height->gain = NMPC_ONE_FACTOR;
#elif WITH_LIFT
    height->disturbance_m_step2 = (nmpc_real_t)0;
#endif
    height->share = height_tilt(roll_rad, pitch_rad);
    height_set_thrust(height, thrust_m_s2);
    height->thrust_m_step2 = height->command_m_step2;
    height->lagged_m_step2 = height->command_m_step2;
#if WITH_GUARD
    height->commanded_m_s2 = height->thrust_m_s2;
    height->budget_m_s2 = NMPC_THRUST_BUDGET_M_S2;
#endif
    height_clear_target(height);
}
