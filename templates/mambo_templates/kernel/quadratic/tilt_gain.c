/* ---- Tilt gain ------------------------------------------------------------------------------------------------------
 *
 * How much the drone tilts for a command, over what the attitude model says: a factor k each for roll and pitch (not in
 * the paper). A command of the model is divided by k before it is sent, and one that was sent is multiplied by it.
 *
 * The acceleration of the model's tilt, a, and that of the measured tilt, s, pass the same two low-passes, Q, which is
 * quick, and S, which is slow:
 *
 *     x = Q a - S a,   e = (Q s - S s) - x,   k' = k (1 + r e sign x)
 *
 * Trims and steady wind leave no trace in x and e, quick noise little. e is limited. Nothing is learnt while |x| is
 * small, as in hover, nor from a command near the tilt limit. Without a good state nothing changes; on the floor, after
 * an outage and at the first good state the means start at the present values.
 *
 * A command stays within the tilt limit: where k is less than 1 the largest moves are as many times smaller.
 */

#include "tilt_gain.h"

/* The gain of an angle, but at most 1: by that its largest move is smaller. */
NMPC_INLINE nmpc_real_t tilt_gain_share(const nmpc_tilt_gain_t *learnt, int angle)
{
    return (learnt->gain[angle] < NMPC_TILT_GAIN_ONE) ? learnt->gain[angle] : NMPC_TILT_GAIN_ONE;
}

/* The command that makes the drone do what the model does with `command_rad`. */
NMPC_INLINE nmpc_real_t tilt_gain_sent(const nmpc_tilt_gain_t *learnt, int angle, nmpc_real_t command_rad)
{
    return factor_product(gain_inverse(learnt->gain[angle]), command_rad);
}

/* The command of the model with which it does what the drone does. */
NMPC_INLINE nmpc_real_t tilt_gain_meant(const nmpc_tilt_gain_t *learnt, int angle, nmpc_real_t command_rad)
{
    return factor_product(learnt->gain[angle], command_rad);
}

NMPC_INLINE nmpc_real_t tilt_gain_mean(const nmpc_real_t row[2], nmpc_real_t mean, nmpc_real_t value)
{
    return attitude_sum(wide_product(row[0], mean) + wide_product(row[1], value));
}

/* Learn from the tilts of the model and of the drone; `command_rad` was sent before. */
NMPC_SHARED void tilt_gain_learn(nmpc_tilt_gain_t *learnt, const nmpc_attitude_t *attitude,
                                 const nmpc_real_t tilt_m_step2[2], const nmpc_real_t command_rad[2],
                                 nmpc_real_t tilt_limit_rad)
{
    int angle;

    for (angle = 0; angle < 2; angle++) {
        const nmpc_real_t model_m_step2 = attitude->tilt_m_step2[angle];
        const nmpc_real_t quick_m_step2 = tilt_gain_mean(quick_row, learnt->quick_m_step2[angle], model_m_step2);
        const nmpc_real_t slow_m_step2 = tilt_gain_mean(slow_row, learnt->slow_m_step2[angle], model_m_step2);
        const nmpc_real_t seen_quick_m_step2 =
            tilt_gain_mean(quick_row, learnt->seen_quick_m_step2[angle], tilt_m_step2[angle]);
        const nmpc_real_t seen_slow_m_step2 =
            tilt_gain_mean(slow_row, learnt->seen_slow_m_step2[angle], tilt_m_step2[angle]);
        const nmpc_real_t moved_m_step2 = quick_m_step2 - slow_m_step2;
        const nmpc_real_t error_m_step2 =
            clamp((seen_quick_m_step2 - seen_slow_m_step2) - moved_m_step2, NMPC_TILT_GAIN_MOST_M_STEP2);
        const nmpc_real_t signed_m_step2 = (moved_m_step2 < (nmpc_real_t)0) ? -error_m_step2 : error_m_step2;
        const nmpc_real_t change = learning_product(NMPC_TILT_GAIN_RATE, signed_m_step2);
        const nmpc_real_t free_rad =
            factor_product(tilt_gain_share(learnt, angle) - NMPC_TILT_GAIN_FREE, tilt_limit_rad);
        const int is_moved =
            (moved_m_step2 >= NMPC_TILT_GAIN_LEAST_M_STEP2) || (moved_m_step2 <= -NMPC_TILT_GAIN_LEAST_M_STEP2);

        learnt->quick_m_step2[angle] = quick_m_step2;
        learnt->slow_m_step2[angle] = slow_m_step2;
        learnt->seen_quick_m_step2[angle] = seen_quick_m_step2;
        learnt->seen_slow_m_step2[angle] = seen_slow_m_step2;
        if (is_moved && (within(tilt_gain_meant(learnt, angle, command_rad[angle]), free_rad) != 0)) {
            learnt->gain[angle] = confine(learnt->gain[angle] + factor_product(learnt->gain[angle], change),
                                          NMPC_TILT_GAIN_MIN, NMPC_TILT_GAIN_MAX);
        }
    }
}

/* Start the means at the present tilts. */
NMPC_SHARED void tilt_gain_restart(nmpc_tilt_gain_t *learnt, const nmpc_attitude_t *attitude,
                                   const nmpc_real_t tilt_m_step2[2])
{
    int angle;

    for (angle = 0; angle < 2; angle++) {
        learnt->quick_m_step2[angle] = attitude->tilt_m_step2[angle];
        learnt->slow_m_step2[angle] = attitude->tilt_m_step2[angle];
        learnt->seen_quick_m_step2[angle] = tilt_m_step2[angle];
        learnt->seen_slow_m_step2[angle] = tilt_m_step2[angle];
    }
}

/* Forget what was learnt. */
static void tilt_gain_clear(nmpc_tilt_gain_t *learnt)
{
    int angle;

    for (angle = 0; angle < 2; angle++) {
        learnt->quick_m_step2[angle] = (nmpc_real_t)0;
        learnt->slow_m_step2[angle] = (nmpc_real_t)0;
        learnt->seen_quick_m_step2[angle] = (nmpc_real_t)0;
        learnt->seen_slow_m_step2[angle] = (nmpc_real_t)0;
        learnt->gain[angle] = NMPC_TILT_GAIN_ONE;
    }
}
