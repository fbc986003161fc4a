#include "estimator.h"

#include <math.h>
#include <string.h>

#define PREDICTION_MS 10
#define LARGEST_VARIANCE 100.0
#define SMALLEST_VARIANCE 1e-6

/* Deviations that the firmware assumes, documented as parameters of its group kalman. */
#define START_XY_M 100.0
#define START_Z_M 1.0
#define START_VELOCITY_M_S 0.01
#define START_ANGLE_RAD 0.01
#define FORCE_XY_M_S2 0.5
#define FORCE_Z_M_S2 1.0
#define RATE_RAD_S 0.1
#define CAMERA_M 0.01
#define FLOW_COUNTS 2.0
#define SWEEP_RAD 0.001

/* A drone on the ground is drawn to level, by this share with each prediction. */
#define LEVELLING 0.001

#define LARGEST_POSITION_M 100.0
#define LARGEST_VELOCITY_M_S 10.0
#define LEAST_HEIGHT_M 0.1

enum { POSITION = 0, VELOCITY = 3, ANGLE = 6 };

typedef double matrix_t[ESTIMATOR_STATES][ESTIMATOR_STATES];

static double squared(double value) { return value * value; }

/* Keep the variance symmetric and within its bounds. */
static void bound(matrix_t variance)
{
    for (int i = 0; i < ESTIMATOR_STATES; i++) {
        for (int j = i; j < ESTIMATOR_STATES; j++) {
            double value = 0.5 * (variance[i][j] + variance[j][i]);

            if (!(value <= LARGEST_VARIANCE)) {
                value = LARGEST_VARIANCE;
            } else if ((i == j) && (value < SMALLEST_VARIANCE)) {
                value = SMALLEST_VARIANCE;
            }
            variance[i][j] = variance[j][i] = value;
        }
    }
}

/* variance = step variance step^T */
static void propagate(matrix_t variance, const matrix_t step)
{
    matrix_t half = { { 0.0 } };

    for (int i = 0; i < ESTIMATOR_STATES; i++) {
        for (int k = 0; k < ESTIMATOR_STATES; k++) {
            if (step[i][k] != 0.0) {
                for (int j = 0; j < ESTIMATOR_STATES; j++) {
                    half[i][j] += step[i][k] * variance[k][j];
                }
            }
        }
    }
    memset(variance, 0, sizeof(matrix_t));
    for (int j = 0; j < ESTIMATOR_STATES; j++) {
        for (int k = 0; k < ESTIMATOR_STATES; k++) {
            if (step[j][k] != 0.0) {
                for (int i = 0; i < ESTIMATOR_STATES; i++) {
                    variance[i][j] += half[i][k] * step[j][k];
                }
            }
        }
    }
}

static void identity(matrix_t matrix)
{
    memset(matrix, 0, sizeof(matrix_t));
    for (int k = 0; k < ESTIMATOR_STATES; k++) {
        matrix[k][k] = 1.0;
    }
}

/* Add `scale` times the cross product matrix of a vector to a block. */
static void add_cross(matrix_t matrix, int row, int column, const double vector[3], double scale)
{
    for (int k = 0; k < 3; k++) {
        const int next = (k + 1) % 3, after = (k + 2) % 3;

        matrix[row + k][column + next] -= scale * vector[after];
        matrix[row + k][column + after] += scale * vector[next];
    }
}

/* As the firmware's, a filter that starts exceeds the largest variance that it keeps, until its noise is added. */
void estimator_start(estimator_t *filter, double yaw_rad)
{
    const double deviations[3] = { START_XY_M, START_VELOCITY_M_S, START_ANGLE_RAD };

    memset(filter, 0, sizeof *filter);
    filter->attitude[0] = cos(0.5 * yaw_rad);
    filter->attitude[3] = sin(0.5 * yaw_rad);
    for (int k = 0; k < ESTIMATOR_STATES; k++) {
        filter->variance[k][k] = squared((k == 2) ? START_Z_M : deviations[k / 3]);
    }
}

/* The Jacobian of the motion over a time. */
static void linearize(const estimator_t *filter, const double rates_rad_s[3], double duration_s, matrix_t step)
{
    const double *const v = filter->velocity_m_s;
    double r[3][3], down[3];

    rotation_of(filter->attitude, r);
    identity(step);
    for (int i = 0; i < 3; i++) {
        down[i] = r[2][i];
        for (int k = 0; k < 3; k++) {
            const int next = (k + 1) % 3, after = (k + 2) % 3;

            step[POSITION + i][VELOCITY + k] = duration_s * r[i][k];
            /* R (1 + [d]x) v = R v - R [v]x d */
            step[POSITION + i][ANGLE + k] = duration_s * ((r[i][after] * v[next]) - (r[i][next] * v[after]));
        }
    }
    add_cross(step, VELOCITY, VELOCITY, rates_rad_s, -duration_s);
    add_cross(step, VELOCITY, ANGLE, down, -duration_s * GRAVITY_M_S2);
    add_cross(step, ANGLE, ANGLE, rates_rad_s, -duration_s);
}

static void level_out(estimator_t *filter)
{
    double back_rad[3], r[3][3];

    rotation_of(filter->attitude, r);
    back_rad[0] = -LEVELLING * r[2][1];
    back_rad[1] = LEVELLING * r[2][0];
    back_rad[2] = 0.0;
    turn(filter->attitude, back_rad);
}

static void predict(estimator_t *filter, double duration_s, int is_flying)
{
    double rates_rad_s[3], force_m_s2[3], r[3][3], moved_m[3], gained_m_s[3], angle_rad[3];
    double *const v = filter->velocity_m_s;
    matrix_t step;

    for (int k = 0; k < 3; k++) {
        rates_rad_s[k] = filter->rates_sum[k] / filter->measured;
        force_m_s2[k] = (is_flying && (k < 2)) ? 0.0 : (filter->force_sum[k] / filter->measured);
        filter->rates_sum[k] = filter->force_sum[k] = 0.0;
    }
    filter->measured = 0;

    linearize(filter, rates_rad_s, duration_s, step);
    propagate(filter->variance, step);

    rotation_of(filter->attitude, r);
    for (int k = 0; k < 3; k++) {
        const int next = (k + 1) % 3, after = (k + 2) % 3;

        moved_m[k] = duration_s * (v[k] + (0.5 * duration_s * force_m_s2[k]));
        gained_m_s[k] = force_m_s2[k] - ((rates_rad_s[next] * v[after]) - (rates_rad_s[after] * v[next])) - (GRAVITY_M_S2 * r[2][k]);
        angle_rad[k] = duration_s * rates_rad_s[k];
    }
    for (int k = 0; k < 3; k++) {
        filter->position_m[k] += (r[k][0] * moved_m[0]) + (r[k][1] * moved_m[1]) + (r[k][2] * moved_m[2]);
        v[k] += duration_s * gained_m_s[k];
    }
    filter->position_m[2] -= 0.5 * GRAVITY_M_S2 * squared(duration_s);
    turn(filter->attitude, angle_rad);
    if (!is_flying) {
        level_out(filter);
    }
}

/* The noise of a millisecond. */
static void add_noise(estimator_t *filter)
{
    const double ms = 0.001;

    for (int k = 0; k < 3; k++) {
        const double force_m_s2 = (k < 2) ? FORCE_XY_M_S2 : FORCE_Z_M_S2;

        filter->variance[POSITION + k][POSITION + k] += squared(force_m_s2 * ms * ms);
        filter->variance[VELOCITY + k][VELOCITY + k] += squared(force_m_s2 * ms);
        filter->variance[ANGLE + k][ANGLE + k] += squared(RATE_RAD_S * ms);
    }
    bound(filter->variance);
}

/* A state that is not a number passes: such a filter stays as it is, as the firmware's does. */
static int is_within_bounds(const estimator_t *filter)
{
    for (int k = 0; k < 3; k++) {
        if ((fabs(filter->position_m[k]) > LARGEST_POSITION_M) || (fabs(filter->velocity_m_s[k]) > LARGEST_VELOCITY_M_S)) {
            return 0;
        }
    }
    return 1;
}

void estimator_advance(estimator_t *filter, const double rates_rad_s[3], const double force_m_s2[3], int is_flying)
{
    filter->since_prediction_ms++;
    if ((filter->since_prediction_ms >= PREDICTION_MS) && (filter->measured > 0)) {
        predict(filter, 0.001 * filter->since_prediction_ms, is_flying);
        filter->since_prediction_ms = 0;
    }
    add_noise(filter);
    for (int k = 0; k < 3; k++) {
        filter->rates_sum[k] += rates_rad_s[k];
        filter->force_sum[k] += force_m_s2[k];
        filter->rates_rad_s[k] = rates_rad_s[k];
    }
    filter->measured++;
    if (!is_within_bounds(filter)) {
        estimator_start(filter, 0.0);
    }
}

/* Update by a scalar measurement with the row `slope` of its Jacobian. */
static void update(estimator_t *filter, const double slope[ESTIMATOR_STATES], double innovation, double deviation)
{
    double product[ESTIMATOR_STATES], gain[ESTIMATOR_STATES], correction[ESTIMATOR_STATES];
    double total = squared(deviation);

    for (int i = 0; i < ESTIMATOR_STATES; i++) {
        product[i] = 0.0;
        for (int k = 0; k < ESTIMATOR_STATES; k++) {
            product[i] += filter->variance[i][k] * slope[k];
        }
        total += slope[i] * product[i];
    }
    for (int i = 0; i < ESTIMATOR_STATES; i++) {
        gain[i] = product[i] / total;
        correction[i] = gain[i] * innovation;
    }
    /* (1 - K H) P (1 - K H)^T + K R K^T = P - K (P H)^T, with the optimal gain */
    for (int i = 0; i < ESTIMATOR_STATES; i++) {
        for (int k = 0; k < ESTIMATOR_STATES; k++) {
            filter->variance[i][k] -= gain[i] * product[k];
        }
    }
    bound(filter->variance);

    for (int k = 0; k < 3; k++) {
        filter->position_m[k] += correction[POSITION + k];
        filter->velocity_m_s[k] += correction[VELOCITY + k];
    }
    if (isfinite(innovation)) { /* the firmware moves no error into the attitude that is not a number */
        turn(filter->attitude, &correction[ANGLE]);
    }
}

void estimator_see_position(estimator_t *filter, const double position_m[3])
{
    for (int k = 0; k < 3; k++) {
        double slope[ESTIMATOR_STATES] = { 0.0 };

        slope[POSITION + k] = 1.0;
        update(filter, slope, position_m[k] - filter->position_m[k], CAMERA_M);
    }
}

/* The floor moves by velocity over height, and the other way by the rate of turn. */
void estimator_see_flow(estimator_t *filter, const double counts[2], double duration_s)
{
    const double scale = FLOW_COUNTS_PER_PIXEL * duration_s * FLOW_PIXELS / FLOW_ANGLE_RAD;

    for (int k = 0; k < 2; k++) {
        const double height_m = fmax(filter->position_m[2], LEAST_HEIGHT_M);
        const double turned_rad_s = (k == 0) ? filter->rates_rad_s[1] : -filter->rates_rad_s[0];
        double slope[ESTIMATOR_STATES] = { 0.0 }, r[3][3], seen;

        rotation_of(filter->attitude, r);
        seen = filter->velocity_m_s[k] * r[2][2] / height_m;
        slope[POSITION + 2] = -scale * seen / height_m;
        slope[VELOCITY + k] = scale * r[2][2] / height_m;
        update(filter, slope, counts[k] - (scale * (seen - turned_rad_s)), FLOW_COUNTS);
    }
}

double range_deviation(double range_m)
{
    /* Documented by two points: 2.5 mm at 2.5 m, 0.2 m at 4 m. */
    return 0.0025 * (1.0 + exp((log(0.2 / 0.0025) / 1.5) * (range_m - 2.5)));
}

void estimator_see_range(estimator_t *filter, double range_m)
{
    double slope[ESTIMATOR_STATES] = { 0.0 }, r[3][3];

    rotation_of(filter->attitude, r);
    if (r[2][2] > 0.1) {
        /* The nearest floor in a cone of 15 degrees. */
        const double angle_rad = fmax(acos(fmin(r[2][2], 1.0)) - (7.5 / DEGREES), 0.0);

        slope[POSITION + 2] = 1.0 / cos(angle_rad);
        update(filter, slope, range_m - (filter->position_m[2] / cos(angle_rad)), range_deviation(range_m));
    }
}

/* Write where a sensor is in the frame of a station. */
static void seen_by_station(const sweep_t *sweep, const double position_m[3], const double attitude[4], double place_m[3])
{
    double r[3][3], away_m[3];

    rotation_of(attitude, r);
    for (int i = 0; i < 3; i++) {
        away_m[i] = position_m[i] - sweep->station_m[i];
        for (int k = 0; k < 3; k++) {
            away_m[i] += r[i][k] * sweep->sensor_m[k];
        }
    }
    for (int i = 0; i < 3; i++) {
        place_m[i] = (sweep->axes[0][i] * away_m[0]) + (sweep->axes[1][i] * away_m[1]) + (sweep->axes[2][i] * away_m[2]);
    }
}

/* A plane that is tilted by t passes (x, y, z) when the rotor is at atan2(y, x) + asin(z tan t / r), where r is the distance to the axis. */
double sweep_error(const sweep_t *sweep, const double position_m[3], const double attitude[4], double *distance_m)
{
    double place_m[3];

    seen_by_station(sweep, position_m, attitude, place_m);
    *distance_m = hypot(place_m[0], place_m[1]);
    return sweep->angle_rad - (atan2(place_m[1], place_m[0]) + asin(fmax(fmin(place_m[2] * tan(sweep->tilt_rad) / *distance_m, 1.0), -1.0)));
}

/* As the firmware's documentation says, the angle corrects by the position only. */
void estimator_see_sweep(estimator_t *filter, const sweep_t *sweep)
{
    double slope[ESTIMATOR_STATES] = { 0.0 }, place_m[3], slope_m[3], distance_m, share;
    const double error_rad = sweep_error(sweep, filter->position_m, filter->attitude, &distance_m);

    seen_by_station(sweep, filter->position_m, filter->attitude, place_m);
    share = squared(distance_m) - squared(place_m[2] * tan(sweep->tilt_rad));
    if (!(share > 0.0)) {
        return;
    }
    share = tan(sweep->tilt_rad) / sqrt(share);
    slope_m[0] = (-place_m[1] - (place_m[0] * place_m[2] * share)) / squared(distance_m);
    slope_m[1] = (place_m[0] - (place_m[1] * place_m[2] * share)) / squared(distance_m);
    slope_m[2] = share;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            slope[POSITION + i] += sweep->axes[i][k] * slope_m[k];
        }
    }
    update(filter, slope, error_rad, SWEEP_RAD);
}
