/* ---- Command --------------------------------------------------------------------------------------------------------
 *
 * Along right and forward the minimum of the cost is the next command, from the errors
 *
 *     e = R (p - Tp),   v = R (v - T_s Tv),   w = R (d - drag v - A_T),   j = R J_T
 *
 * with R the rotation from x and y to right and forward; without drag its term is 0.
 */

/* Set `right` and `forward` to the components of a vector along x and y. */
NMPC_INLINE void turn_to_heading(const nmpc_attitude_t *attitude, nmpc_real_t x, nmpc_real_t y, nmpc_real_t *right,
                                 nmpc_real_t *forward)
{
    *right = sine_product(y, attitude->cosine) - sine_product(x, attitude->sine);
    *forward = sine_product(x, attitude->cosine) + sine_product(y, attitude->sine);
}

/* The largest move along an axis. */
NMPC_INLINE nmpc_real_t largest_move(const nmpc_t *self, const nmpc_step_t *step, int axis)
{
    nmpc_real_t most_m_step2 = self->bounds.command_m_step2[axis];

#if not WITH_HEIGHT
    (void)step;
#endif
#if WITH_TILT_GAIN
    most_m_step2 = factor_product(most_m_step2, tilt_gain_share(&self->tilt_gain, axis));
#endif
#if WITH_HEIGHT
    most_m_step2 = factor_product(most_m_step2, step->weight);
#endif
#if WITH_THRUST_VECTOR
    most_m_step2 = (step->left_m_step2 < most_m_step2) ? step->left_m_step2 : most_m_step2;
#endif
    return most_m_step2;
}

#if WITH_THRUST_VECTOR
/* Shorten a move, right and forward, to what the thrust leaves in its direction; say whether little is left. */
NMPC_INLINE void limit_to_thrust(nmpc_step_t *step, nmpc_real_t move_m_step2[2])
{
    const nmpc_square_t square = square_sum(move_m_step2[0], move_m_step2[1]);
    const nmpc_real_t planned_m_step2 = share_product(step->left_m_step2, NMPC_PLANNED_SHARE);

    step->by_thrust = 0U;
    if (square >= squared(planned_m_step2)) {
        step->by_thrust = NMPC_LIMIT_THRUST;
    }
    if (square >= squared(step->left_m_step2)) {
        const nmpc_real_t share = smaller(length_ratio(step->left_m_step2, inverse_root(square)), NMPC_ONE);

        move_m_step2[0] = share_product(move_m_step2[0], share);
        move_m_step2[1] = share_product(move_m_step2[1], share);
    }
}

#endif
/* Set the next command of the model to the minimum of the cost along both axes. */
NMPC_INLINE void minimize(nmpc_t *self, nmpc_step_t *step)
{
    nmpc_attitude_t *const attitude = &self->attitude;
    /* e, v, w, j, a, i, c and u, right and forward; the first three are those along x and y, turned. */
    nmpc_real_t state[2][NMPC_STATES];
    nmpc_real_t error[3][2]; /* e, v and w along x and y */
    nmpc_real_t move_m_step2[2];
    int axis;

#if WITH_THRUST_VECTOR
    step->left_m_step2 = to_move(height_spare(&self->height));
#endif
    NMPC_UNROLL
    for (axis = 0; axis < 2; axis++) {
        error[0][axis] = step->observer.position_m[axis] - step->aim->position_m[axis];
        error[1][axis] =
            step->observer.velocity_m_step[axis] - speed_product(NMPC_UPDATE_STEP_S, step->aim->velocity_m_s[axis]);
        error[2][axis] = observer_disturbance(&step->observer, axis);
        error[2][axis] = error[2][axis] - self->tracker.acceleration_m_step2[axis];
#if WITH_PREDICTED
        state[axis][4] = attitude->tilt_m_step2[axis];
#else
        state[axis][4] = step->tilt_m_step2[axis];
#endif
        state[axis][5] = attitude->integral_m_step2[axis];
        state[axis][6] = attitude->lagged_m_step2[axis];
        state[axis][7] = attitude->command_m_step2[axis];
    }
    NMPC_UNROLL
    for (axis = 0; axis < 3; axis++) {
        turn_to_heading(attitude, error[axis][0], error[axis][1], &state[NMPC_RIGHT][axis], &state[NMPC_FORWARD][axis]);
    }
    turn_to_heading(attitude, self->tracker.jerk_m_step2_update[0], self->tracker.jerk_m_step2_update[1],
                    &state[NMPC_RIGHT][3], &state[NMPC_FORWARD][3]);
    NMPC_UNROLL
    for (axis = 0; axis < 2; axis++) {
        move_m_step2[axis] = optimizer_minimize(axis, state[axis], largest_move(self, step, axis));
    }
#if WITH_THRUST_VECTOR
    limit_to_thrust(step, move_m_step2);
#endif
    attitude->command_m_step2[0] = move_acceleration(move_m_step2[0]);
    attitude->command_m_step2[1] = move_acceleration(move_m_step2[1]);
}

/* Set the angles that stand for the model's command. */
NMPC_INLINE void find_angles(const nmpc_t *self, nmpc_step_t *step)
{
#if WITH_HEIGHT
    const nmpc_real_t right_m_step2 = factor_product(self->attitude.command_m_step2[NMPC_RIGHT], step->inverse);
    const nmpc_real_t forward_m_step2 = factor_product(self->attitude.command_m_step2[NMPC_FORWARD], step->inverse);
#else
    const nmpc_real_t right_m_step2 = self->attitude.command_m_step2[NMPC_RIGHT];
    const nmpc_real_t forward_m_step2 = self->attitude.command_m_step2[NMPC_FORWARD];
#endif
#if WITH_THRUST_VECTOR
    nmpc_real_t command_rad[2];
#endif

#if WITH_THRUST_VECTOR
    vector_command(right_m_step2, forward_m_step2, command_rad);
    step->command_rad[0] = command_rad[0];
    step->command_rad[1] = command_rad[1];
#else
    step->command_rad[0] = attitude_roll(right_m_step2);
    step->command_rad[1] = attitude_pitch(forward_m_step2);
#endif
#if WITH_TILT_GAIN
    step->command_rad[0] = tilt_gain_sent(&self->tilt_gain, 0, step->command_rad[0]);
    step->command_rad[1] = tilt_gain_sent(&self->tilt_gain, 1, step->command_rad[1]);
#endif
}

/* Clamp an angle at the tilt limit. */
NMPC_INLINE nmpc_real_t limited_angle(const nmpc_t *self, nmpc_real_t angle_rad)
{
    const nmpc_real_t limit_rad = self->bounds.tilt_rad;

#if WITH_HEIGHT
    return shared_clamp(angle_rad, limit_rad);
#else
    return clamp(angle_rad, limit_rad);
#endif
}

/* Add rate feedback to the angles, and clamp them at the tilt limit. */
NMPC_INLINE void limit_angles(nmpc_t *self, nmpc_step_t *step)
{
#if WITH_ROLL_FEEDBACK
    step->command_rad[0] = step->command_rad[0] + step->feedback_rad[0];
#endif
#if WITH_PITCH_FEEDBACK
    step->command_rad[1] = step->command_rad[1] + step->feedback_rad[1];
#endif
    step->command_rad[0] = limited_angle(self, step->command_rad[0]);
    step->command_rad[1] = limited_angle(self, step->command_rad[1]);
}

/* Tell the attitude model that `after_rad` is sent in place of `before_rad`. */
static void replace_command(nmpc_t *self, const nmpc_real_t before_rad[2], const nmpc_real_t after_rad[2])
{
#if WITH_HEIGHT
    const nmpc_real_t weight = height_weight(height_lift(&self->height, self->height.command_m_step2));
#endif
#if WITH_TILT_GAIN and WITH_THRUST_VECTOR
    const nmpc_real_t meant_before_rad[2] = { tilt_gain_meant(&self->tilt_gain, 0, before_rad[0]),
                                              tilt_gain_meant(&self->tilt_gain, 1, before_rad[1]) };
    const nmpc_real_t meant_after_rad[2] = { tilt_gain_meant(&self->tilt_gain, 0, after_rad[0]),
                                             tilt_gain_meant(&self->tilt_gain, 1, after_rad[1]) };
#elif WITH_TILT_GAIN
    const nmpc_real_t roll_change_rad = tilt_gain_meant(&self->tilt_gain, 0, after_rad[0] - before_rad[0]);
    const nmpc_real_t pitch_change_rad = tilt_gain_meant(&self->tilt_gain, 1, after_rad[1] - before_rad[1]);
#elif not WITH_THRUST_VECTOR
    const nmpc_real_t roll_change_rad = after_rad[0] - before_rad[0];
    const nmpc_real_t pitch_change_rad = after_rad[1] - before_rad[1];
#endif

#if WITH_TILT_GAIN and WITH_THRUST_VECTOR
    attitude_change_command(&self->attitude, meant_before_rad, meant_after_rad, weight);
#elif WITH_THRUST_VECTOR
    attitude_change_command(&self->attitude, before_rad, after_rad, weight);
#elif WITH_HEIGHT
    attitude_change_command(&self->attitude, roll_change_rad, pitch_change_rad, weight);
#else
    attitude_change_command(&self->attitude, roll_change_rad, pitch_change_rad);
#endif
}

#if WITH_GUARD
/* Command the angles, but bound their change from the last commands, and tell the model what is commanded. */
NMPC_INLINE void guard_commands(nmpc_t *self, nmpc_step_t *step)
{
    const nmpc_real_t asked_rad[2] = { step->command_rad[0], step->command_rad[1] };
    int is_bounded = 0;
    int angle;

    for (angle = 0; angle < 2; angle++) {
        const nmpc_real_t allowed_rad = guard_spend(&self->budget_rad[angle], NMPC_TILT_BUDGET_RAD,
                                                    NMPC_TILT_GROWTH_RAD, self->command_rad[angle], asked_rad[angle]);

        self->command_rad[angle] = limited_angle(self, allowed_rad);
        is_bounded = is_bounded || (self->command_rad[angle] < asked_rad[angle])
                     || (self->command_rad[angle] > asked_rad[angle]);
    }
    if (is_bounded != 0) {
        replace_command(self, asked_rad, self->command_rad);
    }
}

#endif
#if WITH_FEEDBACK
/* Hold the last command, less its rate feedback: that is for the rate of one control step only. The level command after
 * an outage has none. */
NMPC_INLINE void hold_command(nmpc_t *self, nmpc_step_t *step)
{
    const int is_fed = (step->steps_blind < NMPC_NO_ESTIMATE) && (self->steps_blind == 0U);

    if (is_fed != 0) {
        find_angles(self, step);
#if WITH_ROLL_FEEDBACK
        self->command_rad[0] = limited_angle(self, step->command_rad[0]);
#endif
#if WITH_PITCH_FEEDBACK
        self->command_rad[1] = limited_angle(self, step->command_rad[1]);
#endif
    }
}

#endif
#if WITH_HEIGHT
/* Say which limits of the thrust act, beside those of the target. */
NMPC_INLINE void report_limits(nmpc_t *self, nmpc_step_t *step)
{
    /* Those of the target, whose bits are lower than that of the height. */
    unsigned int active = (unsigned int)self->active_limits % NMPC_LIMIT_HEIGHT;

    active = active + ((step->limit_active != 0) ? NMPC_LIMIT_HEIGHT : 0U);
#if WITH_THRUST_VECTOR
    active = active + step->by_thrust;
#endif
    self->active_limits = (unsigned char)active;
}

#endif
/* Command what flies to the aim; without one the last command holds. */
NMPC_INLINE void step_command(nmpc_t *self, nmpc_step_t *step)
{
    if (step->aim != NULL) {
        minimize(self, step);
        find_angles(self, step);
        limit_angles(self, step);
#if WITH_GUARD
        guard_commands(self, step);
#else
        self->command_rad[0] = step->command_rad[0];
        self->command_rad[1] = step->command_rad[1];
#endif
#if WITH_FEEDBACK
    } else {
        hold_command(self, step);
#endif
    }
#if WITH_HEIGHT
    report_limits(self, step);
#endif
}
