/* ---- Predictor ------------------------------------------------------------------------------------------------------
 *
 * The error between drone and target over the horizon, for given moves (eqs 8-11).
 *
 * Index i counts prediction steps of length tau from the present control step k on: the paper writes k + i in
 * eq 12. Along one axis, x or y, let r, v and a be position, velocity and acceleration of the drone, a being linear
 * in roll and pitch by eq 8; let Tp and Tv be position and velocity of the target, and e = r - Tp the error. Eq 12a
 * prints Tp_k; here the target is propagated by eq 11. Eqs 9 and 11, and the velocity for constant acceleration over
 * a step, which the paper does not print, are
 *
 *     r(i+1) = r(i) + tau v(i) + s tau^2 a(i),   v(i+1) = v(i) + tau a(i),   Tp(i+1) = Tp(i) + tau Tv
 *
 * with s = 1/2 if the position is exact, or s = 1/(2 tau) for tau/2, which eq 9 prints. So the displacement
 * d(i) = e(i+1) - e(i) is tau (v(i) - Tv) + s A(i), with A = tau^2 a, and
 *
 *     e(i+1) = e(i) + d(i),   d(i+1) = d(i) + A(i) + s dA(i+1),   dA(i+1) = A(i+1) - A(i).
 */

#if WITH_TRACKER
/* Eq 11 has a target of constant velocity. Here it also has the acceleration a_T that the tracker estimates, held
 * over the horizon, and moves by the equations of r and v: then A is tau^2 (a - a_T), and dA is the same. So the
 * roll-out starts with A less A_T = tau^2 a_T and d less s A_T, and goes on as before. */

#endif
#if WITH_LAG
/* These hold if roll and pitch equal their moves. Here each follows its move with a first-order lag T (not in the
 * paper). Let A be tau^2 times eq 8 at the moves, before them at the measured tilt, and dA the part of its change that
 * one angle makes, roll or pitch.
 * With h = tau/T and c = 1 - exp(-h) the exact solution, for moves held over a prediction step, is
 *
 *     d(i+1) = d(i) + A(i) + D(i) + s_T dA(i+1),       s_T = 1/2 - (h - c)/h^2,
 *     D(i+1) = exp(-h) D(i) - (c/h)^2 dA(i+1),         D(-1) = 0: none before the first moves.
 *
 * D, the deficit, corrects the increment of d: it is minus the shortfall of the acceleration behind A in the
 * prediction steps i and i + 1, averaged with a weight that rises to the instant between them and falls from there.
 * Roll and pitch have terms s_T dA and D each. A prediction step is four additions and two products an axis; products
 * with dA are needed only where a move changes. */
#else
/* A prediction step is two additions. A changes only where a move changes: only there products are needed. */
#endif

#define NMPC_ROLL 0
#define NMPC_PITCH 1
#include "predictor.h"

/* Apply a change of the moves of roll and pitch to the roll-out along one axis: the terms with dA. */
NMPC_INLINE void predictor_change_tilt(nmpc_rollout_t *rollout, const nmpc_real_t gain_m_step2_rad[NMPC_ANGLES],
                                       nmpc_real_t roll_change_rad, nmpc_real_t pitch_change_rad)
{
    const nmpc_real_t roll_m_step2 = gain_product(gain_m_step2_rad[NMPC_ROLL], roll_change_rad);
    const nmpc_real_t pitch_m_step2 = gain_product(gain_m_step2_rad[NMPC_PITCH], pitch_change_rad);
    const nmpc_real_t change_m_step2 = roll_m_step2 + pitch_m_step2;

#if WITH_LAG
    rollout->displacement_m_step = rollout->displacement_m_step
                                   + (acceleration_product(NMPC_ROLL_DISPLACEMENT_SHARE, roll_m_step2)
                                      + acceleration_product(NMPC_PITCH_DISPLACEMENT_SHARE, pitch_m_step2));
    rollout->roll_deficit_m_step2 =
        rollout->roll_deficit_m_step2 - acceleration_product(NMPC_ROLL_DEFICIT_SHARE, roll_m_step2);
    rollout->pitch_deficit_m_step2 =
        rollout->pitch_deficit_m_step2 - acceleration_product(NMPC_PITCH_DEFICIT_SHARE, pitch_m_step2);
#elif WITH_HALVES
    rollout->displacement_m_step = rollout->displacement_m_step + half(change_m_step2);
#else
    rollout->displacement_m_step =
        rollout->displacement_m_step + acceleration_product(NMPC_DISPLACEMENT_SHARE, change_m_step2);
#endif
    rollout->acceleration_m_step2 = rollout->acceleration_m_step2 + change_m_step2;
}

/* Apply the moves of step `i` of the control horizon: their change from the moves before, or from the initial tilt,
 * which without a lag is 0: a command is the tilt. */
NMPC_INLINE void predictor_apply_moves(const nmpc_prediction_t *prediction, const nmpc_real_t moves_rad[NMPC_MOVES],
                                       int i, nmpc_rollout_t *x, nmpc_rollout_t *y)
{
    const nmpc_real_t *move_rad = &moves_rad[NMPC_ANGLES * i];
    const nmpc_real_t *previous_rad = (i > 0) ? &moves_rad[NMPC_ANGLES * (i - 1)] : prediction->tilt_rad;
    const nmpc_real_t roll_change_rad = move_rad[NMPC_ROLL] - previous_rad[NMPC_ROLL];
    const nmpc_real_t pitch_change_rad = move_rad[NMPC_PITCH] - previous_rad[NMPC_PITCH];

    predictor_change_tilt(x, prediction->gain_x_m_step2_rad, roll_change_rad, pitch_change_rad);
    predictor_change_tilt(y, prediction->gain_y_m_step2_rad, roll_change_rad, pitch_change_rad);
}

/* Advance the roll-out along one axis by one prediction step: e(i+1), and d(i+1) without its terms with dA. */
NMPC_INLINE void predictor_step(nmpc_rollout_t *rollout)
{
    rollout->error_m = rollout->error_m + error_change(rollout->displacement_m_step);
#if WITH_LAG
    rollout->displacement_m_step =
        rollout->displacement_m_step
        + (rollout->acceleration_m_step2 + (rollout->roll_deficit_m_step2 + rollout->pitch_deficit_m_step2));
    rollout->roll_deficit_m_step2 = acceleration_product(NMPC_ROLL_DEFICIT_DECAY, rollout->roll_deficit_m_step2);
    rollout->pitch_deficit_m_step2 = acceleration_product(NMPC_PITCH_DEFICIT_DECAY, rollout->pitch_deficit_m_step2);
#else
    rollout->displacement_m_step = rollout->displacement_m_step + rollout->acceleration_m_step2;
#endif
}

/* Start the roll-out along one axis: with a lag at the measured tilt, which stays constant until the first moves;
 * without one at the acceleration 0, which nmpc_init() set. */
static void start_rollout(nmpc_rollout_t *rollout, const nmpc_real_t gain_m_step2_rad[NMPC_ANGLES],
                          const nmpc_real_t tilt_rad[NMPC_ANGLES], nmpc_real_t error_m,
                          nmpc_real_t relative_velocity_m_s)
{
    rollout->error_m = initial_error(error_m);
#if WITH_LAG
    rollout->acceleration_m_step2 = gain_product(gain_m_step2_rad[NMPC_ROLL], tilt_rad[NMPC_ROLL])
                                    + gain_product(gain_m_step2_rad[NMPC_PITCH], tilt_rad[NMPC_PITCH]);
    rollout->displacement_m_step = velocity_product(NMPC_PREDICTION_STEP_S, relative_velocity_m_s)
                                   + acceleration_product(NMPC_DISPLACEMENT_SHARE, rollout->acceleration_m_step2);
    rollout->roll_deficit_m_step2 = (nmpc_real_t)0;
    rollout->pitch_deficit_m_step2 = (nmpc_real_t)0;
#else
    (void)gain_m_step2_rad;
    (void)tilt_rad;
    rollout->displacement_m_step = velocity_product(NMPC_PREDICTION_STEP_S, relative_velocity_m_s);
#endif
}

#if WITH_TRACKER
/* Let the target accelerate: the error's acceleration is the drone's less the target's. */
static void accelerate_target(nmpc_rollout_t *rollout, nmpc_real_t target_acceleration_m_step2)
{
#if WITH_LAG
    rollout->acceleration_m_step2 = rollout->acceleration_m_step2 - target_acceleration_m_step2;
#else
    rollout->acceleration_m_step2 = -target_acceleration_m_step2;
#endif
#if WITH_HALVES
    rollout->displacement_m_step = rollout->displacement_m_step - half(target_acceleration_m_step2);
#else
    rollout->displacement_m_step =
        rollout->displacement_m_step - acceleration_product(NMPC_DISPLACEMENT_SHARE, target_acceleration_m_step2);
#endif
}

#endif
/* Evaluate eq 8 at the present yaw and thrust, and start the roll-out along x and along y. */
static void predictor_prepare(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target,
                              nmpc_real_t thrust_acceleration_m_s2)
{
    nmpc_prediction_t *const prediction = &self->prediction;
    const nmpc_real_t thrust_m_step2 = thrust_product(thrust_acceleration_m_s2, NMPC_PREDICTION_STEP_SQUARED_S2);
    nmpc_real_t sine;
    nmpc_real_t cosine;
    nmpc_real_t sine_m_step2;
    nmpc_real_t cosine_m_step2;

    /* tau^2 times the matrix of eq 8. */
    sine_cosine(state->yaw_rad, &sine, &cosine);
    sine_m_step2 = sine_product(thrust_m_step2, sine);
    cosine_m_step2 = sine_product(thrust_m_step2, cosine);
#if not WITH_PRINTED_YAW
    /* Eq 8 prints both sin psi with the opposite sign of what eqs 3 and 6 give. */
    sine_m_step2 = -sine_m_step2;
#endif
    prediction->gain_x_m_step2_rad[NMPC_ROLL] = sine_m_step2;
    prediction->gain_x_m_step2_rad[NMPC_PITCH] = -cosine_m_step2;
    prediction->gain_y_m_step2_rad[NMPC_ROLL] = cosine_m_step2;
    prediction->gain_y_m_step2_rad[NMPC_PITCH] = sine_m_step2;

    /* r - Tp and v - Tv, of eqs 9 to 11, at the present control step. */
#if WITH_LAG
    prediction->tilt_rad[NMPC_ROLL] = state->roll_rad;
    prediction->tilt_rad[NMPC_PITCH] = state->pitch_rad;
#endif
    start_rollout(&prediction->x, prediction->gain_x_m_step2_rad, prediction->tilt_rad,
                  state->position_m[0] - target->position_m[0], state->velocity_m_s[0] - target->velocity_m_s[0]);
    start_rollout(&prediction->y, prediction->gain_y_m_step2_rad, prediction->tilt_rad,
                  state->position_m[1] - target->position_m[1], state->velocity_m_s[1] - target->velocity_m_s[1]);
#if WITH_TRACKER
    accelerate_target(&prediction->x, self->tracker.acceleration_m_step2[0]);
    accelerate_target(&prediction->y, self->tracker.acceleration_m_step2[1]);
#endif
}
