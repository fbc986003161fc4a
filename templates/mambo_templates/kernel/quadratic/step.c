/* ---- Step -----------------------------------------------------------------------------------------------------------
 *
 * What the functions of a control step know and hand on. A step begins, observes, aims, commands and predicts, in the
 * chapters that follow.
 */

/* `steps_blind` once good states have failed for longer than the outage that the estimate bridges: the drone brakes. */
#define NMPC_NO_ESTIMATE (NMPC_OUTAGE_STEPS + 1U)

/* `steps_blind` before the first good state, and when the model has come to rest after an outage. */
#define NMPC_AT_REST (NMPC_OUTAGE_STEPS + 2U)

/* What the functions of a control step hand on to each other. */
typedef struct {
    const nmpc_state_t *state;    /* null if it is not good */
    const nmpc_target_t *target;  /* null if the inputs allow no new command */
    const nmpc_target_t *aim;     /* what the next command flies to; null if the last one holds */
    nmpc_observer_t observer;     /* a copy, which the compiler can keep in registers */
    unsigned int steps_blind;     /* control steps since the last good state */
    nmpc_real_t tilt_m_step2[2];  /* acceleration of the tilt, right and forward */
    nmpc_real_t world_m_step2[2]; /* the same along x and y */
    nmpc_real_t command_rad[2];   /* the angles that stand for the model's command */
    /* The target within the limits. */
    nmpc_target_t *limited;
#if WITH_FEEDBACK
    /* What rate feedback adds to the commands. */
    nmpc_real_t feedback_rad[2];
#endif
    /* 1 if a limit of speed, braking or place acted in the step before, else 0. */
    int was_limited;
    /* 1 if A_T and J_T are those of the velocity within the limits, else 0. */
    int by_limits;
#if WITH_HEIGHT
    /* The acceleration of a tilt over that in hover, with the next thrust; 1 over it; 1 on the floor, else 0. */
    nmpc_real_t weight;
    nmpc_real_t inverse;
    int lies_on_floor;
    /* 1 if a limit of the height acts, else 0. */
    int limit_active;
#endif
#if WITH_THRUST_VECTOR
    /* The slopes of the thrust, right and forward; the longest move that it leaves. */
    nmpc_real_t slope[2];
    nmpc_real_t left_m_step2;
    /* NMPC_LIMIT_THRUST if the move takes the planned share of that, else 0. */
    unsigned int by_thrust;
#endif
} nmpc_step_t;

/* Whether there was an estimate before this control step. */
NMPC_INLINE int has_estimate(const nmpc_t *self)
{
    return self->steps_blind < NMPC_NO_ESTIMATE;
}
