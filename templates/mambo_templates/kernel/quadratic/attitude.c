/* ---- Attitude -------------------------------------------------------------------------------------------------------
 *
 * How the drone accelerates in answer to the commands (not in the paper). Axes are those of the heading: 0 is right,
 * which roll tilts to, and 1 is forward, which minus pitch tilts to. Along each let u be the commanded acceleration, c
 * the command behind the dead time and the quick lags, a the acceleration that the tilt gives, and i the integral part
 * of the attitude loop, all in m/step^2. They obey
 *
 *     lag a' = c - a + i,   i' = integral (u - a) - i / 1000 s,   delay c' = u - c.
 *
 * The leak of i, with 1000 s, is slower than anything in flight: it only gives i a bound.
 *
 * u is held over a control step; the rows below are the exact solution. a, i and u are limited, so that what is stored
 * is bounded. No command within the tilt limit reaches that limit: it is the acceleration of the tilt limit times the
 * largest sum of an absolute impulse response from u to a, i and c, doubled for headings that turn. c, a weighted mean
 * of c and u, needs no limit.
 */

#include "attitude.h"

/* The next a or i of an axis. */
NMPC_INLINE nmpc_real_t attitude_next(const nmpc_real_t row[NMPC_ATTITUDE_STATES],
                                      const nmpc_real_t state[NMPC_ATTITUDE_STATES])
{
    nmpc_sum_t sum = wide_product(row[0], state[0]);
    int k;

    NMPC_UNROLL
    for (k = 1; k < NMPC_ATTITUDE_STATES; k++) {
        sum = sum + wide_product(row[k], state[k]);
    }
#if WITH_HEIGHT
    return shared_clamp(attitude_sum(sum), NMPC_ATTITUDE_LIMIT_M_STEP2);
#else
    return clamp(attitude_sum(sum), NMPC_ATTITUDE_LIMIT_M_STEP2);
#endif
}

/* Let the model answer the last commands over one control step. */
NMPC_INLINE void attitude_advance(nmpc_attitude_t *attitude)
{
    int axis;

    NMPC_UNROLL
    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t state[NMPC_ATTITUDE_STATES] = { attitude->tilt_m_step2[axis],
                                                          attitude->integral_m_step2[axis],
                                                          attitude->lagged_m_step2[axis],
                                                          attitude->command_m_step2[axis] };

        attitude->tilt_m_step2[axis] = attitude_next(tilt_rows[axis], state);
        attitude->integral_m_step2[axis] = attitude_next(integral_rows[axis], state);
        attitude->lagged_m_step2[axis] =
            attitude_sum(wide_product(lagged_rows[axis][0], state[2]) + wide_product(lagged_rows[axis][1], state[3]));
    }
}

/* Turn the model to the heading with this sine and cosine. The drone yaws, and its tilt stays where it is in the world;
 * i, c and u are those of the attitude loops, which turn with the body. If a new command follows in this control step,
 * u turns too: the cost counts the change of the commanded acceleration in the world. A held command stays. */
NMPC_INLINE void attitude_turn(nmpc_attitude_t *attitude, nmpc_real_t sine, nmpc_real_t cosine, int is_followed)
{
    /* Sine and cosine of the change of the heading. */
    const nmpc_real_t sine_change = sine_difference(sine, attitude->cosine, cosine, attitude->sine);
    const nmpc_real_t cosine_change = sine_sum(cosine, attitude->cosine, sine, attitude->sine);

    turn_vector(attitude->tilt_m_step2, sine_change, cosine_change);
    if (is_followed != 0) {
        turn_vector(attitude->command_m_step2, sine_change, cosine_change);
#if WITH_HEIGHT
        attitude->command_m_step2[NMPC_RIGHT] =
            shared_clamp(attitude->command_m_step2[NMPC_RIGHT], NMPC_ATTITUDE_LIMIT_M_STEP2);
        attitude->command_m_step2[NMPC_FORWARD] =
            shared_clamp(attitude->command_m_step2[NMPC_FORWARD], NMPC_ATTITUDE_LIMIT_M_STEP2);
#else
        attitude->command_m_step2[NMPC_RIGHT] =
            clamp(attitude->command_m_step2[NMPC_RIGHT], NMPC_ATTITUDE_LIMIT_M_STEP2);
        attitude->command_m_step2[NMPC_FORWARD] =
            clamp(attitude->command_m_step2[NMPC_FORWARD], NMPC_ATTITUDE_LIMIT_M_STEP2);
#endif
    }
    attitude->sine = sine;
    attitude->cosine = cosine;
}

/* The frame has turned by the angle of which sine and cosine are given: the axes of the model belong to the body, which
 * has not; they lie at another heading. */
static void attitude_shift(nmpc_attitude_t *attitude, nmpc_real_t sine, nmpc_real_t cosine)
{
    const nmpc_real_t sine_before = attitude->sine;
    const nmpc_real_t cosine_before = attitude->cosine;

    attitude->sine = clamp(sine_sum(sine_before, cosine, cosine_before, sine), NMPC_ONE);
    attitude->cosine = clamp(sine_difference(cosine_before, cosine, sine_before, sine), NMPC_ONE);
}

#if WITH_THRUST_VECTOR
/* Set `slope` to those of the thrust at a measured attitude; returns c. */
NMPC_INLINE nmpc_real_t attitude_measure(const nmpc_state_t *state, nmpc_real_t slope[2])
{
#if WITH_ROLL_TRIM
    const nmpc_real_t roll_rad = state->roll_rad - NMPC_ROLL_TRIM_RAD;
#else
    const nmpc_real_t roll_rad = state->roll_rad;
#endif
#if WITH_PITCH_TRIM
    const nmpc_real_t pitch_rad = state->pitch_rad - NMPC_PITCH_TRIM_RAD;
#else
    const nmpc_real_t pitch_rad = state->pitch_rad;
#endif

    return vector_point(roll_rad, pitch_rad, slope);
}

/* Set the accelerations that slopes give, right and forward; each is `weight` times that in hover. */
NMPC_SHARED void attitude_accelerate(const nmpc_real_t slope[2], nmpc_real_t weight,
                                     nmpc_real_t acceleration_m_step2[2])
{
    const nmpc_real_t right_m_step2 = slope_acceleration(NMPC_GAIN_M_STEP2_RAD, slope[NMPC_RIGHT]);
    const nmpc_real_t forward_m_step2 = slope_acceleration(NMPC_GAIN_M_STEP2_RAD, slope[NMPC_FORWARD]);

    acceleration_m_step2[NMPC_RIGHT] = factor_product(right_m_step2, weight);
    acceleration_m_step2[NMPC_FORWARD] = factor_product(forward_m_step2, weight);
}

/* Set the accelerations of a command. */
static void attitude_command(nmpc_real_t roll_rad, nmpc_real_t pitch_rad, nmpc_real_t weight,
                             nmpc_real_t acceleration_m_step2[2])
{
    nmpc_real_t slope[2];

    (void)vector_point_command(roll_rad, pitch_rad, slope);
    attitude_accelerate(slope, weight, acceleration_m_step2);
}

/* Set the last command of the model, u; a tilt counts `weight` times as much as in hover. */
static void attitude_set_command(nmpc_attitude_t *attitude, nmpc_real_t roll_rad, nmpc_real_t pitch_rad,
                                 nmpc_real_t weight)
{
    nmpc_real_t given_m_step2[2];

    attitude_command(roll_rad, pitch_rad, weight, given_m_step2);
    attitude->command_m_step2[NMPC_RIGHT] = clamp(given_m_step2[NMPC_RIGHT], NMPC_ATTITUDE_LIMIT_M_STEP2);
    attitude->command_m_step2[NMPC_FORWARD] = clamp(given_m_step2[NMPC_FORWARD], NMPC_ATTITUDE_LIMIT_M_STEP2);
}

/* Change the last command of the model, u, by what was sent, `after_rad`, in place of `before_rad`. */
static void attitude_change_command(nmpc_attitude_t *attitude, const nmpc_real_t before_rad[2],
                                    const nmpc_real_t after_rad[2], nmpc_real_t weight)
{
    nmpc_real_t before_m_step2[2];
    nmpc_real_t after_m_step2[2];
    int axis;

    attitude_command(before_rad[0], before_rad[1], weight, before_m_step2);
    attitude_command(after_rad[0], after_rad[1], weight, after_m_step2);
    for (axis = 0; axis < 2; axis++) {
        attitude->command_m_step2[axis] =
            clamp(attitude->command_m_step2[axis] + (after_m_step2[axis] - before_m_step2[axis]),
                  NMPC_ATTITUDE_LIMIT_M_STEP2);
    }
}
#else
/* Set `tilt_m_step2` to the accelerations, right and forward, of a measured attitude. */
#if WITH_HEIGHT
/* Each is `weight` times that in hover. */
NMPC_INLINE void attitude_measure(const nmpc_state_t *state, nmpc_real_t weight, nmpc_real_t tilt_m_step2[2])
#else
NMPC_INLINE void attitude_measure(const nmpc_state_t *state, nmpc_real_t tilt_m_step2[2])
#endif
{
#if WITH_ROLL_TRIM
    const nmpc_real_t right_m_step2 = tilt_product(NMPC_GAIN_M_STEP2_RAD, state->roll_rad - NMPC_ROLL_TRIM_RAD);
#else
    const nmpc_real_t right_m_step2 = tilt_product(NMPC_GAIN_M_STEP2_RAD, state->roll_rad);
#endif
#if WITH_PITCH_TRIM
    const nmpc_real_t forward_m_step2 = tilt_product(NMPC_GAIN_M_STEP2_RAD, state->pitch_rad - NMPC_PITCH_TRIM_RAD);
#else
    const nmpc_real_t forward_m_step2 = tilt_product(NMPC_GAIN_M_STEP2_RAD, state->pitch_rad);
#endif

#if WITH_HEIGHT
    tilt_m_step2[NMPC_RIGHT] = factor_product(right_m_step2, weight);
    tilt_m_step2[NMPC_FORWARD] = -factor_product(forward_m_step2, weight);
#else
    tilt_m_step2[NMPC_RIGHT] = right_m_step2;
    tilt_m_step2[NMPC_FORWARD] = -forward_m_step2;
#endif
}

/* The commands, in rad, of u to the right and of u forward; within the tilt limit for a move within its limit. */
NMPC_INLINE nmpc_real_t attitude_roll(nmpc_real_t right_m_step2)
{
#if WITH_ROLL_TRIM
    return command_product(NMPC_ROLL_PER_ACCELERATION, right_m_step2) + NMPC_ROLL_TRIM_COMMAND_RAD;
#else
    return command_product(NMPC_ROLL_PER_ACCELERATION, right_m_step2);
#endif
}

NMPC_INLINE nmpc_real_t attitude_pitch(nmpc_real_t forward_m_step2)
{
#if WITH_PITCH_TRIM
    return NMPC_PITCH_TRIM_COMMAND_RAD - command_product(NMPC_PITCH_PER_ACCELERATION, forward_m_step2);
#else
    return -command_product(NMPC_PITCH_PER_ACCELERATION, forward_m_step2);
#endif
}

/* Set the last command of the model, u. */
#if WITH_HEIGHT
/* A tilt counts `weight` times as much as in hover. */
static void attitude_set_command(nmpc_attitude_t *attitude, nmpc_real_t roll_rad, nmpc_real_t pitch_rad,
                                 nmpc_real_t weight)
#else
static void attitude_set_command(nmpc_attitude_t *attitude, nmpc_real_t roll_rad, nmpc_real_t pitch_rad)
#endif
{
#if WITH_ROLL_TRIM
    const nmpc_real_t right_m_step2 = tilt_product(NMPC_ROLL_GAIN_M_STEP2_RAD, roll_rad - NMPC_ROLL_TRIM_COMMAND_RAD);
#else
    const nmpc_real_t right_m_step2 = tilt_product(NMPC_ROLL_GAIN_M_STEP2_RAD, roll_rad);
#endif
#if WITH_PITCH_TRIM
    const nmpc_real_t forward_m_step2 =
        tilt_product(NMPC_PITCH_GAIN_M_STEP2_RAD, pitch_rad - NMPC_PITCH_TRIM_COMMAND_RAD);
#else
    const nmpc_real_t forward_m_step2 = tilt_product(NMPC_PITCH_GAIN_M_STEP2_RAD, pitch_rad);
#endif

#if WITH_HEIGHT
    attitude->command_m_step2[NMPC_RIGHT] = factor_product(right_m_step2, weight);
    attitude->command_m_step2[NMPC_FORWARD] = -factor_product(forward_m_step2, weight);
#else
    attitude->command_m_step2[NMPC_RIGHT] = right_m_step2;
    attitude->command_m_step2[NMPC_FORWARD] = -forward_m_step2;
#endif
}

/* Change the last command of the model, u, by what was sent in its place less what it was. */
#if WITH_HEIGHT
static void attitude_change_command(nmpc_attitude_t *attitude, nmpc_real_t roll_change_rad,
                                    nmpc_real_t pitch_change_rad, nmpc_real_t weight)
#else
static void attitude_change_command(nmpc_attitude_t *attitude, nmpc_real_t roll_change_rad,
                                    nmpc_real_t pitch_change_rad)
#endif
{
#if WITH_HEIGHT
    const nmpc_real_t roll_m_step2 = tilt_product(NMPC_ROLL_GAIN_M_STEP2_RAD, roll_change_rad);
    const nmpc_real_t pitch_m_step2 = tilt_product(NMPC_PITCH_GAIN_M_STEP2_RAD, pitch_change_rad);
    const nmpc_real_t right_m_step2 = factor_product(roll_m_step2, weight);
    const nmpc_real_t forward_m_step2 = -factor_product(pitch_m_step2, weight);
#else
    const nmpc_real_t right_m_step2 = tilt_product(NMPC_ROLL_GAIN_M_STEP2_RAD, roll_change_rad);
    const nmpc_real_t forward_m_step2 = -tilt_product(NMPC_PITCH_GAIN_M_STEP2_RAD, pitch_change_rad);
#endif

    attitude->command_m_step2[NMPC_RIGHT] =
        clamp(attitude->command_m_step2[NMPC_RIGHT] + right_m_step2, NMPC_ATTITUDE_LIMIT_M_STEP2);
    attitude->command_m_step2[NMPC_FORWARD] =
        clamp(attitude->command_m_step2[NMPC_FORWARD] + forward_m_step2, NMPC_ATTITUDE_LIMIT_M_STEP2);
}
#endif

/* Set the model to the steady attitude of a command. */
#if WITH_HEIGHT
static void attitude_reset(nmpc_attitude_t *attitude, nmpc_real_t roll_rad, nmpc_real_t pitch_rad, nmpc_real_t weight)
#else
static void attitude_reset(nmpc_attitude_t *attitude, nmpc_real_t roll_rad, nmpc_real_t pitch_rad)
#endif
{
    int axis;

#if WITH_HEIGHT
    attitude_set_command(attitude, roll_rad, pitch_rad, weight);
#else
    attitude_set_command(attitude, roll_rad, pitch_rad);
#endif
    for (axis = 0; axis < 2; axis++) {
        attitude->tilt_m_step2[axis] = attitude->command_m_step2[axis];
        attitude->integral_m_step2[axis] = (nmpc_real_t)0;
        attitude->lagged_m_step2[axis] = attitude->command_m_step2[axis];
    }
    attitude->sine = (nmpc_real_t)0;
    attitude->cosine = NMPC_ONE;
}
