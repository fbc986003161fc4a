/* SPDX-License-Identifier: MIT-0
 *
 * `make proof` proves, by abstract interpretation with Frama-C's plug-in Eva: for any inputs, and any number of calls
 * in any order, there is no access out of bounds or to uninitialised memory, no overflow, no division by zero, no shift
 * beyond the type, and no command beyond the tilt limit.
 *
 * take_numbers() calls every function, and assumes of sine and cosine what turn_everywhere() proves for every heading:
 * no overflow, and a magnitude of at most one plus rounding.
 *
 * Settings 38dc42dde7443ad2. Not for firmware: Eva assumes that a read of a volatile variable gives any value of its type.
 */
#include <stddef.h>

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x48A3891DUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#define INPUTS 12

static volatile nmpc_real_t any_real;
static volatile int any_int;

/* One plus more than rounding can add. */
#define SINE_LIMIT ((nmpc_real_t)1075000000)

/*@ requires is_a_heading: -NMPC_YAW_RANGE_RAD <= angle_rad <= NMPC_YAW_RANGE_RAD;
    requires has_room: \valid(sine) && \valid(cosine);
    assigns *sine, *cosine \from angle_rad;
    ensures are_set: \initialized(sine) && \initialized(cosine);
    ensures sine_is_small: -SINE_LIMIT <= *sine <= SINE_LIMIT;
    ensures cosine_is_small: -SINE_LIMIT <= *cosine <= SINE_LIMIT;
*/
static void sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine);

/* The functions that have a contract above are static. */
#include "nmpc.c"

void take_numbers(void);
void turn_everywhere(void);

static void draw_numbers(nmpc_real_t input[INPUTS])
{
    int i;

    for (i = 0; i < INPUTS; i++) {
        input[i] = any_real;
    }
}

static nmpc_state_t state_of(const nmpc_real_t input[INPUTS])
{
    nmpc_state_t state;

    state.position_m[0] = input[0];
    state.position_m[1] = input[1];
    state.velocity_m_s[0] = input[2];
    state.velocity_m_s[1] = input[3];
    state.roll_rad = input[4];
    state.pitch_rad = input[5];
    state.yaw_rad = input[6];
    return state;
}

static nmpc_target_t target_of(const nmpc_real_t input[INPUTS])
{
    nmpc_target_t target;

    target.position_m[0] = input[7];
    target.position_m[1] = input[8];
    target.velocity_m_s[0] = input[9];
    target.velocity_m_s[1] = input[10];
    return target;
}

static nmpc_command_t command_of(const nmpc_real_t input[INPUTS])
{
    nmpc_command_t command;

    command.roll_rad = input[0];
    command.pitch_rad = input[1];
    return command;
}

/* Step with pointers that may be null. The command is uninitialised, so the step must write it. */
static void step(nmpc_t *self, const nmpc_real_t input[INPUTS])
{
    const nmpc_state_t state = state_of(input);
    const nmpc_target_t target = target_of(input);
    const nmpc_real_t limit_rad = NMPC_TILT_LIMIT_RAD;
    nmpc_command_t command;

    (void)nmpc_step(self, (any_int != 0) ? &state : NULL, (any_int != 0) ? &target : NULL, input[11], &command);
    (void)limit_rad;
    /*@ assert roll_is_within_the_limit: -limit_rad <= command.roll_rad <= limit_rad; */
    /*@ assert pitch_is_within_the_limit: -limit_rad <= command.pitch_rad <= limit_rad; */
    (void)nmpc_step(self, &state, &target, input[11], NULL);
}

/* Slew any heading by any change. */
static void slew_heading(void)
{
    const nmpc_real_t range_rad = NMPC_YAW_RANGE_RAD;
    const nmpc_real_t next_rad = nmpc_slew_heading(any_real, any_real, any_real);

    (void)range_rad;
    (void)next_rad;
    /*@ assert heading_is_within_the_range: -range_rad <= next_rad <= range_rad; */
}

static void reset(nmpc_t *self, const nmpc_real_t input[INPUTS])
{
    const nmpc_command_t command = command_of(input);

    (void)nmpc_reset(self, (any_int != 0) ? &command : NULL);
}

static nmpc_limits_t limits_of(const nmpc_real_t input[INPUTS])
{
    nmpc_limits_t limits;

    limits.speed_m_s = input[0];
    limits.braking_m_s2 = input[1];
    limits.fence_min_m[0] = input[2];
    limits.fence_min_m[1] = input[3];
    limits.fence_max_m[0] = input[4];
    limits.fence_max_m[1] = input[5];
    limits.tilt_rad = input[6];
    return limits;
}

static void set_limits(nmpc_t *self, const nmpc_real_t input[INPUTS])
{
    nmpc_limits_t limits = limits_of(input);

    nmpc_default_limits((any_int != 0) ? &limits : NULL);
    (void)nmpc_set_limits(self, (any_int != 0) ? &limits : NULL);
}

static void set_command(nmpc_t *self, const nmpc_real_t input[INPUTS])
{
    const nmpc_command_t command = command_of(input);

    (void)nmpc_set_command(self, (any_int != 0) ? &command : NULL);
}

static void read_results(const nmpc_t *self)
{
    nmpc_estimate_t estimate;

    (void)nmpc_is_saturated(self);
    (void)nmpc_limits_active(self);
    (void)nmpc_last_estimate(self, &estimate);
    (void)nmpc_last_estimate(NULL, &estimate);
    (void)nmpc_last_estimate(self, NULL);
    (void)nmpc_version();
}

void take_numbers(void)
{
    nmpc_t controller;

    slew_heading();
    nmpc_init(&controller);
    /* The stored numbers grow from call to call up to their bounds; the hints save Eva coarser guesses. */
    /*@ loop widen_hints "all", -3539225, 3539225, -11744051, 11744051, -20615843, 20615843, -39320788, 39320788, -62212207, 62212207, -62834329, 62834329, -134217728, 134217728, -262144000, 262144000; */
    while (any_int != 0) {
        nmpc_t *self = (any_int != 0) ? &controller : NULL;
        nmpc_real_t input[INPUTS];

        draw_numbers(input);
        switch (any_int) {
        case 0:
            nmpc_init(self);
            break;
        case 1:
            reset(self, input);
            break;
        case 2:
            set_command(self, input);
            break;
        case 3:
            read_results(&controller);
            break;
        case 4:
            set_limits(self, input);
            break;
        default:
            step(self, input);
            break;
        }
    }
}

/* Return the smallest angle whose nearest quarter turn is `quadrant`. */
static nmpc_sum_t start_of(nmpc_sum_t quadrant)
{
    const nmpc_sum_t turns = ((2 * quadrant) - 1) * ((nmpc_sum_t)1 << (30 + NMPC_YAW_BITS));
    const nmpc_sum_t angle = turns / 1367130551;

    return angle + (((turns > 0) && ((turns % 1367130551) != 0)) ? 1 : 0);
}

static void turn(nmpc_sum_t first_rad, nmpc_sum_t last_rad)
{
    const nmpc_real_t angle_rad = any_real;
    nmpc_real_t sine;
    nmpc_real_t cosine;

    if ((angle_rad >= first_rad) && (angle_rad <= last_rad) && (angle_rad >= -NMPC_YAW_RANGE_RAD)
        && (angle_rad <= NMPC_YAW_RANGE_RAD)) {
        sine_cosine(angle_rad, &sine, &cosine);
        /*@ assert sine_is_a_sine: -SINE_LIMIT <= sine <= SINE_LIMIT; */
        /*@ assert cosine_is_a_cosine: -SINE_LIMIT <= cosine <= SINE_LIMIT; */
    }
}

/* Try every heading, by halves of a quarter turn. */
void turn_everywhere(void)
{
    int quadrant;

    for (quadrant = -653; quadrant <= 653; quadrant++) {
        const nmpc_sum_t first_rad = start_of(quadrant);
        const nmpc_sum_t next_rad = start_of(quadrant + 1);
        const nmpc_sum_t middle_rad = (first_rad + next_rad) / 2;

        turn(first_rad, middle_rad);
        turn(middle_rad, next_rad - 1);
    }
}
