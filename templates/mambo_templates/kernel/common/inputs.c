/* ---- Inputs ---------------------------------------------------------------------------------------------------------
 *
 * The checks of inputs: |x| <= range, which no NaN satisfies.
 */

NMPC_INLINE int is_good_point(const nmpc_real_t position_m[2], const nmpc_real_t velocity_m_s[2])
{
    return within(position_m[0], NMPC_POSITION_RANGE_M) && within(position_m[1], NMPC_POSITION_RANGE_M)
           && within(velocity_m_s[0], NMPC_VELOCITY_RANGE_M_S) && within(velocity_m_s[1], NMPC_VELOCITY_RANGE_M_S);
}

NMPC_INLINE int is_good_state(const nmpc_state_t *state)
{
    int is_good = is_good_point(state->position_m, state->velocity_m_s)
                  && within(state->roll_rad, NMPC_ATTITUDE_RANGE_RAD)
                  && within(state->pitch_rad, NMPC_ATTITUDE_RANGE_RAD) && within(state->yaw_rad, NMPC_YAW_RANGE_RAD);

#if WITH_HEIGHT
    is_good =
        is_good && within(state->height_m, NMPC_POSITION_RANGE_M) && within(state->climb_m_s, NMPC_VELOCITY_RANGE_M_S);
#endif
    return is_good;
}

NMPC_INLINE int is_good_target(const nmpc_target_t *target)
{
    int is_good = is_good_point(target->position_m, target->velocity_m_s);

#if WITH_TARGET_OBSERVER
    is_good = is_good && within(target->acceleration_m_s2[0], NMPC_THRUST_ACCELERATION_MAX_M_S2)
              && within(target->acceleration_m_s2[1], NMPC_THRUST_ACCELERATION_MAX_M_S2);
    is_good = is_good && within(target->ahead_m_s2[0], NMPC_THRUST_ACCELERATION_MAX_M_S2)
              && within(target->ahead_m_s2[1], NMPC_THRUST_ACCELERATION_MAX_M_S2) && (target->known >= 0)
              && (target->known <= NMPC_MOST_KNOWN);
#endif
#if WITH_HEIGHT and WITH_TARGET_OBSERVER
    is_good = is_good && within(target->climb_acceleration_m_s2, NMPC_THRUST_ACCELERATION_MAX_M_S2);
    is_good = is_good && within(target->climb_ahead_m_s2, NMPC_THRUST_ACCELERATION_MAX_M_S2);
#endif
#if WITH_HEIGHT
    is_good = is_good && within(target->height_m, NMPC_POSITION_RANGE_M)
              && within(target->climb_m_s, NMPC_VELOCITY_RANGE_M_S);
#endif
    return is_good;
}

#if WITH_HEIGHT
static int is_good_thrust(nmpc_real_t thrust_m_s2)
{
    return within(thrust_m_s2, NMPC_THRUST_ACCELERATION_MAX_M_S2);
}
#else
NMPC_INLINE int is_good_thrust(nmpc_real_t thrust_acceleration_m_s2)
{
    return between(thrust_acceleration_m_s2, NMPC_THRUST_ACCELERATION_MIN_M_S2, NMPC_THRUST_ACCELERATION_MAX_M_S2);
}
#endif

static int is_good_command(const nmpc_command_t *command)
{
    int is_good =
        within(command->roll_rad, NMPC_ATTITUDE_RANGE_RAD) && within(command->pitch_rad, NMPC_ATTITUDE_RANGE_RAD);

#if WITH_HEIGHT
    is_good = is_good && is_good_thrust(command->thrust_m_s2);
#endif
    return is_good;
}
