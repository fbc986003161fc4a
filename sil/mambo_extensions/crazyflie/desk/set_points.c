#include "set_points.h"

#include <math.h>
#include <string.h>

#define PLAN_PERIOD_MS 10U
#define AXES 4 /* x, y, z, yaw */
#define DEGREE 7
#define MOST_PIECES 31 /* what the firmware's memory holds */
#define PIECE_NUMBERS ((AXES * (DEGREE + 1)) + 1)
#define DEG_PER_RAD 57.2957795130823

typedef struct {
    double value, slope, curvature, jerk;
} motion_t;

static setpoint_t current;
static bool is_by_radio;
static enum trajectory_state plan;
static double coefficients[AXES][DEGREE + 1]; /* by the time in durations */
static double duration_s;
static double pieces[MOST_PIECES][PIECE_NUMBERS]; /* of an uploaded trajectory, each with its duration behind its coefficients */
static int flown_pieces;                          /* of the trajectory that flies; 0: the plan of `coefficients` does */
static uint32_t begun_ms;
static double last_m[AXES]; /* of the last set-point, with its velocity; yaw in rad */
static double last_m_s[AXES];

void set_points_start(void)
{
    memset(&current, 0, sizeof current);
    is_by_radio = false;
    plan = TRAJECTORY_STATE_IDLE;
}

void set_points_send(const setpoint_t *setpoint, uint32_t now_ms)
{
    current = *setpoint;
    current.timestamp = now_ms;
    is_by_radio = true;
    plan = TRAJECTORY_STATE_IDLE;
}

void set_points_yield(void) { is_by_radio = false; }
enum trajectory_state set_points_state(void) { return plan; }

/* Evaluate a polynomial whose time has a unit. */
static motion_t evaluate(const double c[DEGREE + 1], double share, double unit_s)
{
    motion_t found = { 0.0, 0.0, 0.0, 0.0 };

    for (int k = DEGREE; k >= 0; k--) {
        found.jerk = (found.jerk * share) + (3.0 * found.curvature);
        found.curvature = (found.curvature * share) + (2.0 * found.slope);
        found.slope = (found.slope * share) + found.value;
        found.value = (found.value * share) + c[k];
    }
    found.slope /= unit_s;
    found.curvature /= unit_s * unit_s;
    found.jerk /= unit_s * unit_s * unit_s;
    return found;
}

static motion_t in_pieces(int axis, double time_s)
{
    const double *piece = pieces[0];
    motion_t end;

    for (int k = 0; k < flown_pieces; k++) {
        piece = pieces[k];
        if (time_s <= piece[PIECE_NUMBERS - 1]) {
            return evaluate(&piece[axis * (DEGREE + 1)], time_s, 1.0);
        }
        time_s -= piece[PIECE_NUMBERS - 1];
    }
    end = evaluate(&piece[axis * (DEGREE + 1)], piece[PIECE_NUMBERS - 1], 1.0);
    return (motion_t){ end.value, 0.0, 0.0, 0.0 };
}

static motion_t at(int axis, uint32_t now_ms)
{
    const double time_s = 0.001 * (double)(now_ms - begun_ms);

    return (flown_pieces > 0) ? in_pieces(axis, time_s) : evaluate(coefficients[axis], fmin(time_s / duration_s, 1.0), duration_s);
}

void set_points_write(int first, const double *written, int count)
{
    memcpy(pieces[first], written, (size_t)count * sizeof pieces[0]);
}

void set_points_follow(int count, uint32_t now_ms)
{
    flown_pieces = count;
    begun_ms = now_ms;
    plan = TRAJECTORY_STATE_FLYING;
}

/* The polynomial from a motion to rest; without jerk at both ends. */
static void connect(double c[DEGREE + 1], motion_t from, double to)
{
    const double c1 = from.slope * duration_s, c2 = 0.5 * from.curvature * duration_s * duration_s;
    const double off = to - from.value - c1 - c2, slope = -c1 - (2.0 * c2), curvature = -2.0 * c2;

    c[0] = from.value;
    c[1] = c1;
    c[2] = c2;
    c[3] = 0.0;
    c[4] = (35.0 * off) - (15.0 * slope) + (2.5 * curvature);
    c[5] = (-84.0 * off) + (39.0 * slope) - (7.0 * curvature);
    c[6] = (70.0 * off) - (34.0 * slope) + (6.5 * curvature);
    c[7] = (-20.0 * off) + (10.0 * slope) - (2.0 * curvature);
}

void set_points_plan(const double position_m[3], double yaw_rad, double wanted_s, bool lands, uint32_t now_ms)
{
    motion_t from[AXES];

    for (int axis = 0; axis < AXES; axis++) {
        const motion_t rest = { last_m[axis], last_m_s[axis], 0.0, 0.0 };

        from[axis] = (plan == TRAJECTORY_STATE_IDLE) ? rest : at(axis, now_ms);
    }
    flown_pieces = 0;
    duration_s = wanted_s;
    begun_ms = now_ms;
    for (int axis = 0; axis < AXES; axis++) {
        const double turned_rad = remainder(yaw_rad - from[axis].value, 8.0 * atan(1.0));

        connect(coefficients[axis], from[axis], (axis < 3) ? position_m[axis] : (from[axis].value + turned_rad));
    }
    plan = lands ? TRAJECTORY_STATE_LANDING : TRAJECTORY_STATE_FLYING;
}

void set_points_lift(double z_m, double yaw_rad, double wanted_s, bool lands, uint32_t now_ms)
{
    const double place_m[3] = { last_m[0], last_m[1], z_m };

    for (int axis = 0; axis < AXES; axis++) {
        last_m_s[axis] = 0.0; /* such a plan begins at rest */
    }
    plan = TRAJECTORY_STATE_IDLE;
    set_points_plan(place_m, yaw_rad, wanted_s, lands, now_ms);
}

static void follow_plan(uint32_t now_ms)
{
    motion_t motion[AXES];

    for (int axis = 0; axis < AXES; axis++) {
        motion[axis] = at(axis, now_ms);
        last_m[axis] = motion[axis].value;
        last_m_s[axis] = motion[axis].slope;
    }
    memset(&current, 0, sizeof current);
    current.timestamp = now_ms;
    current.mode.x = current.mode.y = current.mode.z = current.mode.yaw = modeAbs;
    current.position = (vector_t){ now_ms, (float)motion[0].value, (float)motion[1].value, (float)motion[2].value };
    current.velocity = (vector_t){ now_ms, (float)motion[0].slope, (float)motion[1].slope, (float)motion[2].slope };
    current.acceleration = (vector_t){ now_ms, (float)motion[0].curvature, (float)motion[1].curvature, (float)motion[2].curvature };
    current.jerk = (vector_t){ now_ms, (float)motion[0].jerk, (float)motion[1].jerk, (float)motion[2].jerk };
    current.attitude.yaw = (float)(DEG_PER_RAD * motion[3].value);
    current.attitudeRate.yaw = (float)(DEG_PER_RAD * motion[3].slope);
    if ((plan == TRAJECTORY_STATE_LANDING) && (0.001 * (double)(now_ms - begun_ms) >= duration_s)) {
        plan = TRAJECTORY_STATE_IDLE;
    }
}

void set_points_now(setpoint_t *setpoint, const state_t *state, uint32_t now_ms)
{
    if (!is_by_radio && ((now_ms % PLAN_PERIOD_MS) == 0U)) {
        if (plan == TRAJECTORY_STATE_IDLE) {
            memset(&current, 0, sizeof current); /* the motors stop */
            current.timestamp = now_ms;
        } else {
            follow_plan(now_ms);
        }
    }
    if (plan == TRAJECTORY_STATE_IDLE) {
        last_m[0] = state->position.x;
        last_m[1] = state->position.y;
        last_m[2] = state->position.z;
        last_m[3] = state->attitude.yaw / DEG_PER_RAD;
        last_m_s[0] = state->velocity.x;
        last_m_s[1] = state->velocity.y;
        last_m_s[2] = state->velocity.z;
        last_m_s[3] = 0.0;
    }
    *setpoint = current;
}
