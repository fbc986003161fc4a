/* ---- Set limits -----------------------------------------------------------------------------------------------------
 *
 * What the law of the limits needs of them, and their functions of nmpc.h.
 */

#include "set_limits.h"

/* 1 if every limit may be set; 0 if one is NaN. */
static int limits_are_good(const nmpc_limits_t *limits)
{
    int is_good = between(limits->speed_m_s, NMPC_SMALLEST_SPEED_LIMIT_M_S, NMPC_VELOCITY_RANGE_M_S)
                  && within(limits->tilt_rad, NMPC_TILT_LIMIT_RAD);
    int axis;

    if (is_good != 0) {
#if WITH_FIXED
        nmpc_real_t most_m_s2 =
            (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)NMPC_BRAKING_PER_TILT_M_S2_RAD * limits->tilt_rad, NMPC_TILT_SHIFT);
#else
        nmpc_real_t most_m_s2 = NMPC_BRAKING_PER_TILT_M_S2_RAD * limits->tilt_rad;
#endif

#if WITH_BRAKING_TRIM
        most_m_s2 = most_m_s2 - NMPC_BRAKING_TRIM_M_S2;
#endif
#if not WITH_FIXED
        /* Not negative, as the bounds of between() must be; a negative tilt limit gives no braking. */
        most_m_s2 = larger(most_m_s2, (nmpc_real_t)0);
#endif
        is_good = between(limits->braking_m_s2, NMPC_SMALLEST_BRAKING_LIMIT_M_S2, most_m_s2);
    }
    for (axis = 0; axis < 2; axis++) {
        is_good = is_good && within(limits->fence_min_m[axis], NMPC_POSITION_RANGE_M)
                  && within(limits->fence_max_m[axis], NMPC_POSITION_RANGE_M)
                  && (limits->fence_min_m[axis] < limits->fence_max_m[axis]);
    }
#if WITH_HEIGHT
    is_good = is_good && within(limits->floor_m, NMPC_POSITION_RANGE_M)
              && within(limits->ceiling_m, NMPC_POSITION_RANGE_M) && (limits->floor_m < limits->ceiling_m)
              && between(limits->climb_m_s, NMPC_SMALLEST_SPEED_LIMIT_M_S, NMPC_LARGEST_CLIMB_LIMIT_M_S)
              && between(limits->descent_m_s, NMPC_SMALLEST_SPEED_LIMIT_M_S, NMPC_LARGEST_DESCENT_LIMIT_M_S);
#endif
    return is_good;
}

/* Derive what the steps need of good limits. */
static void limits_set(nmpc_t *self, const nmpc_limits_t *limits)
{
    nmpc_bounds_t *const bounds = &self->bounds;
    const nmpc_real_t speed_m_s = limits->speed_m_s;
#if WITH_FIXED
    const nmpc_square_t most_m_s2 = ((nmpc_square_t)NMPC_APPROACH_1_S * (nmpc_square_t)speed_m_s) >> NMPC_LEAST_SHIFT;
    const nmpc_real_t braking_m_s2 = at_most(most_m_s2, limits->braking_m_s2 + limits->braking_m_s2);
    const nmpc_root_t root = inverse_root((nmpc_square_t)braking_m_s2 << NMPC_BRAKING_SHIFT);
    const nmpc_square_t quotient = (size_product(speed_m_s, root.mantissa) >> root.half) >> NMPC_QUOTIENT_SHIFT;
    const nmpc_square_t stopping_m = (quotient * quotient) >> NMPC_STOPPING_SHIFT;
    const nmpc_real_t knee_m = knee_product(NMPC_KNEE_S2, braking_m_s2);
    const nmpc_real_t margin_m = at_most(stopping_m + (nmpc_square_t)(halved(knee_m)), 2 * NMPC_POSITION_RANGE_M);
#else
    const nmpc_real_t braking_m_s2 =
        smaller(limits->braking_m_s2 + limits->braking_m_s2, NMPC_TWICE_APPROACH_1_S * speed_m_s);
    const nmpc_real_t quotient = speed_m_s * inverse_root(braking_m_s2);
    const nmpc_real_t knee_m = knee_product(NMPC_KNEE_S2, braking_m_s2);
    const nmpc_real_t margin_m = (quotient * quotient) + halved(knee_m);
#endif
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t min_m = limits->fence_min_m[axis];
        const nmpc_real_t max_m = limits->fence_max_m[axis];

        bounds->centre_m[axis] = halved(min_m + max_m);
        bounds->clear_m[axis] = halved(max_m - min_m) - margin_m;
    }
    bounds->margin_m = margin_m;
    bounds->knee_m = knee_m;
    bounds->near_m = knee_product(NMPC_NEAR_S2, braking_m_s2);
    bounds->speed_m_s = speed_m_s;
    bounds->braking_m_s2 = braking_m_s2;
    bounds->tilt_rad = limits->tilt_rad;
#if WITH_HEIGHT
    bounds->floor_m = limits->floor_m;
    bounds->ceiling_m = limits->ceiling_m;
    bounds->up_m = reach_product(NMPC_REACH_STEPS, speed_product(NMPC_UPDATE_STEP_S, limits->climb_m_s));
    bounds->down_m = reach_product(NMPC_REACH_STEPS, speed_product(NMPC_UPDATE_STEP_S, limits->descent_m_s));
#endif
#if WITH_QUADRATIC
    if (limits->tilt_rad < NMPC_TILT_LIMIT_RAD) {
#if WITH_ROLL_TRIM
        const nmpc_real_t roll_rad = limits->tilt_rad - absolute(NMPC_ROLL_TRIM_COMMAND_RAD);
#else
        const nmpc_real_t roll_rad = limits->tilt_rad;
#endif
#if WITH_PITCH_TRIM
        const nmpc_real_t pitch_rad = limits->tilt_rad - absolute(NMPC_PITCH_TRIM_COMMAND_RAD);
#else
        const nmpc_real_t pitch_rad = limits->tilt_rad;
#endif
#if WITH_THRUST_VECTOR
        nmpc_real_t slope[2];

        vector_largest(roll_rad, pitch_rad, slope);
        /* The clamp changes nothing but roundings: it tells a proof by intervals how large they are. */
        bounds->command_m_step2[NMPC_RIGHT] =
            clamp(to_move(slope_acceleration(NMPC_GAIN_M_STEP2_RAD, slope[0])), NMPC_RIGHT_LIMIT_M_STEP2);
        bounds->command_m_step2[NMPC_FORWARD] =
            clamp(to_move(slope_acceleration(NMPC_GAIN_M_STEP2_RAD, slope[1])), NMPC_FORWARD_LIMIT_M_STEP2);
#else

        bounds->command_m_step2[NMPC_RIGHT] = to_move(tilt_product(NMPC_ROLL_GAIN_M_STEP2_RAD, roll_rad));
        bounds->command_m_step2[NMPC_FORWARD] = to_move(tilt_product(NMPC_PITCH_GAIN_M_STEP2_RAD, pitch_rad));
#endif
    } else {
        bounds->command_m_step2[NMPC_RIGHT] = NMPC_RIGHT_LIMIT_M_STEP2;
        bounds->command_m_step2[NMPC_FORWARD] = NMPC_FORWARD_LIMIT_M_STEP2;
    }
#endif
}

void nmpc_default_limits(nmpc_limits_t *limits)
{
    if (limits == NULL) {
        return;
    }

    limits->speed_m_s = NMPC_SPEED_LIMIT_M_S;
    limits->braking_m_s2 = NMPC_BRAKING_LIMIT_M_S2;
    limits->fence_min_m[0] = NMPC_FENCE_X_MIN_M;
    limits->fence_min_m[1] = NMPC_FENCE_Y_MIN_M;
    limits->fence_max_m[0] = NMPC_FENCE_X_MAX_M;
    limits->fence_max_m[1] = NMPC_FENCE_Y_MAX_M;
    limits->tilt_rad = NMPC_TILT_LIMIT_RAD;
#if WITH_HEIGHT
    limits->floor_m = NMPC_FENCE_FLOOR_M;
    limits->ceiling_m = NMPC_FENCE_CEILING_M;
    limits->climb_m_s = NMPC_CLIMB_LIMIT_M_S;
    limits->descent_m_s = NMPC_DESCENT_LIMIT_M_S;
#endif
}

/* Take the limits of the settings: what limits_set() derives from nmpc_default_limits(). */
static void limits_init(nmpc_t *self)
{
    self->bounds = default_bounds;
}

nmpc_status_t nmpc_set_limits(nmpc_t *self, const nmpc_limits_t *limits)
{
    int k;

    if ((self == NULL) || (limits == NULL)) {
        return NMPC_NULL_POINTER;
    }
    if (limits_are_good(limits) == 0) {
        return NMPC_BAD_LIMITS;
    }

    limits_set(self, limits);
    for (k = 0; k < NMPC_ANGLES; k++) {
        self->command_rad[k] = clamp(self->command_rad[k], limits->tilt_rad);
#if WITH_FEEDBACK and not WITH_QUADRATIC
        self->sent_rad[k] = clamp(self->sent_rad[k], limits->tilt_rad);
#endif
    }
#if not WITH_QUADRATIC
    for (k = 0; k < NMPC_MOVES; k++) {
        self->plan_rad[k] = clamp(self->plan_rad[k], limits->tilt_rad);
    }
#endif
    return NMPC_OK;
}

unsigned int nmpc_limits_active(const nmpc_t *self)
{
    return (unsigned int)self->active_limits + ((nmpc_is_saturated(self) != 0) ? NMPC_LIMIT_TILT : 0U);
}
#if WITH_TURNING

/* The frame has jumped: the velocity that the law remembers changes with it. */
static void limits_shift(nmpc_bounds_t *bounds, const nmpc_real_t change_m_s[])
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        bounds->target_m_s[axis] = clamp(bounds->target_m_s[axis] + change_m_s[axis], NMPC_VELOCITY_RANGE_M_S);
    }
}
#endif
