/* ---- Heading --------------------------------------------------------------------------------------------------------
 *
 * Set-points of a yaw loop, which this controller does not command.
 */

#include "heading.h"

nmpc_real_t nmpc_slew_heading(nmpc_real_t previous_rad, nmpc_real_t wanted_rad, nmpc_real_t most_change_rad)
{
    nmpc_sum_t change_rad;
    nmpc_sum_t next_rad;

    if (within(previous_rad, NMPC_YAW_RANGE_RAD) == 0) {
        return (nmpc_real_t)0;
    }
    if ((within(wanted_rad, NMPC_YAW_RANGE_RAD) == 0) || !(most_change_rad > (nmpc_real_t)0)) {
        return previous_rad;
    }

    /* The shortest way: less whole turns. */
    change_rad = (nmpc_sum_t)wanted_rad - previous_rad;
#if WITH_FIXED
    change_rad =
        change_rad - (NMPC_ROUNDED(change_rad * NMPC_QUARTER_TURNS_PER_RAD, 33 + NMPC_YAW_BITS) * NMPC_TURN_RAD);
#else
    change_rad = change_rad - ((((change_rad * NMPC_TURNS_PER_RAD) + NMPC_ROUNDING) - NMPC_ROUNDING) * NMPC_TURN_RAD);
#endif
    if (change_rad > most_change_rad) {
        change_rad = most_change_rad;
    } else if (change_rad < -most_change_rad) {
        change_rad = -most_change_rad;
    } else {
        /* The heading is reached. */
    }
    next_rad = previous_rad + change_rad;
    if (next_rad > NMPC_YAW_RANGE_RAD) {
        next_rad = next_rad - NMPC_TURN_RAD;
    } else if (next_rad < -NMPC_YAW_RANGE_RAD) {
        next_rad = next_rad + NMPC_TURN_RAD;
    } else {
        /* The heading is within its range. */
    }
    /* Rounding aside this changes nothing: it tells a proof by intervals how large the heading is. */
    return (nmpc_real_t)((next_rad > NMPC_YAW_RANGE_RAD)
                             ? NMPC_YAW_RANGE_RAD
                             : ((next_rad < -NMPC_YAW_RANGE_RAD) ? -NMPC_YAW_RANGE_RAD : next_rad));
}
