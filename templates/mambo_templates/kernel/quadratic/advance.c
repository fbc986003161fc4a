/* ---- Advance --------------------------------------------------------------------------------------------------------
 *
 * A control step, from what is known from the last one to what the next one will know.
 */

/* Begin with what is known from the last step. */
NMPC_INLINE void step_begin(nmpc_t *self, nmpc_step_t *step)
{
    step->observer = self->observer;
#if WITH_FEEDBACK
    step->feedback_rad[0] = (nmpc_real_t)0;
    step->feedback_rad[1] = (nmpc_real_t)0;
#endif
#if WITH_HEIGHT
    step->lies_on_floor = 0;
#endif
#if WITH_THRUST_VECTOR
    step->by_thrust = (unsigned int)self->active_limits & NMPC_LIMIT_THRUST;
#endif
    /* One by one: for an initialiser some compilers call memset. */
    step->limited->position_m[0] = (nmpc_real_t)0;
    step->limited->position_m[1] = (nmpc_real_t)0;
    step->limited->velocity_m_s[0] = (nmpc_real_t)0;
    step->limited->velocity_m_s[1] = (nmpc_real_t)0;
    step->was_limited = 0;
    step->by_limits = 0;
}

/* Predict the estimates at the next control step. */
NMPC_INLINE void step_predict(nmpc_t *self, nmpc_step_t *step)
{
    observer_predict(&step->observer, step->world_m_step2);
#if WITH_HEIGHT
    height_predict(&self->height, step->lies_on_floor);
#endif
    self->observer = step->observer;
    self->steps_blind = (unsigned char)step->steps_blind;
}

/* Take a control step. A null `state` stands for one that is not good, a null `target` for inputs that allow no new
 * command. */
#if WITH_HEIGHT
NMPC_SHARED void advance(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target)
#else
NMPC_INLINE void advance(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target)
#endif
{
    nmpc_step_t step;
    nmpc_target_t limited;

    step.limited = &limited;
    step.state = state;
    step.target = target;
    step_begin(self, &step);
    step_observe(self, &step);
    step_aim(self, &step);
    step_command(self, &step);
    step_predict(self, &step);
}
