/* SPDX-License-Identifier: MIT-0
 *
 * Target tracker: the target's acceleration and its rate, estimated by an alpha-beta filter (not in the paper).
 */
#include "nmpc_tracker.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

void nmpc_tracker_clear(nmpc_t *self)
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        self->tracker.velocity_m_s[axis] = (nmpc_real_t)0;
        self->tracker.acceleration_m_step2[axis] = (nmpc_real_t)0;
        self->tracker.jerk_m_step2_update[axis] = (nmpc_real_t)0;
    }
    self->has_target = 0U;
}

/* Take the acceleration of the target along `axis` in this control step into the estimates. */
static void correct(nmpc_tracker_t *tracker, int axis, nmpc_real_t measured_m_step2)
{
    const nmpc_real_t predicted_m_step2 = tracker->acceleration_m_step2[axis] + tracker->jerk_m_step2_update[axis];
    const nmpc_real_t difference_m_step2 = measured_m_step2 - predicted_m_step2;

    tracker->acceleration_m_step2[axis] =
        nmpc_clamp(predicted_m_step2 + nmpc_tracker_product(NMPC_TRACKER_GAIN, difference_m_step2),
                   NMPC_TARGET_ACCELERATION_LIMIT_M_STEP2);
    tracker->jerk_m_step2_update[axis] =
        nmpc_clamp(tracker->jerk_m_step2_update[axis]
                       + nmpc_tracker_product(NMPC_TRACKER_JERK_GAIN, difference_m_step2),
                   NMPC_TARGET_JERK_LIMIT_M_STEP2_UPDATE);
}

void nmpc_tracker_update(nmpc_t *self, const nmpc_real_t velocity_m_s[2])
{
    nmpc_tracker_t *const tracker = &self->tracker;
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t change_m_s = velocity_m_s[axis] - tracker->velocity_m_s[axis];
        const int is_steady = nmpc_within(change_m_s, NMPC_TARGET_CHANGE_LIMIT_M_S);

        if ((self->has_target != 0U) && (is_steady != 0)) {
            /* The clamp changes nothing: it tells a proof by intervals how large the change is. */
            const nmpc_real_t steady_m_s = nmpc_clamp(change_m_s, NMPC_TARGET_CHANGE_LIMIT_M_S);

            correct(tracker, axis, nmpc_target_product(NMPC_STEP_SQUARED_PER_UPDATE_S, steady_m_s));
        } else {
            /* The first velocity, or a jump: the acceleration stays. */
            tracker->jerk_m_step2_update[axis] = (nmpc_real_t)0;
        }
        tracker->velocity_m_s[axis] = velocity_m_s[axis];
    }
    self->has_target = 1U;
}
