/* ---- Interface ------------------------------------------------------------------------------------------------------
 *
 * The functions of nmpc.h.
 */

/* Forget everything that was measured; the drone holds a command within its limits. */
static void restart(nmpc_t *self, const nmpc_command_t *command)
{
    self->command_rad[0] = command->roll_rad;
    self->command_rad[1] = command->pitch_rad;
#if WITH_FEEDBACK
    self->tilt_rad[0] = (nmpc_real_t)0;
    self->tilt_rad[1] = (nmpc_real_t)0;
#endif
    self->active_limits = 0U;
#if WITH_GUARD
    self->budget_rad[0] = NMPC_TILT_BUDGET_RAD;
    self->budget_rad[1] = NMPC_TILT_BUDGET_RAD;
    self->is_coarse = 0U;
#endif
    self->steps_blind = NMPC_AT_REST;
#if WITH_HEIGHT
    height_reset(&self->height, command->thrust_m_s2, command->roll_rad, command->pitch_rad);
    attitude_reset(&self->attitude, command->roll_rad, command->pitch_rad,
                   height_weight(height_lift(&self->height, self->height.command_m_step2)));
#else
    attitude_reset(&self->attitude, command->roll_rad, command->pitch_rad);
#endif
    observer_clear(&self->observer);
#if WITH_TILT_GAIN
    tilt_gain_clear(&self->tilt_gain);
#endif
    tracker_clear(self);
}

void nmpc_init(nmpc_t *self)
{
    nmpc_command_t level;

    if (self == NULL) {
        return;
    }

    level.roll_rad = (nmpc_real_t)0;
    level.pitch_rad = (nmpc_real_t)0;
#if WITH_HEIGHT
    level.thrust_m_s2 = NMPC_HOVER_M_S2;
#endif
    limits_init(self);
    restart(self, &level);
}

/* A command within the tilt limit. */
static nmpc_command_t limited_command(const nmpc_t *self, const nmpc_command_t *command)
{
    nmpc_command_t limited = *command;

    limited.roll_rad = clamp(command->roll_rad, self->bounds.tilt_rad);
    limited.pitch_rad = clamp(command->pitch_rad, self->bounds.tilt_rad);
    return limited;
}

nmpc_status_t nmpc_reset(nmpc_t *self, const nmpc_command_t *command)
{
    nmpc_command_t limited;

    if ((self == NULL) || (command == NULL)) {
        return NMPC_NULL_POINTER;
    }
    if (!is_good_command(command)) {
        return NMPC_BAD_COMMAND;
    }

    limited = limited_command(self, command);
    restart(self, &limited);
    return NMPC_OK;
}

nmpc_status_t nmpc_report_command(nmpc_t *self, const nmpc_command_t *command)
{
    nmpc_real_t given_rad[2];

    if ((self == NULL) || (command == NULL)) {
        return NMPC_NULL_POINTER;
    }
    if (!is_good_command(command)) {
        return NMPC_BAD_COMMAND;
    }

    given_rad[0] = clamp(command->roll_rad, self->bounds.tilt_rad);
    given_rad[1] = clamp(command->pitch_rad, self->bounds.tilt_rad);
#if WITH_HEIGHT
    height_set_thrust(&self->height, command->thrust_m_s2);
#endif
#if WITH_HEIGHT and WITH_GUARD
    self->height.commanded_m_s2 = self->height.thrust_m_s2;
#endif
    replace_command(self, self->command_rad, given_rad);
    self->command_rad[0] = given_rad[0];
    self->command_rad[1] = given_rad[1];
    return NMPC_OK;
}

#if WITH_HEIGHT
nmpc_status_t nmpc_report_thrust(nmpc_t *self, nmpc_real_t thrust_m_s2)
{
    if (self == NULL) {
        return NMPC_NULL_POINTER;
    }
    if (is_good_thrust(thrust_m_s2) == 0) {
        return NMPC_BAD_THRUST;
    }

    height_set_thrust(&self->height, thrust_m_s2);
    return NMPC_OK;
}

#endif
#if WITH_GUARD
nmpc_status_t nmpc_set_position_measured(nmpc_t *self, int is_measured)
{
    if (self == NULL) {
        return NMPC_NULL_POINTER;
    }

    self->is_coarse = (unsigned char)((is_measured != 0) ? 0U : 1U);
    return NMPC_OK;
}

#endif
#if WITH_HEIGHT
nmpc_status_t nmpc_step(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target, nmpc_command_t *command)
#else
nmpc_status_t nmpc_step(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target,
                        nmpc_real_t thrust_acceleration_m_s2, nmpc_command_t *command)
#endif
{
    nmpc_status_t status = NMPC_NULL_POINTER;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }
    if (self == NULL) {
        command->roll_rad = (nmpc_real_t)0;
        command->pitch_rad = (nmpc_real_t)0;
#if WITH_HEIGHT
        command->thrust_m_s2 = NMPC_HOVER_M_S2;
#endif
        return NMPC_NULL_POINTER;
    }

    if ((state != NULL) && (target != NULL)) {
        const nmpc_state_t *good_state = state;
        const nmpc_target_t *good_target = target;

        status = NMPC_OK;
#if not WITH_HEIGHT
        if (is_good_thrust(thrust_acceleration_m_s2) == 0) {
            status = NMPC_BAD_THRUST;
            good_target = NULL;
        }
#endif
        if (is_good_target(target) == 0) {
            status = NMPC_BAD_TARGET;
            good_target = NULL;
        }
        if (is_good_state(state) == 0) {
            status = NMPC_BAD_STATE;
            good_state = NULL;
        }
        advance(self, good_state, good_target);
    }
    command->roll_rad = self->command_rad[0];
    command->pitch_rad = self->command_rad[1];
#if WITH_HEIGHT
    command->thrust_m_s2 = self->height.thrust_m_s2;
#endif
    return status;
}

/* The angle, roll or pitch, that stands for a move along `axis`. */
static nmpc_real_t angle_of_move(const nmpc_t *self, int axis, nmpc_real_t move_m_step2)
{
    const nmpc_real_t acceleration_m_step2 = move_acceleration(move_m_step2);
    nmpc_real_t angle_rad;
#if WITH_THRUST_VECTOR
    nmpc_real_t command_rad[2];

    vector_command((axis == NMPC_RIGHT) ? acceleration_m_step2 : (nmpc_real_t)0,
                   (axis == NMPC_RIGHT) ? (nmpc_real_t)0 : acceleration_m_step2, command_rad);
    angle_rad = command_rad[axis];
#else

    angle_rad = (axis == NMPC_RIGHT) ? attitude_roll(acceleration_m_step2) : attitude_pitch(acceleration_m_step2);
#endif
#if WITH_TILT_GAIN
    angle_rad = tilt_gain_sent(&self->tilt_gain, axis, angle_rad);
#endif
#if WITH_THRUST_VECTOR or WITH_TILT_GAIN
    return clamp(angle_rad, self->bounds.tilt_rad);
#else
    (void)self;
    return angle_rad;
#endif
}

int nmpc_is_saturated(const nmpc_t *self)
{
    /* The largest moves; with a trim their commands lie closer to level on one side. */
#if WITH_TILT_GAIN
    const nmpc_real_t right_m_step2 =
        factor_product(self->bounds.command_m_step2[NMPC_RIGHT], tilt_gain_share(&self->tilt_gain, NMPC_RIGHT));
    const nmpc_real_t forward_m_step2 =
        factor_product(self->bounds.command_m_step2[NMPC_FORWARD], tilt_gain_share(&self->tilt_gain, NMPC_FORWARD));
#else
    const nmpc_real_t right_m_step2 = self->bounds.command_m_step2[NMPC_RIGHT];
    const nmpc_real_t forward_m_step2 = self->bounds.command_m_step2[NMPC_FORWARD];
#endif

    return (self->command_rad[0] >= angle_of_move(self, NMPC_RIGHT, right_m_step2))
           || (self->command_rad[0] <= angle_of_move(self, NMPC_RIGHT, -right_m_step2))
           || (self->command_rad[1] >= angle_of_move(self, NMPC_FORWARD, -forward_m_step2))
           || (self->command_rad[1] <= angle_of_move(self, NMPC_FORWARD, forward_m_step2));
}

nmpc_status_t nmpc_last_estimate(const nmpc_t *self, nmpc_estimate_t *estimate)
{
    int axis;

    if ((self == NULL) || (estimate == NULL)) {
        return NMPC_NULL_POINTER;
    }

    for (axis = 0; axis < 2; axis++) {
        estimate->position_m[axis] = self->observer.position_m[axis];
        estimate->velocity_m_s[axis] = per_step_product(NMPC_STEPS_PER_S, self->observer.velocity_m_step[axis]);
        estimate->disturbance_m_s2[axis] =
            per_step2_product(NMPC_STEPS2_PER_S2, self->observer.disturbance_m_step2[axis]);
    }
#if WITH_HEIGHT
    estimate->height_m = self->height.height_m;
    estimate->climb_m_s = per_step_product(NMPC_STEPS_PER_S, self->height.velocity_m_step);
#endif
#if WITH_THRUST_GAIN
    estimate->thrust_gain = self->height.gain;
#elif WITH_LIFT
    estimate->lift_m_s2 = per_step2_product(NMPC_STEPS2_PER_S2, self->height.disturbance_m_step2);
#endif
#if WITH_TILT_GAIN
    estimate->roll_gain = self->tilt_gain.gain[0];
    estimate->pitch_gain = self->tilt_gain.gain[1];
#endif
    estimate->is_valid = has_estimate(self);
    return NMPC_OK;
}

#if WITH_HEIGHT
nmpc_status_t nmpc_frame_jumped(nmpc_t *self, const nmpc_real_t position_change_m[3],
                                const nmpc_real_t velocity_change_m_s[3], nmpc_real_t heading_change_rad)
#else
nmpc_status_t nmpc_frame_jumped(nmpc_t *self, const nmpc_real_t position_change_m[2],
                                const nmpc_real_t velocity_change_m_s[2], nmpc_real_t heading_change_rad)
#endif
{
    if ((self == NULL) || (position_change_m == NULL) || (velocity_change_m_s == NULL)) {
        return NMPC_NULL_POINTER;
    }
    if ((is_good_point(position_change_m, velocity_change_m_s) == 0)
#if WITH_HEIGHT
        || (within(position_change_m[2], NMPC_POSITION_RANGE_M) == 0)
        || (within(velocity_change_m_s[2], NMPC_VELOCITY_RANGE_M_S) == 0)
#endif
        || (within(heading_change_rad, NMPC_YAW_RANGE_RAD) == 0)) {
        return NMPC_BAD_JUMP;
    }

    observer_shift(&self->observer, position_change_m, velocity_change_m_s);
#if WITH_HEIGHT
    height_shift(&self->height, position_change_m[2], velocity_change_m_s[2]);
#endif
    tracker_shift(&self->tracker, velocity_change_m_s);
    if (within(heading_change_rad, (nmpc_real_t)0) == 0) {
        nmpc_real_t sine;
        nmpc_real_t cosine;

        sine_cosine(heading_change_rad, &sine, &cosine);
        attitude_shift(&self->attitude, sine, cosine);
        observer_turn(&self->observer, sine, cosine);
        tracker_turn(self, sine, cosine);
    }
    return NMPC_OK;
}

const char *nmpc_version(void)
{
    return NMPC_VERSION " settings " NMPC_SETTINGS_DIGEST;
}
