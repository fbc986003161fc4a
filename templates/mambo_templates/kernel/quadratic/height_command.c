/* ---- Height command -------------------------------------------------------------------------------------------------
 *
 * The thrust that the next command asks for, from the chapter height.
 *
 * The limits of u are those of t, and not symmetric:
 *
 *     lo = kg c t_min - g,   hi = kg c t_max - g.
 *
 * Speed and fence: the law flies at the climb v_T + k (p_T - p). The error p - p_T is limited such that it is at most
 * the largest climb and the largest descent, and k times the distance to floor and ceiling; outside, it leads back in.
 * No square root is needed: at these speeds the thrust can always brake at the rate k.
 *
 * A target on the floor gets the least thrust. Without a good target, and after an outage, the target is the estimated
 * height itself, at rest: the drone brakes and hovers.
 */

#if WITH_TWO_MOVES
/* The minimum is U1 = between(U1 - H12/H11 (between(U2, lo, hi) - U2), lo, hi): that is exact in any box, by the
 * argument of the chapter optimizer for each end of it. */

#endif
#if WITH_THRUST_VECTOR
/* The tilt gets what the thrust leaves beside the height. With r a share of kg t_max and z = g + u, its acceleration in
 * any direction is at most sqrt(r^2 - z^2), for which chords of the quarter circle stand, 2 % of r inside at most, and
 * at least NMPC_LEAST_SPARE_M_STEP2. */

#endif
/* A row times the state. */
NMPC_INLINE nmpc_real_t height_row(const nmpc_real_t row[NMPC_HEIGHT_STATES],
                                   const nmpc_real_t state[NMPC_HEIGHT_STATES])
{
    nmpc_sum_t sum = wide_product(row[0], state[0]);
    int k;

    NMPC_UNROLL
    for (k = 1; k < NMPC_HEIGHT_STATES; k++) {
        sum = sum + wide_product(row[k], state[k]);
    }
    return row_sum(sum);
}

/* Return u that minimises the cost from `state`, of the members that the rows name, in m, m/step and m/step^2, between
 * the limits. */
NMPC_INLINE nmpc_real_t height_minimize(const nmpc_real_t state[NMPC_HEIGHT_STATES], nmpc_real_t low_m_step2,
                                        nmpc_real_t high_m_step2)
{
    nmpc_real_t move_m_step2 = height_row(height_rows[0], state);
#if WITH_TWO_MOVES
    const nmpc_real_t second_m_step2 = height_row(height_rows[1], state);
    const nmpc_real_t change_m_step2 = confine(second_m_step2, low_m_step2, high_m_step2) - second_m_step2;

    move_m_step2 = move_m_step2 - ratio_product(NMPC_HEIGHT_RATIO, change_m_step2);
#endif

    return move_acceleration(confine(move_m_step2, low_m_step2, high_m_step2));
}

/* Set the state of the cost, for `target` at the height `goal_m`; without one the drone rests. Returns 1 if speed or
 * fence changed what is aimed at. */
NMPC_INLINE int height_errors(nmpc_t *self, const nmpc_target_t *target, nmpc_real_t goal_m,
                              nmpc_real_t state[NMPC_HEIGHT_STATES])
{
    nmpc_height_t *const height = &self->height;
    const nmpc_bounds_t *const bounds = &self->bounds;
    const nmpc_real_t error_m = height->height_m - goal_m;
    const nmpc_real_t up_m = confine(bounds->ceiling_m - height->height_m, -bounds->down_m, bounds->up_m);
    const nmpc_real_t down_m = confine(height->height_m - bounds->floor_m, -bounds->up_m, bounds->down_m);
    nmpc_real_t climb_m_step = (nmpc_real_t)0;
    nmpc_real_t lead_m;

#if WITH_LIFT
    state[2] = height->disturbance_m_step2;
#else
    state[2] = (nmpc_real_t)0;
#endif
    state[3] = (nmpc_real_t)0;
    if (target != NULL) {
        height_track(height, target, (int)self->has_target);
        state[2] = state[2] - height->target_acceleration_m_step2;
        state[3] = height->target_jerk_m_step2_update;
        climb_m_step = speed_product(NMPC_UPDATE_STEP_S, height->target.velocity_m_s);
    }
    lead_m = reach_product(NMPC_REACH_STEPS, climb_m_step);
    state[0] = confine(error_m, lead_m - up_m, lead_m + down_m);
    state[1] = height->velocity_m_step - climb_m_step;
    state[4] = height_lift(height, height->thrust_m_step2);
    state[5] = height_lift(height, height->lagged_m_step2);
    state[6] = height_lift(height, height->command_m_step2);
    return (state[0] < error_m) || (state[0] > error_m);
}

/* Set the next thrust for `target`, or, if it is null, for rest at the estimated height. A null `state` stands for one
 * that is not good. Returns 1 if speed or fence changed what was aimed at. */
NMPC_INLINE int height_aim(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target)
{
    nmpc_height_t *const height = &self->height;
    const nmpc_real_t goal_m = (target != NULL) ? target->height_m : height->height_m;
    nmpc_real_t errors[NMPC_HEIGHT_STATES];
    const int is_limited = height_errors(self, target, goal_m, errors);
#if WITH_THRUST_GAIN
    const nmpc_real_t share = factor_product(height->share, height->gain);
#else
    const nmpc_real_t share = height->share;
#endif
    const nmpc_real_t least_m_step2 = factor_product(NMPC_THRUST_MIN_M_STEP2, share) - NMPC_GRAVITY_M_STEP2;
    const nmpc_real_t most_m_step2 = factor_product(NMPC_THRUST_MAX_M_STEP2, share) - NMPC_GRAVITY_M_STEP2;
    nmpc_real_t command_m_step2 = height_minimize(errors, to_move(least_m_step2), to_move(most_m_step2));
    nmpc_real_t thrust_m_step2;

    if ((state != NULL) && (state->on_ground != 0) && ((goal_m - state->height_m) <= NMPC_FLOOR_MARGIN_M)) {
        command_m_step2 = least_m_step2;
    }
    thrust_m_step2 = factor_product(NMPC_GRAVITY_M_STEP2 + command_m_step2, thrust_inverse(share));
    height->thrust_m_s2 =
        confine(thrust_product(NMPC_THRUST_PER_STEP2_S2, thrust_m_step2), NMPC_THRUST_MIN_M_S2, NMPC_THRUST_MAX_M_S2);
#if WITH_GUARD
    height->thrust_m_s2 = confine(guard_spend(&height->budget_m_s2, NMPC_THRUST_BUDGET_M_S2, NMPC_THRUST_GROWTH_M_S2,
                                              height->commanded_m_s2, height->thrust_m_s2),
                                  NMPC_THRUST_MIN_M_S2, NMPC_THRUST_MAX_M_S2);
    height->commanded_m_s2 = height->thrust_m_s2;
#endif
    height->command_m_step2 = height_vertical(height->share, height->thrust_m_s2);
    return is_limited;
}

#if WITH_THRUST_VECTOR
/* The horizontal acceleration that the thrust leaves beside the command of the height. */
NMPC_INLINE nmpc_real_t height_spare(const nmpc_height_t *height)
{
#if WITH_THRUST_GAIN
    const nmpc_real_t most_m_step2 = factor_product(NMPC_SPARE_THRUST_M_STEP2, height->gain);
#else
    const nmpc_real_t most_m_step2 = NMPC_SPARE_THRUST_M_STEP2;
#endif
    const nmpc_real_t vertical_m_step2 = height_lift(height, height->command_m_step2) + NMPC_GRAVITY_M_STEP2;
    nmpc_real_t spare_m_step2 =
        factor_product(most_m_step2, spare_chords[0][0]) - factor_product(vertical_m_step2, spare_chords[0][1]);
    int k;

    NMPC_UNROLL
    for (k = 1; k < NMPC_SPARE_CHORDS; k++) {
        const nmpc_real_t chord_m_step2 =
            factor_product(most_m_step2, spare_chords[k][0]) - factor_product(vertical_m_step2, spare_chords[k][1]);

        spare_m_step2 = (chord_m_step2 < spare_m_step2) ? chord_m_step2 : spare_m_step2;
    }
    /* Where the target's acceleration is known, so is the tilt that it takes. */
    if (height->target.memory <= (nmpc_real_t)0) {
        const nmpc_real_t known_m_step2 = factor_product(vertical_m_step2, NMPC_KNOWN_SPARE);

        spare_m_step2 = (spare_m_step2 < known_m_step2) ? known_m_step2 : spare_m_step2;
    }
    return (spare_m_step2 < NMPC_LEAST_SPARE_M_STEP2) ? NMPC_LEAST_SPARE_M_STEP2 : spare_m_step2;
}

#endif
