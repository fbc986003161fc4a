/* ---- Aim ------------------------------------------------------------------------------------------------------------
 *
 * What the next command flies to: the target, within the limits, or rest after an outage. Without either the last
 * command holds.
 */

#if WITH_HEIGHT
/* Set the next thrust, and what it makes of a tilt. The height has limits of its own, and comes first. */
NMPC_INLINE void command_thrust(nmpc_t *self, nmpc_step_t *step)
{
    step->limit_active = height_aim(self, step->state, step->aim);
    step->weight = height_weight(height_lift(&self->height, self->height.command_m_step2));
    step->inverse = weight_inverse(step->weight);
}

#endif
/* Aim at the target within the limits. At a wall, and at a slow target, A_T and J_T are those of v_d. */
NMPC_INLINE void limit_target(nmpc_t *self, nmpc_step_t *step)
{
    const nmpc_real_t position_m[2] = { step->observer.position_m[0], step->observer.position_m[1] };
    unsigned int active;

#if WITH_HEIGHT
    step->was_limited = (self->has_target != 0U) && (((unsigned int)self->active_limits % NMPC_LIMIT_HEIGHT) != 0U);
#else
    step->was_limited = (self->has_target != 0U) && (self->active_limits != 0U);
#endif
    active = limits_apply(self, position_m, step->aim, step->limited);
    if (active != 0U) {
        if (((active & NMPC_LIMIT_FENCE) != 0U) || (limits_are_slow(&self->bounds, step->aim) != 0)) {
            step->by_limits = 1;
        }
        step->aim = step->limited;
    }
}

/* Estimate how a target moves; where its velocity alone is known, the estimated one stands for it. */
NMPC_INLINE void observe_target(nmpc_t *self, nmpc_step_t *step, const nmpc_target_t *target)
{
    tracker_update(self, target);
    if (step->aim != target) {
        tracker_follow(&self->tracker, step->aim->velocity_m_s, step->was_limited, step->by_limits);
    } else if (target->known == 0) {
        step->limited->position_m[0] = target->position_m[0];
        step->limited->position_m[1] = target->position_m[1];
        step->limited->velocity_m_s[0] = self->tracker.axis[0].velocity_m_s;
        step->limited->velocity_m_s[1] = self->tracker.axis[1].velocity_m_s;
        step->aim = step->limited;
    } else {
        /* The target is known as it is. */
    }
}

/* After an outage: brake by the model's velocity, and command level attitude once the model is at rest. */
NMPC_INLINE void end_outage(nmpc_t *self, nmpc_step_t *step)
{
    tracker_clear(self);
#if WITH_HEIGHT
    height_clear_target(&self->height);
#endif
#if WITH_THRUST_VECTOR
    step->by_thrust = 0U;
#endif
    if ((within(step->observer.velocity_m_step[0], NMPC_REST_M_STEP) != 0)
        && (within(step->observer.velocity_m_step[1], NMPC_REST_M_STEP) != 0)) {
        self->command_rad[0] = (nmpc_real_t)0;
        self->command_rad[1] = (nmpc_real_t)0;
#if WITH_HEIGHT
        attitude_set_command(&self->attitude, (nmpc_real_t)0, (nmpc_real_t)0, step->weight);
#else
        attitude_set_command(&self->attitude, (nmpc_real_t)0, (nmpc_real_t)0);
#endif
        self->active_limits = 0U;
        step->steps_blind = NMPC_AT_REST;
    } else {
        step->limited->position_m[0] = step->observer.position_m[0];
        step->limited->position_m[1] = step->observer.position_m[1];
        self->active_limits = (unsigned char)NMPC_LIMIT_BRAKING;
        step->aim = step->limited;
    }
}

/* Choose what the next command flies to. */
NMPC_INLINE void step_aim(nmpc_t *self, nmpc_step_t *step)
{
    step->aim = (step->steps_blind < NMPC_NO_ESTIMATE) ? step->target : NULL;
#if WITH_HEIGHT
    command_thrust(self, step);
#endif
    if (step->steps_blind == NMPC_NO_ESTIMATE) {
        end_outage(self, step);
    } else if (step->aim != NULL) {
        const nmpc_target_t *const target = step->aim;

        limit_target(self, step);
        observe_target(self, step, target);
    } else {
        /* The last command holds. */
    }
}
