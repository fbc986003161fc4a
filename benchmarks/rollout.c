/* The controller as a plain roll-out: every iteration predicts the states step by step (eqs 8-11), sums the cost
 * (eq 12), and computes the gradient by a backward pass. No tables, no input check; the C library's sine and
 * cosine. The settings are in the bundle's nmpc.h; the compiler's command line defines:
 *
 *   ROLLOUT_HAS_LAG      1 if the prediction models the attitude lag
 *   ROLLOUT_KEEPS_PLAN   1 if the search starts from the last plan, 0 from the last command
 *   ROLLOUT_DECAY        exp(-step / lag) of roll and pitch: remaining share of (command - tilt) after a step
 *   ROLLOUT_SPEED_LACK   s: velocity deficit of a step due to the lag, per unit (command - tilt) and thrust
 *   ROLLOUT_SHIFT_LACK   s^2: displacement deficit, likewise
 */
#include <math.h>

#include "nmpc.h"
#include "run.h"

#define STEP_S NMPC_PREDICTION_STEP_S
#define HALF_SQUARE_S2 ((nmpc_real_t)0.5 * NMPC_PREDICTION_STEP_S * NMPC_PREDICTION_STEP_S)
#define LAST_MOVE (NMPC_HORIZON_CONTROL - 1)

typedef struct {
    nmpc_real_t error_m[2];           /* position less target along x, y */
    nmpc_real_t velocity_m_s[2];      /* the same of the velocity */
    nmpc_real_t tilt_rad[2];          /* roll, pitch */
} model_t;

#if ROLLOUT_HAS_LAG
static const nmpc_real_t decay[2] = ROLLOUT_DECAY;
static const nmpc_real_t speed_lack_s[2] = ROLLOUT_SPEED_LACK;
static const nmpc_real_t shift_lack_s2[2] = ROLLOUT_SHIFT_LACK;
#endif

static nmpc_real_t plan_rad[NMPC_HORIZON_CONTROL][2];
static float given_rad[2];

static int sign(nmpc_real_t value)
{
    return (value > 0) - (value < 0);
}

static nmpc_real_t size(nmpc_real_t value)
{
    return (value < 0) ? -value : value;
}

/* Return the cost of the plan, and its slope by each move. `gain[axis][angle]` is acceleration by tilt. */
static nmpc_real_t evaluate(const model_t *start, const nmpc_real_t gain[2][2], const nmpc_real_t last_rad[2],
                            nmpc_real_t slope[NMPC_HORIZON_CONTROL][2])
{
    model_t now = *start;
    nmpc_real_t signs[NMPC_HORIZON_PREDICTION][2];
    nmpc_real_t by_error[2] = {0, 0}, by_velocity[2] = {0, 0};
    nmpc_real_t distance_m = 0, variation_rad = 0;
    int i, k, axis;
#if ROLLOUT_HAS_LAG
    nmpc_real_t by_tilt[2] = {0, 0};
#else
    nmpc_real_t acceleration[2] = {0, 0}, by_acceleration[2] = {0, 0};
#endif

    for (i = 0; i < NMPC_HORIZON_PREDICTION; i++) {
        const nmpc_real_t *move_rad = plan_rad[(i < LAST_MOVE) ? i : LAST_MOVE];
#if ROLLOUT_HAS_LAG
        nmpc_real_t shift_s2[2], speed_s[2];

        for (k = 0; k < 2; k++) {
            const nmpc_real_t to_turn_rad = move_rad[k] - now.tilt_rad[k];

            shift_s2[k] = HALF_SQUARE_S2 * move_rad[k] - shift_lack_s2[k] * to_turn_rad;
            speed_s[k] = STEP_S * move_rad[k] - speed_lack_s[k] * to_turn_rad;
            now.tilt_rad[k] = move_rad[k] - decay[k] * to_turn_rad;
        }
#else
        if (i < NMPC_HORIZON_CONTROL) {
            for (axis = 0; axis < 2; axis++) {
                acceleration[axis] = gain[axis][0] * move_rad[0] + gain[axis][1] * move_rad[1];
            }
        }
#endif
        for (axis = 0; axis < 2; axis++) {
#if ROLLOUT_HAS_LAG
            now.error_m[axis] += STEP_S * now.velocity_m_s[axis] + gain[axis][0] * shift_s2[0]
                                 + gain[axis][1] * shift_s2[1];
            now.velocity_m_s[axis] += gain[axis][0] * speed_s[0] + gain[axis][1] * speed_s[1];
#else
            now.error_m[axis] += STEP_S * now.velocity_m_s[axis] + HALF_SQUARE_S2 * acceleration[axis];
            now.velocity_m_s[axis] += STEP_S * acceleration[axis];
#endif
            distance_m += size(now.error_m[axis]);
            signs[i][axis] = (nmpc_real_t)sign(now.error_m[axis]);
        }
    }

    for (k = 0; k < 2; k++) {
        for (i = 0; i < NMPC_HORIZON_CONTROL; i++) {
            slope[i][k] = 0;
        }
    }
    for (i = NMPC_HORIZON_PREDICTION - 1; i >= 0; i--) {
        nmpc_real_t *by_move = slope[(i < LAST_MOVE) ? i : LAST_MOVE];

        by_error[0] += signs[i][0];
        by_error[1] += signs[i][1];
#if ROLLOUT_HAS_LAG
        for (k = 0; k < 2; k++) {
            const nmpc_real_t by_shift = gain[0][k] * by_error[0] + gain[1][k] * by_error[1];
            const nmpc_real_t by_speed = gain[0][k] * by_velocity[0] + gain[1][k] * by_velocity[1];

            by_move[k] += (HALF_SQUARE_S2 - shift_lack_s2[k]) * by_shift + (STEP_S - speed_lack_s[k]) * by_speed
                          + (1 - decay[k]) * by_tilt[k];
            by_tilt[k] = shift_lack_s2[k] * by_shift + speed_lack_s[k] * by_speed + decay[k] * by_tilt[k];
        }
#else
        for (axis = 0; axis < 2; axis++) {
            by_acceleration[axis] += HALF_SQUARE_S2 * by_error[axis] + STEP_S * by_velocity[axis];
        }
        if (i <= LAST_MOVE) {
            for (k = 0; k < 2; k++) {
                by_move[k] = gain[0][k] * by_acceleration[0] + gain[1][k] * by_acceleration[1];
            }
            by_acceleration[0] = by_acceleration[1] = 0;
        }
#endif
        for (axis = 0; axis < 2; axis++) {
            by_velocity[axis] += STEP_S * by_error[axis];
        }
    }

    for (i = 0; i < NMPC_HORIZON_CONTROL; i++) {
        for (k = 0; k < 2; k++) {
            const nmpc_real_t change_rad = plan_rad[i][k] - ((i > 0) ? plan_rad[i - 1][k] : last_rad[k]);
            const nmpc_real_t effort = NMPC_EFFORT_WEIGHT * (nmpc_real_t)sign(change_rad);

            variation_rad += size(change_rad);
            slope[i][k] = NMPC_TRACKING_WEIGHT * slope[i][k] + effort;
            if (i > 0) {
                slope[i - 1][k] -= effort;
            }
        }
    }
    return NMPC_TRACKING_WEIGHT * distance_m + NMPC_EFFORT_WEIGHT * variation_rad;
}

/* RPROP, rprop+, with the rule to stop. */
static void minimize(const model_t *start, const nmpc_real_t gain[2][2], const nmpc_real_t last_rad[2])
{
    nmpc_real_t slope[NMPC_HORIZON_CONTROL][2], before_rad[NMPC_HORIZON_CONTROL][2];
    nmpc_real_t step_rad[NMPC_HORIZON_CONTROL][2];
    int direction[NMPC_HORIZON_CONTROL][2];
    nmpc_real_t cost = 0;
    int iteration, i, k;

    for (i = 0; i < NMPC_HORIZON_CONTROL; i++) {
        for (k = 0; k < 2; k++) {
            step_rad[i][k] = NMPC_INITIAL_STEP_RAD;
            before_rad[i][k] = plan_rad[i][k];
            direction[i][k] = 0;
        }
    }
    for (iteration = 0; iteration < NMPC_ITERATIONS; iteration++) {
        const nmpc_real_t previous = cost;

        cost = evaluate(start, gain, last_rad, slope);
        if ((iteration > 0) && (size(cost - previous) < NMPC_TOLERANCE)) {
            break;
        }
        for (i = 0; i < NMPC_HORIZON_CONTROL; i++) {
            for (k = 0; k < 2; k++) {
                const int downhill = -sign(slope[i][k]);
                nmpc_real_t next_rad = plan_rad[i][k];

                if ((downhill * direction[i][k]) < 0) {
                    step_rad[i][k] *= NMPC_DECREASE;
                    step_rad[i][k] = (step_rad[i][k] > NMPC_STEP_MIN_RAD) ? step_rad[i][k] : NMPC_STEP_MIN_RAD;
                    plan_rad[i][k] = before_rad[i][k];
                    direction[i][k] = 0;
                    continue;
                }
                if ((downhill * direction[i][k]) > 0) {
                    step_rad[i][k] *= NMPC_INCREASE;
                    step_rad[i][k] = (step_rad[i][k] < NMPC_STEP_MAX_RAD) ? step_rad[i][k] : NMPC_STEP_MAX_RAD;
                }
                next_rad += (nmpc_real_t)downhill * step_rad[i][k];
                next_rad = (next_rad < NMPC_TILT_LIMIT_RAD) ? next_rad : NMPC_TILT_LIMIT_RAD;
                next_rad = (next_rad > -NMPC_TILT_LIMIT_RAD) ? next_rad : -NMPC_TILT_LIMIT_RAD;
                before_rad[i][k] = plan_rad[i][k];
                plan_rad[i][k] = next_rad;
                direction[i][k] = downhill;
            }
        }
    }
}

/* Plan as run.h asks for, at heading 0 and hover thrust, which are not known before. */
static volatile nmpc_real_t rollout_yaw_rad = 0, rollout_thrust_m_s2 = 9.81f;

void run(const float error[4], const float last[2], float moves[4])
{
    const nmpc_real_t yaw_rad = rollout_yaw_rad, thrust_m_s2 = rollout_thrust_m_s2;
    const nmpc_real_t across = thrust_m_s2 * (nmpc_real_t)sinf((float)yaw_rad);
    const nmpc_real_t along = thrust_m_s2 * (nmpc_real_t)cosf((float)yaw_rad);
    const nmpc_real_t gain[2][2] = {{-across, -along}, {along, -across}};
    const nmpc_real_t last_rad[2] = {last[0], last[1]};
    const model_t start = {{error[0], error[2]}, {error[1], error[3]}, {last[0], last[1]}};
    int i, k;

    for (i = 0; i < NMPC_HORIZON_CONTROL; i++) {
        for (k = 0; k < 2; k++) {
            if (!ROLLOUT_KEEPS_PLAN || (last[0] != given_rad[0]) || (last[1] != given_rad[1])) {
                plan_rad[i][k] = last_rad[k];
            }
        }
    }
    minimize(&start, gain, last_rad);
    for (k = 0; k < 4; k++) {
        moves[k] = (float)plan_rad[k / 2][k % 2];
    }
    given_rad[0] = moves[0];
    given_rad[1] = moves[1];
}
