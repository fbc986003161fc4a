/* Products, named after their factors: a multiplication to 64 bits, and a shift to the format of the result.
 * The formats of nmpc.h are chosen such that no product overflows for inputs within their ranges. */
NMPC_INLINE nmpc_real_t thrust_product(nmpc_real_t thrust_m_s2, nmpc_real_t step_squared_s2)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)thrust_m_s2 * step_squared_s2,
                                     NMPC_THRUST_BITS + NMPC_STEP_SQUARED_BITS - NMPC_GAIN_BITS);
}

NMPC_INLINE nmpc_real_t sine_product(nmpc_real_t value, nmpc_real_t sine)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)value * sine, NMPC_SINE_BITS);
}

/* Half of the resolution of an error is added, so that error_change() rounds to nearest. */
NMPC_INLINE nmpc_real_t velocity_product(nmpc_real_t step_s, nmpc_real_t velocity_m_s)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)step_s * velocity_m_s,
                                     NMPC_STEP_BITS + NMPC_VELOCITY_BITS - NMPC_ACCELERATION_BITS)
           + ((nmpc_real_t)1 << (NMPC_ACCELERATION_BITS - NMPC_ERROR_BITS - 1));
}

/* The products of a roll-out, with a gain and with a share, are rounded down: that halves the instructions of each. */
NMPC_INLINE nmpc_real_t gain_product(nmpc_real_t gain_m_step2_rad, nmpc_real_t tilt_rad)
{
    return (nmpc_real_t)(((nmpc_sum_t)gain_m_step2_rad * tilt_rad)
                         >> (NMPC_GAIN_BITS + NMPC_ANGLE_BITS - NMPC_ACCELERATION_BITS));
}

#if not WITH_HALVES
/* The acceleration has room to be shifted left first: then the result is the upper word of the product. */
NMPC_INLINE nmpc_real_t acceleration_product(nmpc_real_t share, nmpc_real_t acceleration_m_step2)
{
    return (nmpc_real_t)(((nmpc_sum_t)share
                          * (nmpc_real_t)(acceleration_m_step2 * ((nmpc_real_t)1 << (32 - NMPC_SHARE_BITS))))
                         >> 32);
}
#else
NMPC_INLINE nmpc_real_t half(nmpc_real_t acceleration_m_step2)
{
    return acceleration_m_step2 >> 1;
}
#endif

/* Clamping an error whose sign no plan can change changes neither the gradient nor a difference of costs. */
NMPC_INLINE nmpc_real_t initial_error(nmpc_real_t difference_m)
{
    return clamp(difference_m, NMPC_ERROR_LIMIT_M) * ((nmpc_real_t)1 << (NMPC_ERROR_BITS - NMPC_POSITION_BITS));
}

NMPC_INLINE nmpc_real_t error_change(nmpc_real_t displacement_m_step)
{
    return displacement_m_step >> (NMPC_ACCELERATION_BITS - NMPC_ERROR_BITS);
}

/* Rounded down as well. */
NMPC_INLINE nmpc_real_t distance_gradient(nmpc_real_t gain_x_m_step2_rad, nmpc_real_t subgradient_x,
                                          nmpc_real_t gain_y_m_step2_rad, nmpc_real_t subgradient_y)
{
    return (nmpc_real_t)((((nmpc_sum_t)gain_x_m_step2_rad * subgradient_x)
                          + ((nmpc_sum_t)gain_y_m_step2_rad * subgradient_y))
                         >> (NMPC_GAIN_BITS + NMPC_RESPONSE_BITS - NMPC_DISTANCE_GRADIENT_BITS));
}

NMPC_INLINE nmpc_sum_t tracking_cost(nmpc_real_t weight, nmpc_sum_t distance_m)
{
    return weight * distance_m;
}

NMPC_INLINE nmpc_sum_t effort_cost(nmpc_real_t weight, nmpc_sum_t variation_rad)
{
    return NMPC_ROUNDED(weight * variation_rad, NMPC_EFFORT_BITS + NMPC_ANGLE_BITS - NMPC_COST_BITS);
}

NMPC_INLINE nmpc_sum_t tracking_gradient(nmpc_real_t weight, nmpc_real_t distance_gradient_m_rad)
{
    return (nmpc_sum_t)weight * distance_gradient_m_rad;
}

NMPC_INLINE nmpc_sum_t effort_gradient(nmpc_real_t weight)
{
    return weight * ((nmpc_sum_t)1 << (NMPC_GRADIENT_BITS - NMPC_EFFORT_BITS));
}

/* The step size is shifted left first too, and the product is rounded down. */
NMPC_INLINE nmpc_real_t step_product(nmpc_real_t step_rad, nmpc_real_t factor)
{
    return (nmpc_real_t)(((nmpc_sum_t)factor * (nmpc_real_t)(step_rad * ((nmpc_real_t)1 << (32 - NMPC_FACTOR_BITS))))
                         >> 32);
}
#if WITH_TRACKER

NMPC_INLINE nmpc_real_t target_product(nmpc_real_t factor, nmpc_real_t value)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)factor * value,
                                     NMPC_TRACKER_BITS + NMPC_VELOCITY_BITS - NMPC_ACCELERATION_BITS);
}

/* A gain of the tracker is at most 1 and has the format of a sine. */
NMPC_INLINE nmpc_real_t tracker_product(nmpc_real_t gain, nmpc_real_t acceleration_m_step2)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)gain * acceleration_m_step2, NMPC_SINE_BITS);
}
#endif
#if WITH_FEEDBACK

NMPC_INLINE nmpc_real_t feedback_product(nmpc_real_t steps, nmpc_real_t change_rad)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)steps * change_rad, NMPC_FEEDBACK_BITS);
}
#endif
