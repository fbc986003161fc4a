/* ---- Observer -------------------------------------------------------------------------------------------------------
 *
 * A Kalman filter with fixed gains for position, velocity and disturbance (not in the paper). Index k counts control
 * steps, which are the unit of time here: m_step is m/T_s and m_step2 is m/T_s^2. Along x and y, let p, v and d be the
 * estimates of position, velocity and disturbance: the acceleration that tilt and drag do not explain, as wind and
 * model errors make it. p and v are corrected and predicted as in the chapter axis, with A = a + d - drag v, where a is
 * the acceleration of the tilt; without drag its term is 0. The disturbance is corrected too, and lasts:
 *
 *     d += L31 n_p + L32 n_v,   d(k+1) = d.
 *
 * The gains L are those of the stationary Kalman filter for the noise densities of the settings. d is limited.
 */

#include "observer.h"

/* The acceleration along `axis` that the tilt does not explain: d - drag v. */
NMPC_INLINE nmpc_real_t observer_disturbance(const nmpc_observer_t *observer, int axis)
{
#if WITH_DRAG
    return observer->disturbance_m_step2[axis] - drag_product(NMPC_DRAG_1_STEP, observer->velocity_m_step[axis]);
#else
    return observer->disturbance_m_step2[axis];
#endif
}

/* Set position and velocity to the measured ones. The disturbance stays. */
NMPC_INLINE void observer_start(nmpc_observer_t *observer, const nmpc_state_t *state)
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        observer->position_m[axis] = state->position_m[axis];
        observer->velocity_m_step[axis] = speed_product(NMPC_UPDATE_STEP_S, state->velocity_m_s[axis]);
    }
}

/* Correct the estimates by a measured state, with the gains number `which`: 0, or 1 where there are two and
 * no position is measured. `tilt_m_step2` is the acceleration of the tilt along x and y. */
NMPC_INLINE void observer_correct(nmpc_observer_t *observer, const nmpc_state_t *state, int which,
                                  const nmpc_real_t tilt_m_step2[2])
{
    int axis;

    NMPC_UNROLL
    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t acceleration_m_step2 = tilt_m_step2[axis] + observer_disturbance(observer, axis);
        const nmpc_real_t measured_m_step = speed_product(NMPC_UPDATE_STEP_S, state->velocity_m_s[axis]);
        nmpc_real_t n[2];
        nmpc_real_t disturbance_m_step2;

        axis_innovate(observer->position_m[axis], observer->velocity_m_step[axis], acceleration_m_step2,
                      state->position_m[axis], measured_m_step, n);
        axis_correct(&observer->position_m[axis], &observer->velocity_m_step[axis], observer_gains[which], n);
        disturbance_m_step2 =
            observer->disturbance_m_step2[axis]
            + disturbance_correction(observer_gains[which][2][0], n[0], observer_gains[which][2][1], n[1]);
#if WITH_HEIGHT
        observer->disturbance_m_step2[axis] = shared_clamp(disturbance_m_step2, NMPC_DISTURBANCE_LIMIT_M_STEP2);
#else
        observer->disturbance_m_step2[axis] = clamp(disturbance_m_step2, NMPC_DISTURBANCE_LIMIT_M_STEP2);
#endif
    }
}

/* Predict the estimates at the next control step; `tilt_m_step2` is the acceleration of the tilt along x and y. */
NMPC_INLINE void observer_predict(nmpc_observer_t *observer, const nmpc_real_t tilt_m_step2[2])
{
    int axis;

    NMPC_UNROLL
    for (axis = 0; axis < 2; axis++) {
        axis_predict(&observer->position_m[axis], &observer->velocity_m_step[axis],
                     tilt_m_step2[axis] + observer_disturbance(observer, axis));
    }
}

/* The frame has jumped. The acceleration that the tilt does not explain has not: d takes up what the change of v does
 * to the drag. */
static void observer_shift(nmpc_observer_t *observer, const nmpc_real_t position_change_m[],
                           const nmpc_real_t velocity_change_m_s[])
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t change_m_step = speed_product(NMPC_UPDATE_STEP_S, velocity_change_m_s[axis]);

        axis_shift(&observer->position_m[axis], &observer->velocity_m_step[axis], position_change_m[axis],
                   change_m_step);
#if WITH_DRAG
        observer->disturbance_m_step2[axis] =
            clamp(observer->disturbance_m_step2[axis] + drag_product(NMPC_DRAG_1_STEP, change_m_step),
                  NMPC_DISTURBANCE_LIMIT_M_STEP2);
#endif
    }
}

/* The frame has turned: so does the acceleration that the tilt does not explain. */
static void observer_turn(nmpc_observer_t *observer, nmpc_real_t sine, nmpc_real_t cosine)
{
    nmpc_real_t turned_m_step2[2];
    int axis;

    turned_m_step2[0] = observer_disturbance(observer, 0);
    turned_m_step2[1] = observer_disturbance(observer, 1);
    turn_vector(turned_m_step2, sine, cosine);
    for (axis = 0; axis < 2; axis++) {
#if WITH_DRAG
        const nmpc_real_t change_m_step2 = turned_m_step2[axis] - observer_disturbance(observer, axis);

        observer->disturbance_m_step2[axis] =
            clamp(observer->disturbance_m_step2[axis] + change_m_step2, NMPC_DISTURBANCE_LIMIT_M_STEP2);
#else
        observer->disturbance_m_step2[axis] = clamp(turned_m_step2[axis], NMPC_DISTURBANCE_LIMIT_M_STEP2);
#endif
    }
}

/* Forget the estimates: position, velocity and disturbance are 0. */
static void observer_clear(nmpc_observer_t *observer)
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        observer->position_m[axis] = (nmpc_real_t)0;
        observer->velocity_m_step[axis] = (nmpc_real_t)0;
        observer->disturbance_m_step2[axis] = (nmpc_real_t)0;
    }
}
