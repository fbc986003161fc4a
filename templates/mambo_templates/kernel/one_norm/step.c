/* ---- Step -----------------------------------------------------------------------------------------------------------
 *
 * A control step: prepare the prediction at the measured state, optimise the plan from the initial guess, and take its
 * first moves as the command, u*_k.
 */

/* Set every move of the plan to the last command. */
static void set_plan(nmpc_t *self)
{
    int k;

    for (k = 0; k < NMPC_MOVES; k++) {
        self->plan_rad[k] = self->command_rad[k % NMPC_ANGLES];
    }
}

#if WITH_FEEDBACK
/* Set the command: the first moves, and what the rates of the attitude add since the last good step. */
static void add_feedback(nmpc_t *self, const nmpc_state_t *state)
{
    nmpc_real_t roll_rad = self->command_rad[0];
    nmpc_real_t pitch_rad = self->command_rad[1];

    if (self->has_tilt != 0U) {
        roll_rad = roll_rad + feedback_product(NMPC_ROLL_FEEDBACK_STEPS, state->roll_rad - self->tilt_rad[0]);
        pitch_rad = pitch_rad + feedback_product(NMPC_PITCH_FEEDBACK_STEPS, state->pitch_rad - self->tilt_rad[1]);
    }
    self->sent_rad[0] = clamp(roll_rad, tilt_limit(self));
    self->sent_rad[1] = clamp(pitch_rad, tilt_limit(self));
    self->tilt_rad[0] = state->roll_rad;
    self->tilt_rad[1] = state->pitch_rad;
    self->has_tilt = 1U;
}

#endif
/* Take a control step with good inputs. */
static void advance(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target,
                    nmpc_real_t thrust_acceleration_m_s2)
{
    const nmpc_target_t *aim = target;
#if WITH_LIMITS
    nmpc_target_t limited;
#endif

#if WITH_LIMITS
    self->steps_blind = 0U;
    if (limits_apply(self, state->position_m, target, &limited) != 0U) {
        aim = &limited;
    }
#endif
#if WITH_TRACKER
    tracker_update(self, aim->velocity_m_s);
#endif
#if WITH_HOVER
    (void)thrust_acceleration_m_s2;
    predictor_prepare(self, state, aim, NMPC_HOVER_M_S2);
#else
    predictor_prepare(self, state, aim, thrust_acceleration_m_s2);
#endif
#if WITH_WARM_PLAN
    /* The initial guess Omega_k is the previous plan, not shifted. */
#else
    /* The initial guess Omega_k: every move equals the last command. */
    set_plan(self);
#endif
    optimizer_minimize(self);
    /* u*_k is the first move of the plan. */
    self->command_rad[0] = self->plan_rad[0];
    self->command_rad[1] = self->plan_rad[1];
#if WITH_FEEDBACK
    add_feedback(self, state);
#endif
}
