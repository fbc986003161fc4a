/* ---- Target observer ------------------------------------------------------------------------------------------------
 *
 * The target's acceleration A_T and jerk J_T, from set-points that say what they know (not in the paper). Along each
 * axis a target moves by v, a, j and s, the velocity and its derivatives in m/s per step, per step^2 and per step^3:
 *
 *     v' = v + (a + (j/2 + s/6)),   a' = a + (j + s/2),   j' = j + s,   s' = s.
 *
 * The innovation of a velocity Tv is nu = Tv - v'. v, a, j and s are those of the cubic that fits the last n velocities
 * with least squares: the gains of nu are K(n), a table. Noise changes nu from one velocity to the next, on a curve nu
 * hardly changes: h is the mean of |nu_k - nu_k-1|, and
 *
 *     n <= n_0 + c_0 h,   n <= n_1 + c_1 h,   n <= n_2;
 *
 * n begins with n_f, grows by 1 a step and falls by 2. A velocity whose |nu| is more than a limit and 4 h is rejected,
 * and the prediction is taken for it; after the second in a row the target has jumped.
 *
 * A known acceleration (`known` is 1) takes the place of the velocity: a, j and s are those of the parabola that fits
 * the last accelerations. With the acceleration 0.05 s ahead too (2) j is their difference over that time, the jerk
 * 0.025 s ahead; and s is the mean change of j from step to step, over 0.1 s.
 *
 * A_T = w T_s a and J_T = w (T_s j + t s) + drag A_T. t is the feed-forward gain of s with which the law follows without
 * an error, less 0.025 s where j is that much ahead; w falls with the noise from 1 to 0, and is 1 with known
 * accelerations. While limits of speed, braking or place act, the desired velocity v_d stands for the target's, and an
 * alpha-beta filter estimates its change d and the change e of that:
 *
 *     x = (v_d - v_d,k-1) - (d + e),   d' = (d + e) + alpha x,   e' = e + beta x.
 *
 * d begins with a, e with 0; a change of more than the largest acceleration leaves d and makes e 0. At a wall, and where
 * the target is slow, A_T = T_s d and J_T = T_s e + drag A_T.
 */

#include "target_observer.h"

/* A set-point along an axis. */
typedef struct {
    nmpc_real_t velocity_m_s;
    nmpc_real_t acceleration_m_s2;
    nmpc_real_t ahead_m_s2; /* the acceleration 0.05 s ahead */
    int known;
} nmpc_set_point_t;

/* Forget a motion. */
static void motion_clear(nmpc_motion_t *motion)
{
    motion->velocity_m_s = (nmpc_real_t)0;
    motion->acceleration = (nmpc_real_t)0;
    motion->jerk = (nmpc_real_t)0;
    motion->snap = (nmpc_real_t)0;
    motion->innovation = (nmpc_real_t)0;
    motion->noise = (nmpc_real_t)0;
    motion->memory = (nmpc_real_t)0;
    motion->missed = (nmpc_real_t)0;
}

/* Forget the target. */
static void tracker_clear(nmpc_t *self)
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        self->tracker.acceleration_m_step2[axis] = (nmpc_real_t)0;
        self->tracker.jerk_m_step2_update[axis] = (nmpc_real_t)0;
        motion_clear(&self->tracker.axis[axis]);
        self->tracker.desired_m_s[axis] = (nmpc_real_t)0;
        self->tracker.desired_acceleration[axis] = (nmpc_real_t)0;
        self->tracker.desired_jerk[axis] = (nmpc_real_t)0;
    }
    self->has_target = 0U;
}

/* An acceleration in m/s per step, within the limits. */
NMPC_INLINE nmpc_real_t motion_change(nmpc_real_t acceleration_m_s2, const nmpc_real_t limits[NMPC_WIDTH_OF_LIMITS])
{
    return clamp(change_product(NMPC_UPDATE_STEP_S, acceleration_m_s2), limits[NMPC_MOST_ACCELERATION]);
}

/* The motion a step later. */
NMPC_INLINE void motion_predict(nmpc_motion_t *motion)
{
    const nmpc_real_t half = tracker_product(NMPC_HALF_SHARE, motion->snap);
    const nmpc_real_t sixth = tracker_product(NMPC_SIXTH_SHARE, motion->snap);
    const nmpc_real_t change_m_s = motion->acceleration + (tracker_product(NMPC_HALF_SHARE, motion->jerk) + sixth);

    motion->velocity_m_s = motion->velocity_m_s + change_m_s;
    motion->acceleration = motion->acceleration + (motion->jerk + half);
    motion->jerk = motion->jerk + motion->snap;
}

/* Limit the motion. */
NMPC_INLINE void motion_limit(nmpc_motion_t *motion, const nmpc_real_t limits[NMPC_WIDTH_OF_LIMITS], nmpc_real_t snap)
{
    motion->velocity_m_s = clamp(motion->velocity_m_s, NMPC_VELOCITY_RANGE_M_S);
    motion->acceleration = clamp(motion->acceleration, limits[NMPC_MOST_ACCELERATION]);
    motion->jerk = clamp(motion->jerk, limits[NMPC_MOST_JERK]);
    motion->snap = clamp(motion->snap, snap);
}

/* Take in an innovation. Returns 1 if its set-point is accepted; 0 if it is rejected; -1 if the target has jumped. */
NMPC_SHARED int motion_judge(nmpc_motion_t *motion, nmpc_real_t innovation, nmpc_real_t jump)
{
    const nmpc_real_t noise = motion->noise;
    const nmpc_real_t trust = jump + ((noise + noise) + (noise + noise));
    const nmpc_real_t changed = innovation - motion->innovation;
    const nmpc_real_t size = (changed < (nmpc_real_t)0) ? -changed : changed;
    const nmpc_real_t change = (size > trust) ? trust : size;
    const nmpc_real_t mean = noise + tracker_product(NMPC_NOISE_SHARE, change - noise);
    int judged = 1;

    motion->noise = (mean > NMPC_NOISE_MOST_M_S) ? NMPC_NOISE_MOST_M_S : mean;
    /* This changes nothing: it tells a proof by intervals that the mean of sizes is not less than 0. */
    motion->noise = (motion->noise < (nmpc_real_t)0) ? (nmpc_real_t)0 : motion->noise;
    motion->innovation = innovation;
    if (within(innovation, trust) == 0) {
        if (motion->missed > (nmpc_real_t)0) {
            judged = -1;
        } else {
            judged = 0;
        }
        motion->innovation = (nmpc_real_t)0;
    }
#if WITH_FIXED
    /* Nor does this: it tells how large an accepted innovation is. */
    motion->innovation = clamp(motion->innovation, trust);
#endif
    motion->missed = (judged == 0) ? (nmpc_real_t)1 : (nmpc_real_t)0;
    return judged;
}

/* The memory that the noise asks for. */
NMPC_INLINE void motion_remember(nmpc_motion_t *motion)
{
    const nmpc_real_t quick = NMPC_MEMORY_LEAST + count_product(NMPC_MEMORY_PER_NOISE, motion->noise);
    const nmpc_real_t slow = NMPC_MEMORY_SLOW + count_product(NMPC_MEMORY_PER_NOISE_SLOW, motion->noise);
    const nmpc_real_t less = (slow < quick) ? slow : quick;
    const nmpc_real_t wanted = (NMPC_MEMORY_MOST < less) ? NMPC_MEMORY_MOST : less;
    const nmpc_real_t longer = motion->memory + (nmpc_real_t)1;
    const nmpc_real_t shorter = longer - NMPC_MEMORY_FALL;

    motion->memory = longer;
    if (longer > wanted) {
        motion->memory = (shorter > wanted) ? shorter : wanted;
    }
}

/* The row of a table for a memory that is `beyond` the least, from 0 to `last`. */
NMPC_INLINE int motion_row(nmpc_real_t beyond, int last)
{
    const nmpc_real_t row = (beyond > (nmpc_real_t)0) ? beyond : (nmpc_real_t)0;
    const nmpc_real_t limited = (row < (nmpc_real_t)last) ? row : (nmpc_real_t)last;

    return (int)limited;
}

/* Correct the motion by a velocity; a change of more than `jump_m_s` and the noise is a jump. */
NMPC_INLINE void motion_correct_velocity(nmpc_motion_t *motion, nmpc_real_t velocity_m_s, nmpc_real_t jump_m_s)
{
    const int has_turned = motion->missed > (nmpc_real_t)1;
    const nmpc_real_t innovation = (has_turned != 0) ? (nmpc_real_t)0 : (velocity_m_s - motion->velocity_m_s);
    const int judged = motion_judge(motion, innovation, jump_m_s);

    if (has_turned != 0) {
        motion->velocity_m_s = velocity_m_s;
    } else if (judged > 0) {
        const nmpc_real_t *gains;

        motion_remember(motion);
        gains = motion_gains[motion_row(motion->memory - NMPC_MEMORY_LEAST, NMPC_MEMORY_LAST_ROW)];
        motion->velocity_m_s = motion->velocity_m_s + tracker_product(gains[0], innovation);
        motion->acceleration = motion->acceleration + tracker_product(gains[1], innovation);
        motion->jerk = motion->jerk + tracker_product(gains[2], innovation);
        motion->snap = motion->snap + tracker_product(gains[3], innovation);
    } else if (judged < 0) {
        motion->velocity_m_s = velocity_m_s;
        motion->jerk = (nmpc_real_t)0;
        motion->snap = (nmpc_real_t)0;
        motion->memory = NMPC_MEMORY_FIRST;
    } else {
        /* The prediction stands. */
    }
}

/* The same by an acceleration that the target knows, in m/s per step. */
NMPC_INLINE void motion_correct_acceleration(nmpc_motion_t *motion, nmpc_real_t acceleration, nmpc_real_t jump)
{
    const nmpc_real_t innovation = acceleration - motion->acceleration;
    const int judged = motion_judge(motion, innovation, jump);

    if (judged > 0) {
        const nmpc_real_t wanted = NMPC_KNOWN_LEAST + count_product(NMPC_KNOWN_PER_NOISE, motion->noise);
        const nmpc_real_t memory = (NMPC_KNOWN_MOST < wanted) ? NMPC_KNOWN_MOST : wanted;
        const nmpc_real_t *const gains = known_gains[motion_row(memory - NMPC_KNOWN_LEAST, NMPC_KNOWN_LAST_ROW)];

        motion->acceleration = motion->acceleration + tracker_product(gains[0], innovation);
        motion->jerk = motion->jerk + tracker_product(gains[1], innovation);
        motion->snap = motion->snap + tracker_product(gains[2], innovation);
    } else if (judged < 0) {
        motion->acceleration = acceleration;
        motion->jerk = (nmpc_real_t)0;
        motion->snap = (nmpc_real_t)0;
    } else {
        /* The prediction stands. */
    }
}

/* Set the motion to what a set-point knows: the first one, or one that knows the acceleration ahead. */
NMPC_SHARED void motion_set(nmpc_motion_t *motion, const nmpc_set_point_t *point,
                            const nmpc_real_t limits[NMPC_WIDTH_OF_LIMITS], int is_first)
{
    const nmpc_real_t before = motion->jerk;

    motion->velocity_m_s = point->velocity_m_s;
    motion->acceleration = (nmpc_real_t)0;
    motion->jerk = (nmpc_real_t)0;
    if (point->known > 0) {
        motion->acceleration = motion_change(point->acceleration_m_s2, limits);
    }
    if (point->known > 1) {
        const nmpc_real_t change = motion_change(point->ahead_m_s2, limits) - motion->acceleration;

        motion->jerk = clamp(factor_product(change, NMPC_AHEAD_SHARE), limits[NMPC_MOST_JERK]);
    }
    if ((point->known > 1) && (is_first == 0)) {
        const nmpc_real_t grown = (motion->jerk - before) - motion->snap;

        motion->snap = clamp(motion->snap + tracker_product(NMPC_SNAP_SHARE, grown), limits[NMPC_MOST_KNOWN_SNAP]);
    } else {
        motion->snap = (nmpc_real_t)0;
    }
    motion->innovation = (nmpc_real_t)0;
    motion->missed = (nmpc_real_t)0;
}

/* Begin to count set-points of another kind: velocities, or accelerations, whose noise is 0 at first. */
NMPC_INLINE void motion_begin(nmpc_motion_t *motion, int known)
{
    motion->memory = (known > 0) ? (nmpc_real_t)0 : NMPC_MEMORY_FIRST;
    motion->noise = (known > 0) ? (nmpc_real_t)0 : NMPC_NOISE_FIRST_M_S;
    motion->innovation = (nmpc_real_t)0;
}

/* Take a set-point into the motion. */
NMPC_SHARED void motion_observe(nmpc_motion_t *motion, const nmpc_set_point_t *point,
                                const nmpc_real_t limits[NMPC_WIDTH_OF_LIMITS], int is_first)
{
    if ((point->known > 0) == (motion->memory > (nmpc_real_t)0)) {
        motion_begin(motion, point->known);
    }
    if ((is_first != 0) || (point->known > 1)) {
        motion_set(motion, point, limits, is_first);
    } else {
        motion_predict(motion);
        if (point->known > 0) {
            motion_correct_acceleration(motion, motion_change(point->acceleration_m_s2, limits),
                                        limits[NMPC_KNOWN_JUMP]);
            motion->velocity_m_s = point->velocity_m_s;
            motion_limit(motion, limits, limits[NMPC_MOST_KNOWN_SNAP]);
        } else {
            motion_correct_velocity(motion, point->velocity_m_s, limits[NMPC_JUMP]);
            motion_limit(motion, limits, limits[NMPC_MOST_SNAP]);
        }
    }
}

/* Set A_T and J_T without drag. */
NMPC_SHARED void motion_feed(const nmpc_motion_t *motion, int known, nmpc_real_t snap_s,
                             nmpc_real_t *acceleration_m_step2, nmpc_real_t *jerk_m_step2_update)
{
    const nmpc_real_t belief = NMPC_BELIEF_TOP - noise_product(NMPC_BELIEF_PER_NOISE, motion->noise);

    *acceleration_m_step2 = target_product(NMPC_STEP_TO_STEP2_S, motion->acceleration);
    *jerk_m_step2_update = target_product(NMPC_STEP_TO_STEP2_S, motion->jerk) + target_product(snap_s, motion->snap);
    if ((known == 0) && (belief < NMPC_BELIEF_MOST)) {
        const nmpc_real_t share = (belief < (nmpc_real_t)0) ? (nmpc_real_t)0 : belief;

        *acceleration_m_step2 = factor_product(*acceleration_m_step2, share);
        *jerk_m_step2_update = factor_product(*jerk_m_step2_update, share);
    }
}

/* Set A_T and J_T along an axis; the jerk is without drag. */
NMPC_INLINE void tracker_feed(nmpc_tracker_t *tracker, int axis, nmpc_real_t acceleration_m_step2,
                              nmpc_real_t jerk_m_step2)
{
    const nmpc_real_t limit_m_step2 = target_product(NMPC_STEP_TO_STEP2_S, motion_limits[0][NMPC_MOST_JERK]);
#if WITH_DRAG
    const nmpc_real_t drag_m_step2 = factor_product(acceleration_m_step2, NMPC_TARGET_DRAG);

    tracker->jerk_m_step2_update[axis] = clamp(jerk_m_step2 + drag_m_step2, limit_m_step2);
#else
    tracker->jerk_m_step2_update[axis] = clamp(jerk_m_step2, limit_m_step2);
#endif
    tracker->acceleration_m_step2[axis] = acceleration_m_step2;
}

/* Take a set-point into the motion along x and y. */
NMPC_INLINE void tracker_update(nmpc_t *self, const nmpc_target_t *target)
{
    nmpc_tracker_t *const tracker = &self->tracker;
    int axis;

    for (axis = 0; axis < 2; axis++) {
        nmpc_motion_t *const motion = &tracker->axis[axis];
        nmpc_set_point_t point;
        nmpc_real_t acceleration_m_step2;
        nmpc_real_t jerk_m_step2;

        point.velocity_m_s = target->velocity_m_s[axis];
        point.acceleration_m_s2 = target->acceleration_m_s2[axis];
        point.ahead_m_s2 = target->ahead_m_s2[axis];
        point.known = target->known;
        motion_observe(motion, &point, motion_limits[0], self->has_target == 0U);
        motion_feed(motion, point.known, (point.known > 1) ? NMPC_AHEAD_SNAP_TO_JERK_S : NMPC_SNAP_TO_JERK_S,
                    &acceleration_m_step2, &jerk_m_step2);
        tracker_feed(tracker, axis, acceleration_m_step2, jerk_m_step2);
    }
    self->has_target = 1U;
}

/* Take in the desired velocity, while limits act. `was_limited` is 0 where it stood for no target before. */
NMPC_SHARED void tracker_follow(nmpc_tracker_t *tracker, const nmpc_real_t velocity_m_s[2], int was_limited,
                                int by_limits)
{
    const nmpc_real_t most = motion_limits[0][NMPC_MOST_ACCELERATION];
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t change = velocity_m_s[axis] - tracker->desired_m_s[axis];
        nmpc_real_t acceleration = tracker->desired_acceleration[axis];
        nmpc_real_t jerk = tracker->desired_jerk[axis];

        if (was_limited == 0) {
            acceleration = tracker->axis[axis].acceleration;
            jerk = (nmpc_real_t)0;
        } else if (within(change, most) != 0) {
            const nmpc_real_t predicted = acceleration + jerk;
            const nmpc_real_t difference = change - predicted;

            acceleration = clamp(predicted + tracker_product(NMPC_DESIRED_GAIN, difference), most);
            jerk = clamp(jerk + tracker_product(NMPC_DESIRED_JERK_GAIN, difference), motion_limits[0][NMPC_MOST_JERK]);
        } else {
            jerk = (nmpc_real_t)0;
        }
        tracker->desired_m_s[axis] = velocity_m_s[axis];
        tracker->desired_acceleration[axis] = acceleration;
        tracker->desired_jerk[axis] = jerk;
        if (by_limits != 0) {
            tracker_feed(tracker, axis, target_product(NMPC_STEP_TO_STEP2_S, acceleration),
                         target_product(NMPC_STEP_TO_STEP2_S, jerk));
        }
    }
}

/* The frame has jumped: velocities change with it, and that is no acceleration. */
static void tracker_shift(nmpc_tracker_t *tracker, const nmpc_real_t change_m_s[])
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        nmpc_motion_t *const motion = &tracker->axis[axis];

        motion->velocity_m_s = clamp(motion->velocity_m_s + change_m_s[axis], NMPC_VELOCITY_RANGE_M_S);
        tracker->desired_m_s[axis] = clamp(tracker->desired_m_s[axis] + change_m_s[axis], NMPC_VELOCITY_RANGE_M_S);
    }
}

/* Turn a component along x and one along y, which stay within a limit. */
static void turn_components(nmpc_real_t *x, nmpc_real_t *y, nmpc_real_t sine, nmpc_real_t cosine, nmpc_real_t limit)
{
    nmpc_real_t vector[2] = { *x, *y };

    turn_vector(vector, sine, cosine);
    *x = clamp(vector[0], limit);
    *y = clamp(vector[1], limit);
}

/* The frame has turned, and the target's motion with it, but for its velocity: a caller turns the target about the
 * drone. The target's next velocity is taken as it is. */
static void tracker_turn(nmpc_t *self, nmpc_real_t sine, nmpc_real_t cosine)
{
    nmpc_tracker_t *const tracker = &self->tracker;
    nmpc_motion_t *const x = &tracker->axis[0];
    nmpc_motion_t *const y = &tracker->axis[1];

    turn_components(&tracker->acceleration_m_step2[0], &tracker->acceleration_m_step2[1], sine, cosine,
                    target_product(NMPC_STEP_TO_STEP2_S, motion_limits[0][NMPC_MOST_ACCELERATION]));
    turn_components(&tracker->jerk_m_step2_update[0], &tracker->jerk_m_step2_update[1], sine, cosine,
                    target_product(NMPC_STEP_TO_STEP2_S, motion_limits[0][NMPC_MOST_JERK]));
    turn_components(&x->acceleration, &y->acceleration, sine, cosine, motion_limits[0][NMPC_MOST_ACCELERATION]);
    turn_components(&x->jerk, &y->jerk, sine, cosine, motion_limits[0][NMPC_MOST_JERK]);
    turn_components(&x->snap, &y->snap, sine, cosine, motion_limits[0][NMPC_MOST_KNOWN_SNAP]);
    turn_components(&tracker->desired_m_s[0], &tracker->desired_m_s[1], sine, cosine, NMPC_VELOCITY_RANGE_M_S);
    turn_components(&tracker->desired_acceleration[0], &tracker->desired_acceleration[1], sine, cosine,
                    motion_limits[0][NMPC_MOST_ACCELERATION]);
    turn_components(&tracker->desired_jerk[0], &tracker->desired_jerk[1], sine, cosine,
                    motion_limits[0][NMPC_MOST_JERK]);
    x->innovation = (nmpc_real_t)0;
    y->innovation = (nmpc_real_t)0;
    x->missed = NMPC_HAS_TURNED;
    y->missed = NMPC_HAS_TURNED;
}
