/* ---- Tracker --------------------------------------------------------------------------------------------------------
 *
 * The target's acceleration and its rate, estimated by an alpha-beta filter (not in the paper). Index k counts control
 * steps, which are T_s = NMPC_UPDATE_PERIOD_S apart; tau is a step of the prediction. Along one axis, x or y, let Tv_k
 * be the velocity of the target, A_T = tau^2 a_T its acceleration, and J_T the change of A_T from one control step to
 * the next: the jerk. In every control step the measured acceleration M, the predicted one P and the new estimates are
 *
 *     M = (tau^2/T_s) (Tv_k - Tv_k-1)
 *     P = A_T(k-1) + J_T(k-1)
 *     A_T(k) = (1 - alpha) P + alpha M       J_T(k) = J_T(k-1) + beta (M - P)
 *
 * with alpha = NMPC_TRACKER_GAIN and beta = alpha^2 / (2 - alpha) (T. R. Benedict, G. W. Bordner, Synthesis of an
 * optimal set of radar track-while-scan smoothing equations, IRE Transactions on Automatic Control 7(4), 1962). So an
 * acceleration that rises at a constant rate is estimated without a lag. J_T is limited; so A_T, a weighted mean, stays
 * bounded.
 */

/* A change of velocity of more than 1.5 times what gravity and the tilt limit let the drone follow is a jump: the
 * target was set elsewhere. Then A_T stays and J_T is 0. In the first control step there is no Tv_k-1, and both are
 * 0. */

#include "tracker.h"

/* Forget the target: no velocity, no acceleration, no jerk. */
#if WITH_LIMITS
NMPC_SHARED void tracker_clear(nmpc_t *self)
#else
static void tracker_clear(nmpc_t *self)
#endif
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        self->tracker.velocity_m_s[axis] = (nmpc_real_t)0;
        self->tracker.acceleration_m_step2[axis] = (nmpc_real_t)0;
        self->tracker.jerk_m_step2_update[axis] = (nmpc_real_t)0;
    }
    self->has_target = 0U;
}

/* Take the acceleration of the target along `axis` in this control step into the estimates. */
NMPC_INLINE void tracker_correct(nmpc_tracker_t *tracker, int axis, nmpc_real_t measured_m_step2)
{
    const nmpc_real_t predicted_m_step2 = tracker->acceleration_m_step2[axis] + tracker->jerk_m_step2_update[axis];
    const nmpc_real_t difference_m_step2 = measured_m_step2 - predicted_m_step2;

    tracker->acceleration_m_step2[axis] =
        tracker_product(NMPC_TRACKER_REST, predicted_m_step2) + tracker_product(NMPC_TRACKER_GAIN, measured_m_step2);
    tracker->jerk_m_step2_update[axis] =
        clamp(tracker->jerk_m_step2_update[axis] + tracker_product(NMPC_TRACKER_JERK_GAIN, difference_m_step2),
              NMPC_TARGET_JERK_LIMIT_M_STEP2_UPDATE);
}

/* Take the target's velocity of this control step into the estimates. */
NMPC_INLINE void tracker_update(nmpc_t *self, const nmpc_real_t velocity_m_s[2])
{
    nmpc_tracker_t *const tracker = &self->tracker;
    int axis;

    NMPC_UNROLL
    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t change_m_s = velocity_m_s[axis] - tracker->velocity_m_s[axis];
        const int is_steady = within(change_m_s, NMPC_TARGET_CHANGE_LIMIT_M_S);

        if ((self->has_target != 0U) && (is_steady != 0)) {
#if WITH_FIXED
            /* The clamp changes nothing: it tells a proof by intervals how large the change is. */
            const nmpc_real_t steady_m_s = clamp(change_m_s, NMPC_TARGET_CHANGE_LIMIT_M_S);

            tracker_correct(tracker, axis, target_product(NMPC_STEP_SQUARED_PER_UPDATE_S, steady_m_s));
#else
            tracker_correct(tracker, axis, target_product(NMPC_STEP_SQUARED_PER_UPDATE_S, change_m_s));
#endif
        } else {
            /* The first velocity, or a jump: the acceleration stays. */
            tracker->jerk_m_step2_update[axis] = (nmpc_real_t)0;
        }
        tracker->velocity_m_s[axis] = velocity_m_s[axis];
    }
    self->has_target = 1U;
}

/* The frame has jumped: the target's velocity changes with it, and that is no acceleration. */
static void tracker_shift(nmpc_tracker_t *tracker, const nmpc_real_t change_m_s[])
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        tracker->velocity_m_s[axis] = clamp(tracker->velocity_m_s[axis] + change_m_s[axis], NMPC_VELOCITY_RANGE_M_S);
    }
}

/* The frame has turned: so does the target's acceleration. The next velocity of the target is taken for its first one,
 * where the jerk begins at 0. */
static void tracker_turn(nmpc_t *self, nmpc_real_t sine, nmpc_real_t cosine)
{
    nmpc_tracker_t *const tracker = &self->tracker;
    int axis;

    turn_vector(tracker->acceleration_m_step2, sine, cosine);
    for (axis = 0; axis < 2; axis++) {
        tracker->acceleration_m_step2[axis] = clamp(tracker->acceleration_m_step2[axis], NMPC_TARGET_BOUND_M_STEP2);
    }
    self->has_target = 0U;
}
