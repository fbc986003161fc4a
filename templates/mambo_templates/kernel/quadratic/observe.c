/* ---- Observe --------------------------------------------------------------------------------------------------------
 *
 * Where the drone is: the attitude model answers the last command; the heading turns it; the measured state corrects
 * the estimates. The observer is driven by the measured tilt, and by that of the model, a, while there is no good
 * state.
 */

#if WITH_HEIGHT
/* Measure the vertical share of the thrust; without a good state it is that of the last command. */
NMPC_INLINE void measure_direction(nmpc_t *self, nmpc_step_t *step)
{
#if WITH_THRUST_VECTOR
    nmpc_real_t slope[2];

    self->height.share = (step->state != NULL)
                             ? attitude_measure(step->state, slope)
                             : vector_point_command(self->command_rad[0], self->command_rad[1], slope);
    step->slope[0] = slope[0];
    step->slope[1] = slope[1];
#else
    self->height.share = height_tilt((step->state != NULL) ? step->state->roll_rad : self->command_rad[0],
                                     (step->state != NULL) ? step->state->pitch_rad : self->command_rad[1]);
#endif
}

#endif
/* Turn the model to the measured heading. */
NMPC_INLINE void measure_heading(nmpc_t *self, nmpc_step_t *step)
{
    if (step->state != NULL) {
        nmpc_real_t sine;
        nmpc_real_t cosine;

        sine_cosine(step->state->yaw_rad, &sine, &cosine);
        if (has_estimate(self) == 0) {
            self->attitude.sine = sine;
            self->attitude.cosine = cosine;
        } else {
            attitude_turn(&self->attitude, sine, cosine, step->target != NULL);
        }
    }
}

#if WITH_HEIGHT
/* Take the measured height into the estimates. */
NMPC_INLINE void measure_height(nmpc_t *self, nmpc_step_t *step)
{
    if (step->state != NULL) {
        step->lies_on_floor = height_measure(&self->height, step->state, has_estimate(self) == 0);
    }
}

#endif
/* Set the acceleration of the tilt: the measured one, or that of the model. */
NMPC_INLINE void measure_tilt(nmpc_t *self, nmpc_step_t *step)
{
    if (step->state != NULL) {
#if WITH_THRUST_VECTOR
        const nmpc_real_t slope[2] = { step->slope[0], step->slope[1] };
        nmpc_real_t tilt_m_step2[2];

        attitude_accelerate(slope, height_weight(height_lift(&self->height, self->height.thrust_m_step2)),
                            tilt_m_step2);
        step->tilt_m_step2[NMPC_RIGHT] = tilt_m_step2[NMPC_RIGHT];
        step->tilt_m_step2[NMPC_FORWARD] = tilt_m_step2[NMPC_FORWARD];
#elif WITH_HEIGHT
        attitude_measure(step->state, height_weight(height_lift(&self->height, self->height.thrust_m_step2)),
                         step->tilt_m_step2);
#else
        attitude_measure(step->state, step->tilt_m_step2);
#endif
    } else {
        step->tilt_m_step2[NMPC_RIGHT] = self->attitude.tilt_m_step2[NMPC_RIGHT];
        step->tilt_m_step2[NMPC_FORWARD] = self->attitude.tilt_m_step2[NMPC_FORWARD];
    }
}

#if WITH_TILT_GAIN
/* Learn how much the drone tilts, over what the model says; on the floor and after an outage the means start again. */
NMPC_INLINE void learn_tilt_gain(nmpc_t *self, nmpc_step_t *step)
{
    if (step->state != NULL) {
        const nmpc_real_t tilt_m_step2[2] = { step->tilt_m_step2[NMPC_RIGHT], step->tilt_m_step2[NMPC_FORWARD] };
        int restarts = (has_estimate(self) == 0);

#if WITH_HEIGHT
        restarts = (restarts != 0) || (step->state->on_ground != 0);
#endif
        if (restarts != 0) {
            tilt_gain_restart(&self->tilt_gain, &self->attitude, tilt_m_step2);
        } else {
            tilt_gain_learn(&self->tilt_gain, &self->attitude, tilt_m_step2, self->command_rad, self->bounds.tilt_rad);
        }
    }
}

#endif
/* Set the acceleration of the tilt along x and y. */
NMPC_INLINE void turn_to_world(nmpc_t *self, nmpc_step_t *step)
{
    const nmpc_attitude_t *const attitude = &self->attitude;

    step->world_m_step2[0] = sine_product(step->tilt_m_step2[NMPC_FORWARD], attitude->cosine)
                             - sine_product(step->tilt_m_step2[NMPC_RIGHT], attitude->sine);
    step->world_m_step2[1] = sine_product(step->tilt_m_step2[NMPC_RIGHT], attitude->cosine)
                             + sine_product(step->tilt_m_step2[NMPC_FORWARD], attitude->sine);
}

/* Correct position, velocity and disturbance by the measured state. */
NMPC_INLINE void correct_estimates(nmpc_t *self, nmpc_step_t *step)
{
    if (step->state != NULL) {
        if (has_estimate(self) == 0) {
            observer_start(&step->observer, step->state);
        } else {
#if WITH_GUARD
            observer_correct(&step->observer, step->state, (self->is_coarse != 0U) ? 1 : 0, step->world_m_step2);
#else
            observer_correct(&step->observer, step->state, 0, step->world_m_step2);
#endif
        }
    }
}

#if WITH_FEEDBACK
/* Set what rate feedback adds to the commands: the change of the measured angle since the last step, times a constant.
 * Its sign is positive: it takes damping off an attitude loop that has more than it needs, and so shortens its lag. It
 * is added after the minimisation, and a command that is held has none. */
NMPC_INLINE void measure_rates(nmpc_t *self, nmpc_step_t *step)
{
    if (step->state != NULL) {
        if (self->steps_blind == 0U) {
#if WITH_ROLL_FEEDBACK
            step->feedback_rad[0] =
                feedback_product(NMPC_ROLL_FEEDBACK_STEPS, step->state->roll_rad - self->tilt_rad[0]);
#endif
#if WITH_PITCH_FEEDBACK
            step->feedback_rad[1] =
                feedback_product(NMPC_PITCH_FEEDBACK_STEPS, step->state->pitch_rad - self->tilt_rad[1]);
#endif
        }
        self->tilt_rad[0] = step->state->roll_rad;
        self->tilt_rad[1] = step->state->pitch_rad;
    }
}

#endif
/* Count the control steps since the last good state. */
NMPC_INLINE void count_missed(nmpc_t *self, nmpc_step_t *step)
{
    if (step->state != NULL) {
        step->steps_blind = 0U;
    } else if (self->steps_blind < NMPC_NO_ESTIMATE) {
        step->steps_blind = (unsigned int)self->steps_blind + 1U;
    } else {
        step->steps_blind = self->steps_blind;
    }
}

/* Estimate where the drone is. */
NMPC_INLINE void step_observe(nmpc_t *self, nmpc_step_t *step)
{
    attitude_advance(&self->attitude);
#if WITH_HEIGHT
    height_advance(&self->height);
    measure_direction(self, step);
#endif
    measure_heading(self, step);
#if WITH_HEIGHT
    measure_height(self, step);
#endif
    measure_tilt(self, step);
#if WITH_TILT_GAIN
    learn_tilt_gain(self, step);
#endif
    turn_to_world(self, step);
    correct_estimates(self, step);
#if WITH_FEEDBACK
    measure_rates(self, step);
#endif
    count_missed(self, step);
}
