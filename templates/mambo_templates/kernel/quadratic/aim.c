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
/* Aim at the target within the limits. */
NMPC_INLINE void limit_target(nmpc_t *self, nmpc_step_t *step)
{
    const nmpc_real_t position_m[2] = { step->observer.position_m[0], step->observer.position_m[1] };

#if WITH_TARGET_OBSERVER and WITH_HEIGHT
    step->was_limited = ((unsigned int)self->limited % NMPC_LIMIT_HEIGHT) != 0U;
#elif WITH_TARGET_OBSERVER
    step->was_limited = self->limited != 0U;
#endif
    if (limits_apply(self, position_m, step->aim, step->limited) != 0U) {
        step->aim = step->limited;
    }
}

#if WITH_TARGET_OBSERVER
/* Estimate how a target moves; where its velocity alone is known, the estimated one stands for it. */
NMPC_INLINE void observe_target(nmpc_t *self, nmpc_step_t *step, const nmpc_target_t *target)
{
    tracker_update(self, target, step->aim, step->was_limited);
    if ((step->aim == target) && (target->known == 0)) {
        step->limited->position_m[0] = target->position_m[0];
        step->limited->position_m[1] = target->position_m[1];
        step->limited->velocity_m_s[0] = self->tracker.axis[0].velocity_m_s;
        step->limited->velocity_m_s[1] = self->tracker.axis[1].velocity_m_s;
        step->aim = step->limited;
    }
}

#elif WITH_TRACKER
/* Estimate how the target moves. */
NMPC_INLINE void track_target(nmpc_t *self, nmpc_step_t *step)
{
    tracker_update(self, step->aim->velocity_m_s);
}

#endif
/* After an outage: brake by the model's velocity, and command level attitude once the model is at rest. */
NMPC_INLINE void end_outage(nmpc_t *self, nmpc_step_t *step)
{
#if WITH_TARGET_MOTION
    tracker_clear(self);
#endif
#if WITH_TARGET_MOTION and WITH_HEIGHT
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
        self->limited = 0U;
        step->missed = NMPC_AT_REST;
    } else {
        step->limited->position_m[0] = step->observer.position_m[0];
        step->limited->position_m[1] = step->observer.position_m[1];
        self->limited = (unsigned char)NMPC_LIMIT_BRAKING;
        step->aim = step->limited;
    }
}

/* Choose what the next command flies to. */
NMPC_INLINE void step_aim(nmpc_t *self, nmpc_step_t *step)
{
    step->aim = (step->missed < NMPC_NO_ESTIMATE) ? step->target : NULL;
#if WITH_HEIGHT
    command_thrust(self, step);
#endif
    if (step->missed == NMPC_NO_ESTIMATE) {
        end_outage(self, step);
    } else if (step->aim != NULL) {
#if WITH_TARGET_OBSERVER
        const nmpc_target_t *const target = step->aim;

#endif
        limit_target(self, step);
#if WITH_TARGET_OBSERVER
        observe_target(self, step, target);
#elif WITH_TRACKER
        track_target(self, step);
#endif
    } else {
        /* The last command holds. */
    }
}
