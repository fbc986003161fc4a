/* ---- Limits ---------------------------------------------------------------------------------------------------------
 *
 * Limits of speed, braking and place (not in the paper).
 *
 * Near the target the command is as from a law K_e (p - p_T) + K_v (v - v_T), which is the same as following the
 * desired velocity
 *
 *     v_d = v_T + k (p_T - p),   k = K_e/K_v, the smaller one of both axes: NMPC_APPROACH_1_S.
 *
 * All limits are limits of v_d. With the position p, the fence, the speed limit V and the braking limit A, at most k V:
 *
 *   1. A target outside the fence is put on the wall, and the component of v_T that leads out there is 0.
 *   2. Braking: at distance d the approach has the speed f(d) = k d up to the knee d = A/k^2, and
 *      f(d) = sqrt(2 A (d - A/(2 k^2))) beyond, which the deceleration A takes away in time. Value and slope of the
 *      two are the same at the knee.
 *   3. Fence: towards a wall at distance d the component of v_d is at most f(d), unless f(d) >= V for every wall.
 *      Outside, it leads back in by f.
 *   4. Speed: if |v_d| > V, a factor makes it V. The direction stays.
 *
 * If none of these changes v_d, the target is used as it is, in every bit. Else the controller is given p for p_T and
 * v_d for v_T.
 */

/* A target that is slower than A/(2 k), and inside the fence, is approached with f(d + (1 - n) A/k^2), down to
 * d = n A/k^2, n = NMPC_NEAR_S2/NMPC_KNEE_S2: nearer the law brakes by itself. */

#if WITH_TURNING
/* Turns: a target that turns at the rate w faster than A_T/|v_T| makes the speed limit at most A_T/w, A_T being a share
 * of what the tilt limit gives. Else the drone could not follow v_d, and would orbit the target. w T_s |v_T|^2 is the
 * mean vector product of successive v_T, of which each step takes in a small share. */

#endif
#include "limits.h"

/* f(d)^2 for d = A/k^2 + excess. */
NMPC_INLINE nmpc_square_t braking_square(const nmpc_bounds_t *bounds, nmpc_real_t excess_m)
{
    return braking_product(bounds->braking_m_s2, halved(bounds->knee_m) + excess_m);
}

#if WITH_TURNING
/* Take in the target's velocity. Returns the speed limit, or what the target's turn allows if that is less. */
static nmpc_real_t limits_turn(nmpc_bounds_t *bounds, const nmpc_real_t velocity_m_s[2])
{
    const nmpc_square_t square = square_sum(velocity_m_s[0], velocity_m_s[1]);
    const nmpc_real_t slow_m_s = NMPC_SMALLEST_SPEED_LIMIT_M_S;
#if WITH_FIXED
    const nmpc_sum_t product =
        ((nmpc_sum_t)bounds->target_m_s[0] * velocity_m_s[1]) - ((nmpc_sum_t)bounds->target_m_s[1] * velocity_m_s[0]);
    const nmpc_sum_t mean =
        ((((nmpc_sum_t)1 << NMPC_TURN_BITS) - 1) * bounds->turn_m2_s2) + NMPC_ROUNDED(product, NMPC_VELOCITY_BITS);
    const nmpc_sum_t turn = NMPC_ROUNDED(mean, NMPC_TURN_BITS);
#else
    const nmpc_real_t product = (bounds->target_m_s[0] * velocity_m_s[1]) - (bounds->target_m_s[1] * velocity_m_s[0]);
    const nmpc_real_t turn = (NMPC_TURN_REST * bounds->turn_m2_s2) + (NMPC_TURN_GAIN * product);
#endif
    nmpc_real_t fastest_m_s = bounds->speed_m_s;

    bounds->target_m_s[0] = velocity_m_s[0];
    bounds->target_m_s[1] = velocity_m_s[1];
    bounds->turn_m2_s2 = (nmpc_real_t)0;
    if (square > squared(slow_m_s)) {
#if WITH_FIXED
        const nmpc_real_t turn_m2_s2 =
            (turn > NMPC_VELOCITY_RANGE_M_S)
                ? NMPC_VELOCITY_RANGE_M_S
                : ((turn < -NMPC_VELOCITY_RANGE_M_S) ? -NMPC_VELOCITY_RANGE_M_S : (nmpc_real_t)turn);
        const nmpc_real_t size_m2_s2 = (turn_m2_s2 < 0) ? -turn_m2_s2 : turn_m2_s2;
        const nmpc_real_t speed_m_s = at_most(length(inverse_root(square)), 2 * NMPC_VELOCITY_RANGE_M_S);
        const nmpc_sum_t turned_m_s = NMPC_ROUNDED((nmpc_sum_t)NMPC_TURN_M_S_RAD * bounds->tilt_rad, NMPC_TURN_SHIFT);
        const nmpc_real_t change_m_s = at_most((nmpc_square_t)turned_m_s, 2 * NMPC_VELOCITY_RANGE_M_S);
        const nmpc_sum_t most_m2_s2 = ((nmpc_sum_t)change_m_s * speed_m_s) >> NMPC_VELOCITY_BITS;
#else
        const nmpc_real_t turn_m2_s2 = clamp(turn, NMPC_VELOCITY_RANGE_M_S);
        const nmpc_real_t size_m2_s2 = (turn_m2_s2 < (nmpc_real_t)0) ? -turn_m2_s2 : turn_m2_s2;
        const nmpc_real_t speed_m_s = square * inverse_root(square);
        const nmpc_real_t change_m_s = NMPC_TURN_M_S_RAD * bounds->tilt_rad;
        const nmpc_real_t most_m2_s2 = change_m_s * speed_m_s;
#endif

        bounds->turn_m2_s2 = turn_m2_s2;
        if ((size_m2_s2 > most_m2_s2) && (size_m2_s2 > NMPC_LEAST_TURN_M2_S2)) {
#if WITH_FIXED
            const nmpc_real_t share = length_ratio((nmpc_real_t)most_m2_s2, inverse_root(squared(size_m2_s2)));
#else
            const nmpc_real_t share = length_ratio(most_m2_s2, inverse_root(squared(size_m2_s2)));
#endif

            fastest_m_s = smaller(fastest_m_s, larger(share_product(speed_m_s, share), slow_m_s));
        }
    }
    return fastest_m_s;
}

#endif
/* 1 if the drone is so far from every wall that none limits a velocity within the speed limit. */
#if WITH_QUADRATIC
NMPC_INLINE int limits_are_clear(const nmpc_bounds_t *bounds, const nmpc_real_t position_m[2])
#else
NMPC_SHARED int limits_are_clear(const nmpc_bounds_t *bounds, const nmpc_real_t position_m[2])
#endif
{
    return (absolute(position_m[0] - bounds->centre_m[0]) <= bounds->clear_m[0])
           && (absolute(position_m[1] - bounds->centre_m[1]) <= bounds->clear_m[1]);
}

/* 1 if the target is so near, and the desired velocity so small, that neither braking nor speed is limited. */
NMPC_INLINE int limits_are_free(const nmpc_bounds_t *bounds, nmpc_real_t fastest_m_s, const nmpc_real_t position_m[2],
                                const nmpc_target_t *target)
{
    const nmpc_real_t error_x_m = target->position_m[0] - position_m[0];
    const nmpc_real_t error_y_m = target->position_m[1] - position_m[1];
    const nmpc_real_t desired_x_m_s = target->velocity_m_s[0] + approach_product(NMPC_APPROACH_1_S, error_x_m);
    const nmpc_real_t desired_y_m_s = target->velocity_m_s[1] + approach_product(NMPC_APPROACH_1_S, error_y_m);

    return (square_sum(error_x_m, error_y_m) <= squared(bounds->near_m))
           && (square_sum(desired_x_m_s, desired_y_m_s) <= squared(fastest_m_s));
}

/* 1 if the target moves at less than A/(2 k), half the speed at which braking ends, along x and y. */
NMPC_INLINE int limits_are_slow(const nmpc_bounds_t *bounds, const nmpc_target_t *target)
{
    const nmpc_real_t half_m = halved(bounds->knee_m);
    const nmpc_real_t slow_m_s = approach_product(NMPC_APPROACH_1_S, half_m);

    return (within(target->velocity_m_s[0], slow_m_s) != 0) && (within(target->velocity_m_s[1], slow_m_s) != 0);
}

/* Half the width of the fence. */
NMPC_INLINE nmpc_real_t limits_half_width(const nmpc_bounds_t *bounds, int axis)
{
#if WITH_FIXED
    /* The clamp changes nothing: it tells a proof by intervals how wide the fence is. */
    return clamp(bounds->clear_m[axis] + bounds->margin_m, NMPC_POSITION_RANGE_M);
#else
    return bounds->clear_m[axis] + bounds->margin_m;
#endif
}

/* Put a target outside the fence on the wall, with a velocity that does not lead out. Returns NMPC_LIMIT_FENCE, or 0 if
 * it is inside. */
NMPC_SHARED unsigned int limits_hold(const nmpc_bounds_t *bounds, nmpc_target_t *held)
{
    unsigned int active = 0U;
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t half_width_m = limits_half_width(bounds, axis);
        const nmpc_real_t place_m = held->position_m[axis] - bounds->centre_m[axis];
        const nmpc_real_t velocity_m_s = held->velocity_m_s[axis];

        if (within(place_m, half_width_m) == 0) {
            held->position_m[axis] = bounds->centre_m[axis] + clamp(place_m, half_width_m);
            held->velocity_m_s[axis] = (place_m > (nmpc_real_t)0) ? smaller(velocity_m_s, (nmpc_real_t)0)
                                                                  : larger(velocity_m_s, (nmpc_real_t)0);
            active = NMPC_LIMIT_FENCE;
        }
    }
    return active;
}

/* Cut the velocity of `limited` towards the walls off at f(d); outside it leads back in. Returns NMPC_LIMIT_FENCE, or 0
 * if this changes nothing. */
NMPC_SHARED unsigned int limits_wall(const nmpc_bounds_t *bounds, nmpc_target_t *limited)
{
    unsigned int active = 0U;
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t half_width_m = limits_half_width(bounds, axis);
        const nmpc_real_t place_m = limited->position_m[axis] - bounds->centre_m[axis];
        const nmpc_real_t velocity_m_s = limited->velocity_m_s[axis];
        /* Towards the wall to which the drone flies; outside towards the one behind which it is. */
        const nmpc_real_t towards = (within(place_m, half_width_m) != 0) ? velocity_m_s : place_m;
        const nmpc_real_t sign = (towards < (nmpc_real_t)0) ? (nmpc_real_t)-1 : (nmpc_real_t)1;
        const nmpc_real_t room_m = half_width_m - (sign * place_m);
        const nmpc_real_t excess_m = absolute(room_m) - bounds->knee_m;
        nmpc_real_t most_m_s = approach_product(NMPC_APPROACH_1_S, room_m);

        if (excess_m > (nmpc_real_t)0) {
            most_m_s = braking_speed(braking_square(bounds, excess_m));
            if (room_m < (nmpc_real_t)0) {
                most_m_s = -most_m_s;
            }
        }
        if ((sign * velocity_m_s) > most_m_s) {
            limited->velocity_m_s[axis] = sign * most_m_s;
            active = NMPC_LIMIT_FENCE;
        }
    }
    return active;
}

/* Set the velocity of `limited`, whose position is the drone's, to v_d within the limits. Returns which of them act. */
NMPC_SHARED unsigned int limits_act(const nmpc_bounds_t *bounds, nmpc_real_t fastest_m_s, int is_clear,
                                    const nmpc_target_t *target, nmpc_target_t *limited)
{
    nmpc_real_t end_m = bounds->knee_m;
    nmpc_target_t held;
    nmpc_real_t error_x_m;
    nmpc_real_t error_y_m;
    nmpc_real_t ratio_1_s = NMPC_APPROACH_1_S;
    nmpc_square_t square;
    unsigned int fence = 0U;
    unsigned int others = 0U;

    held = *target;
    if (limits_are_clear(bounds, target->position_m) == 0) {
        fence = limits_hold(bounds, &held);
    }
    if ((fence == 0U) && (limits_are_slow(bounds, target) != 0)) {
        end_m = bounds->near_m;
    }
    error_x_m = held.position_m[0] - limited->position_m[0];
    error_y_m = held.position_m[1] - limited->position_m[1];
    square = square_sum(error_x_m, error_y_m);
    if (square > squared(end_m)) {
        const nmpc_root_t root = inverse_root(square);
#if WITH_FIXED
        const nmpc_real_t distance_m = at_most(length(root), 2 * NMPC_POSITION_RANGE_M);
#else
        const nmpc_real_t distance_m = square * root;
#endif
        /* Not less than 0, by rounding. */
        const nmpc_real_t excess_m = absolute(distance_m - end_m);
        const nmpc_real_t speed_m_s = braking_speed(braking_square(bounds, excess_m));

        ratio_1_s = approach_ratio(speed_m_s, root);
        others = NMPC_LIMIT_BRAKING;
    }
    limited->velocity_m_s[0] = held.velocity_m_s[0] + approach_product(ratio_1_s, error_x_m);
    limited->velocity_m_s[1] = held.velocity_m_s[1] + approach_product(ratio_1_s, error_y_m);
    if (is_clear == 0) {
        fence |= limits_wall(bounds, limited);
    }
    square = square_sum(limited->velocity_m_s[0], limited->velocity_m_s[1]);
    if (square > squared(fastest_m_s)) {
        const nmpc_real_t share = length_ratio(fastest_m_s, inverse_root(square));

        limited->velocity_m_s[0] = share_product(limited->velocity_m_s[0], share);
        limited->velocity_m_s[1] = share_product(limited->velocity_m_s[1], share);
        others = NMPC_LIMIT_SPEED;
    }
    /* Rounding aside this changes nothing: it tells a proof by intervals how large the velocities are. */
    limited->velocity_m_s[0] = clamp(limited->velocity_m_s[0], fastest_m_s);
    limited->velocity_m_s[1] = clamp(limited->velocity_m_s[1], fastest_m_s);
    return fence + others;
}

#if WITH_TRACKER
/* Take in which limits act now. Where braking ends, what stood for a slow target decelerates no more. */
NMPC_SHARED void limits_change(nmpc_t *self, unsigned int active, const nmpc_target_t *target)
{
#if WITH_HEIGHT
    const unsigned int before = (unsigned int)self->active_limits % NMPC_LIMIT_HEIGHT;
#else
    const unsigned int before = self->active_limits;
#endif

    if ((before == NMPC_LIMIT_BRAKING) && (active == 0U) && (limits_are_slow(&self->bounds, target) != 0)) {
        tracker_clear(self);
    }
    self->active_limits = (unsigned char)active;
}

#endif
/* Set `limited` to the target within the limits for a drone at `position_m`. Returns which limits act; if
 * 0, the target stays as it is, and `limited` is not to be used. */
NMPC_INLINE unsigned int limits_apply(nmpc_t *self, const nmpc_real_t position_m[2], const nmpc_target_t *target,
                                      nmpc_target_t *limited)
{
    nmpc_bounds_t *const bounds = &self->bounds;
    const int is_clear = limits_are_clear(bounds, position_m);
#if WITH_TURNING
    const nmpc_real_t fastest_m_s = limits_turn(bounds, target->velocity_m_s);
#else
    const nmpc_real_t fastest_m_s = bounds->speed_m_s;
#endif
    unsigned int active = 0U;

    if ((is_clear == 0) || (limits_are_free(bounds, fastest_m_s, position_m, target) == 0)) {
        limited->position_m[0] = position_m[0];
        limited->position_m[1] = position_m[1];
        active = limits_act(bounds, fastest_m_s, is_clear, target, limited);
    }
#if WITH_TRACKER
    if (active != self->active_limits) {
        limits_change(self, active, target);
    }
#else
    self->active_limits = (unsigned char)active;
#endif
    return active;
}
