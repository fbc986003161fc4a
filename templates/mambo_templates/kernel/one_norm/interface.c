/* ---- Interface ------------------------------------------------------------------------------------------------------
 *
 * The functions of nmpc.h.
 */

static void clear_rollout(nmpc_rollout_t *rollout)
{
    rollout->error_m = (nmpc_real_t)0;
    rollout->displacement_m_step = (nmpc_real_t)0;
    rollout->acceleration_m_step2 = (nmpc_real_t)0;
#if WITH_LAG
    rollout->roll_deficit_m_step2 = (nmpc_real_t)0;
    rollout->pitch_deficit_m_step2 = (nmpc_real_t)0;
#endif
}

void nmpc_init(nmpc_t *self)
{
    int k;

    if (self == NULL) {
        return;
    }

#if WITH_LIMITS
    limits_init(self);
    self->active_limits = 0U;
    self->steps_blind = 0U;
#endif
    self->weights.tracking = NMPC_TRACKING_WEIGHT;
    self->weights.effort = NMPC_EFFORT_WEIGHT;
    clear_rollout(&self->prediction.x);
    clear_rollout(&self->prediction.y);
#if WITH_TRACKER
    tracker_clear(self);
#endif
    for (k = 0; k < NMPC_ANGLES; k++) {
        self->prediction.gain_x_m_step2_rad[k] = (nmpc_real_t)0;
        self->prediction.gain_y_m_step2_rad[k] = (nmpc_real_t)0;
        self->prediction.tilt_rad[k] = (nmpc_real_t)0;
        self->command_rad[k] = (nmpc_real_t)0;
#if WITH_FEEDBACK
        self->sent_rad[k] = (nmpc_real_t)0;
        self->tilt_rad[k] = (nmpc_real_t)0;
#endif
    }
    for (k = 0; k < NMPC_MOVES; k++) {
        self->plan_rad[k] = (nmpc_real_t)0;
        self->gradient[k] = (nmpc_sum_t)0;
    }
    self->cost = (nmpc_sum_t)0;
    self->iterations = 0U;
    self->converged = 0U;
#if WITH_FEEDBACK
    self->has_tilt = 0U;
#endif
}

/* Make a command the last one and every move of the plan, and forget the target. */
static void hold(nmpc_t *self, nmpc_real_t roll_rad, nmpc_real_t pitch_rad)
{
    self->command_rad[0] = roll_rad;
    self->command_rad[1] = pitch_rad;
#if WITH_FEEDBACK
    self->sent_rad[0] = roll_rad;
    self->sent_rad[1] = pitch_rad;
    self->has_tilt = 0U;
#endif
#if WITH_LIMITS
    self->active_limits = 0U;
    self->bounds.target_m_s[0] = (nmpc_real_t)0;
    self->bounds.target_m_s[1] = (nmpc_real_t)0;
    self->bounds.turn_m2_s2 = (nmpc_real_t)0;
#endif
    set_plan(self);
#if WITH_TRACKER
    tracker_clear(self);
#endif
}

nmpc_status_t nmpc_reset(nmpc_t *self, const nmpc_command_t *command)
{
    if ((self == NULL) || (command == NULL)) {
        return NMPC_NULL_POINTER;
    }
    if (!is_good_command(command)) {
        return NMPC_BAD_COMMAND;
    }

    hold(self, clamp(command->roll_rad, tilt_limit(self)), clamp(command->pitch_rad, tilt_limit(self)));
#if WITH_LIMITS
    self->steps_blind = 0U;
#endif
    return NMPC_OK;
}

nmpc_status_t nmpc_set_weights(nmpc_t *self, const nmpc_weights_t *weights)
{
    if ((self == NULL) || (weights == NULL)) {
        return NMPC_NULL_POINTER;
    }
    if (!(within(weights->tracking, NMPC_TRACKING_WEIGHT_LIMIT) && within(weights->effort, NMPC_EFFORT_WEIGHT_LIMIT)
          && (weights->tracking >= (nmpc_real_t)0) && (weights->effort >= (nmpc_real_t)0))) {
        return NMPC_BAD_WEIGHT;
    }

    self->weights = *weights;
    return NMPC_OK;
}

#if WITH_LIMITS
/* Count a bad state; after NMPC_OUTAGE_STEPS of them in a row the command is level. */
static void miss_state(nmpc_t *self)
{
    if (self->steps_blind < NMPC_OUTAGE_STEPS) {
        self->steps_blind++;
    }
    if (self->steps_blind == NMPC_OUTAGE_STEPS) {
        hold(self, (nmpc_real_t)0, (nmpc_real_t)0);
    }
}

#endif
nmpc_status_t nmpc_step(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target,
                        nmpc_real_t thrust_acceleration_m_s2, nmpc_command_t *command)
{
    nmpc_status_t status = NMPC_NULL_POINTER;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }
    if (self == NULL) {
        command->roll_rad = (nmpc_real_t)0;
        command->pitch_rad = (nmpc_real_t)0;
        return NMPC_NULL_POINTER;
    }

    if ((state != NULL) && (target != NULL)) {
        if (!is_good_state(state)) {
#if WITH_LIMITS
            miss_state(self);
#endif
            status = NMPC_BAD_STATE;
        } else if (!is_good_target(target)) {
            status = NMPC_BAD_TARGET;
        } else if (!is_good_thrust(thrust_acceleration_m_s2)) {
            status = NMPC_BAD_THRUST;
        } else {
            advance(self, state, target, thrust_acceleration_m_s2);
            status = NMPC_OK;
        }
    }
#if WITH_FEEDBACK
    if ((status != NMPC_OK) && (status != NMPC_NULL_POINTER)) {
        /* The rate passes: a held command is the first move alone. */
        self->sent_rad[0] = self->command_rad[0];
        self->sent_rad[1] = self->command_rad[1];
    }
    command->roll_rad = self->sent_rad[0];
    command->pitch_rad = self->sent_rad[1];
#else
    command->roll_rad = self->command_rad[0];
    command->pitch_rad = self->command_rad[1];
#endif
    return status;
}

nmpc_sum_t nmpc_last_cost(const nmpc_t *self)
{
    return self->cost;
}

int nmpc_last_iterations(const nmpc_t *self)
{
    return (int)self->iterations;
}

int nmpc_has_converged(const nmpc_t *self)
{
    return (int)self->converged;
}

int nmpc_is_saturated(const nmpc_t *self)
{
#if WITH_FEEDBACK
    const nmpc_real_t *const command_rad = self->sent_rad;
#else
    const nmpc_real_t *const command_rad = self->command_rad;
#endif

    return (reaches(command_rad[0], tilt_limit(self)) != 0) || (reaches(command_rad[1], tilt_limit(self)) != 0);
}

#if WITH_SHIFT
nmpc_status_t nmpc_frame_jumped(nmpc_t *self, const nmpc_real_t position_change_m[2],
                                const nmpc_real_t velocity_change_m_s[2], nmpc_real_t heading_change_rad)
#else
nmpc_status_t nmpc_frame_jumped(const nmpc_t *self, const nmpc_real_t position_change_m[2],
                                const nmpc_real_t velocity_change_m_s[2], nmpc_real_t heading_change_rad)
#endif
{
    if ((self == NULL) || (position_change_m == NULL) || (velocity_change_m_s == NULL)) {
        return NMPC_NULL_POINTER;
    }
    if ((is_good_point(position_change_m, velocity_change_m_s) == 0)
        || (within(heading_change_rad, NMPC_YAW_RANGE_RAD) == 0)) {
        return NMPC_BAD_JUMP;
    }

#if WITH_TRACKER
    tracker_shift(&self->tracker, velocity_change_m_s);
#endif
#if WITH_LIMITS
    limits_shift(&self->bounds, velocity_change_m_s);
#endif
#if WITH_TRACKER
    if (within(heading_change_rad, (nmpc_real_t)0) == 0) {
        nmpc_real_t sine;
        nmpc_real_t cosine;

        sine_cosine(heading_change_rad, &sine, &cosine);
        tracker_turn(self, sine, cosine);
    }
#endif
    return NMPC_OK;
}

const char *nmpc_version(void)
{
    return NMPC_VERSION " settings " NMPC_SETTINGS_DIGEST;
}
