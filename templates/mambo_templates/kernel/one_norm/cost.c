/* ---- Cost -----------------------------------------------------------------------------------------------------------
 *
 * The Manhattan distance to the target and the change of the moves, with its subgradient (eq 12):
 *
 *     J = lambda_1 sum_i (|e_x(i)| + |e_y(i)|) + lambda_2 sum_i (|Delta phi(i)| + |Delta theta(i)|).
 *
 * The gradient of the distance by a move is that by its acceleration A times its row of eq 8; R(i) is the response of
 * the error to A (predictor).
 */

/* The predicted errors along one axis, x or y. */
typedef struct {
    nmpc_real_t distance_m; /* sum over the horizon of the absolute error */
    nmpc_steps_t negative;  /* sign bits of the errors: 1 if negative; bit 0 is the last prediction step */
} nmpc_axis_errors_t;

/* Advance the roll-out by one prediction step and record the error at its end. */
NMPC_INLINE void predict_error(nmpc_rollout_t *rollout, nmpc_axis_errors_t *errors)
{
    predictor_step(rollout);
    errors->distance_m = errors->distance_m + absolute(rollout->error_m);
    errors->negative = (errors->negative << 1) | is_negative(rollout->error_m);
}

/* Compute the subgradient of the distance along one axis with respect to the acceleration A of each move: the sum
 * over the horizon of the response R to the move, each term with the sign of the error at that prediction step. With
 * S(i) = R(0) + ... + R(i), four errors with the signs + + - - give 2 S(1) - S(3); response_sum holds
 * 2 S(i), and S in its last row. The loop goes from the last change of sign to the first, as if the first error were
 * positive; then the result is multiplied by the sign of the first error. An error of zero takes its sign bit: any
 * value from -1 to 1 is a subgradient of |e| at 0. If all errors are zero so is the subgradient. */
NMPC_INLINE void distance_subgradient(const nmpc_axis_errors_t *errors, nmpc_real_t subgradient[NMPC_RESPONSES])
{
    static const nmpc_real_t signs[] = { (nmpc_real_t)1, -(nmpc_real_t)1 };
    nmpc_real_t sign = (nmpc_real_t)0;
#if WITH_LATER_STEPS
    nmpc_steps_t changes = (errors->negative ^ (errors->negative >> 1)) & (((nmpc_steps_t)1 << NMPC_LAST_STEP) - 1U);
    int count;
#endif
    int k;

    NMPC_UNROLL
    for (k = 0; k < NMPC_RESPONSES; k++) {
        subgradient[k] = response_sum[NMPC_LAST_STEP][k];
    }
#if WITH_LATER_STEPS
    /* Prediction step i, counted from 0, is the last before a change of sign. The sign changes at most N_p - 1
     * times; the counter makes that bound explicit for static analysis. */
    for (count = 1; (changes != 0U) && (count < NMPC_HORIZON_PREDICTION); count++) {
        const unsigned int i = (NMPC_LAST_STEP - 1U) - lowest_set_bit(changes);

        NMPC_UNROLL
        for (k = 0; k < NMPC_RESPONSES; k++) {
            subgradient[k] = response_sum[i][k] - subgradient[k];
        }
        changes = changes & (changes - 1U);
    }
#endif
    if (bits_of(errors->distance_m) != 0U) {
        sign = signs[errors->negative >> NMPC_LAST_STEP];
    }
    NMPC_UNROLL
    for (k = 0; k < NMPC_RESPONSES; k++) {
        subgradient[k] = sign * subgradient[k];
    }
}

/* Return J, eq 12, of the plan, and store its subgradient in `self->gradient`. */
static nmpc_sum_t cost_evaluate(nmpc_t *self)
{
    const nmpc_prediction_t *const prediction = &self->prediction;
    const nmpc_real_t *const moves_rad = self->plan_rad;
    const nmpc_weights_t weight = self->weights;
    nmpc_rollout_t rollout_x = prediction->x;
    nmpc_rollout_t rollout_y = prediction->y;
    nmpc_axis_errors_t errors_x = { (nmpc_real_t)0, 0U };
    nmpc_axis_errors_t errors_y = { (nmpc_real_t)0, 0U };
    nmpc_real_t subgradient_x[NMPC_RESPONSES];
    nmpc_real_t subgradient_y[NMPC_RESPONSES];
    nmpc_sum_t distance_m;
    nmpc_sum_t variation_rad = (nmpc_sum_t)0;
    int angle;
    int i;

    /* Eq 12a: the distance over the horizon. After the control horizon the last moves are held. */
    NMPC_UNROLL
    for (i = 0; i < NMPC_HORIZON_CONTROL; i++) {
        predictor_apply_moves(prediction, moves_rad, i, &rollout_x, &rollout_y);
        predict_error(&rollout_x, &errors_x);
        predict_error(&rollout_y, &errors_y);
    }
    NMPC_UNROLL
    for (i = NMPC_HORIZON_CONTROL; i < NMPC_HORIZON_PREDICTION; i++) {
        predict_error(&rollout_x, &errors_x);
        predict_error(&rollout_y, &errors_y);
    }
    distance_subgradient(&errors_x, subgradient_x);
    distance_subgradient(&errors_y, subgradient_y);
    distance_m = (nmpc_sum_t)errors_x.distance_m + errors_y.distance_m;

    /* Eq 12b: the variation is the sum of |Delta U|; the first moves change from the last command. A move enters
     * two terms, its own change and the next move's, so its gradient is complete one pass of the loop later. */
    NMPC_UNROLL
    for (angle = 0; angle < NMPC_ANGLES; angle++) {
        const nmpc_real_t gain_x_m_step2_rad = prediction->gain_x_m_step2_rad[angle];
        const nmpc_real_t gain_y_m_step2_rad = prediction->gain_y_m_step2_rad[angle];
        nmpc_real_t previous_rad = self->command_rad[angle];
        nmpc_sum_t gradient = (nmpc_sum_t)0;

        NMPC_UNROLL
        for (i = 0; i < NMPC_HORIZON_CONTROL; i++) {
            const int k = (NMPC_ANGLES * i) + angle;
            const int response = k / NMPC_ANGLES_PER_RESPONSE;
            const nmpc_real_t change_rad = moves_rad[k] - previous_rad;
            const nmpc_real_t distance_gradient_m_rad = distance_gradient(gain_x_m_step2_rad, subgradient_x[response],
                                                                          gain_y_m_step2_rad, subgradient_y[response]);
            nmpc_sum_t effort_slope = (nmpc_sum_t)0;

            if (change_rad > (nmpc_real_t)0) {
                variation_rad = variation_rad + change_rad;
                effort_slope = effort_gradient(weight.effort);
            } else if (change_rad < (nmpc_real_t)0) {
                variation_rad = variation_rad - change_rad;
                effort_slope = -effort_gradient(weight.effort);
            } else {
                /* No change: 0 is a subgradient. */
            }
#if WITH_LATER_MOVES
            if (i > 0) {
                self->gradient[k - NMPC_ANGLES] = gradient - effort_slope;
            }
#endif
            gradient = tracking_gradient(weight.tracking, distance_gradient_m_rad) + effort_slope;
            previous_rad = moves_rad[k];
        }
        self->gradient[(NMPC_MOVES - NMPC_ANGLES) + angle] = gradient;
    }
    return tracking_cost(weight.tracking, distance_m) + effort_cost(weight.effort, variation_rad);
}
