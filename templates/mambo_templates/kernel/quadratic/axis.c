/* ---- Axis -----------------------------------------------------------------------------------------------------------
 *
 * What x, y and the height have in common: position p and velocity v along an axis. With a measured position r and
 * velocity v_k that are `age` steps old, and the acceleration A, the innovations are
 *
 *     n_p = r + age v - p,   n_v = T_s v_k + age A - v,
 *
 * and they correct p += L11 n_p + L12 n_v, v += L21 n_p + L22 n_v. To the next control step
 *
 *     p(k+1) = p + v + A/2,   v(k+1) = v + A.
 *
 * Without age its terms are 0. p and v are limited where they are predicted, so that they stay finite for any input.
 */

#include "axis.h"

/* Set `n` to the innovations of a measured position and velocity. */
NMPC_INLINE void axis_innovate(nmpc_real_t position_m, nmpc_real_t velocity_m_step, nmpc_real_t acceleration_m_step2,
                               nmpc_real_t measured_m, nmpc_real_t measured_m_step, nmpc_real_t n[2])
{
#if WITH_AGE
    n[0] = (measured_m + aged_position(NMPC_AGE_STEPS, velocity_m_step)) - position_m;
    n[1] = (measured_m_step + aged_velocity(NMPC_AGE_STEPS, acceleration_m_step2)) - velocity_m_step;
#else
    (void)acceleration_m_step2;
    n[0] = measured_m - position_m;
    n[1] = measured_m_step - velocity_m_step;
#endif
}

/* Correct position and velocity by the innovations `n`, with the first two rows of gains. */
NMPC_INLINE void axis_correct(nmpc_real_t *position_m, nmpc_real_t *velocity_m_step, const nmpc_real_t gains[][2],
                              const nmpc_real_t n[2])
{
    *position_m = *position_m + position_correction(gains[0][0], n[0], gains[0][1], n[1]);
    *velocity_m_step = *velocity_m_step + velocity_correction(gains[1][0], n[0], gains[1][1], n[1]);
}

/* Predict position and velocity at the next control step. */
NMPC_INLINE void axis_predict(nmpc_real_t *position_m, nmpc_real_t *velocity_m_step, nmpc_real_t acceleration_m_step2)
{
    const nmpc_real_t mean_m_step = *velocity_m_step + half_change(acceleration_m_step2);

    *position_m = clamp(*position_m + position_change(mean_m_step), NMPC_ESTIMATED_POSITION_LIMIT_M);
    *velocity_m_step = clamp(*velocity_m_step + velocity_change(acceleration_m_step2), NMPC_VELOCITY_LIMIT_M_STEP);
}

/* The frame has jumped, and the measured position and velocity with it. Measurements are `age` steps old, so a jump
 * of v also moves p by age * change. */
static void axis_shift(nmpc_real_t *position_m, nmpc_real_t *velocity_m_step, nmpc_real_t change_m,
                       nmpc_real_t change_m_step)
{
#if WITH_AGE
    const nmpc_real_t moved_m = change_m + aged_position(NMPC_AGE_STEPS, change_m_step);
#else
    const nmpc_real_t moved_m = change_m;
#endif

    *position_m = clamp(*position_m + moved_m, NMPC_ESTIMATED_POSITION_LIMIT_M);
    *velocity_m_step = clamp(*velocity_m_step + change_m_step, NMPC_VELOCITY_LIMIT_M_STEP);
}
