/* SPDX-License-Identifier: MIT-0
 *
 * `make proof` proves, by abstract interpretation with Frama-C's plug-in Eva: for any inputs, including NaN and
 * infinity, and any number of calls in any order, there is no run-time error (access out of bounds or to uninitialised
 * memory, overflow, division by zero, conversion out of range), only finite numbers are stored, and no command exceeds
 * the tilt limit.
 *
 * There are three proofs. take_numbers() calls every function with any numbers and infinities; an operation that could
 * result in NaN is an alarm. refuse_nan() passes NaN: nmpc_reset(), nmpc_frame_jumped(), nmpc_report_command()
 * and nmpc_set_limits() refuse it and write nothing, and a step handles a state or a target with NaN
 * as take_numbers() shows it for one with an infinity: nothing reads it.
 * turn_everywhere() proves for every heading what take_numbers() assumes of sine and cosine.
 *
 * Settings 31da297514394eba. Not for firmware: Eva assumes that a read of a volatile variable gives any value of its
 * type.
 */
#include <stddef.h>

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x65406E0BUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#define INPUTS 16
#define AXES 2
#define TARGET 7 /* the first input that is not the state's */

static volatile nmpc_real_t any_real;
static volatile int any_int;

/* Far more than one, but small enough that no product overflows. */
#define SINE_LIMIT 8.0f

/* The index of the input that is NaN; INPUTS if none is. */
static int nan_at = INPUTS;

/*@ requires is_a_heading: nan_at == INPUTS ==> -NMPC_YAW_RANGE_RAD <= angle_rad <= NMPC_YAW_RANGE_RAD;
    requires has_room: \valid(sine) && \valid(cosine);
    assigns *sine, *cosine \from angle_rad;
    ensures are_set: \initialized(sine) && \initialized(cosine);
    ensures sine_is_small: \is_finite(*sine) && -SINE_LIMIT <= *sine <= SINE_LIMIT;
    ensures cosine_is_small: \is_finite(*cosine) && -SINE_LIMIT <= *cosine <= SINE_LIMIT;
*/
static void sine_cosine(nmpc_real_t angle_rad, nmpc_real_t *sine, nmpc_real_t *cosine);

/* Whatever reads a state also calls this. */
/*@ requires no_nan_in_the_state: nan_at >= TARGET;
    assigns tilt_m_step2[0 .. 1] \from *state;
    ensures are_set: \initialized(&tilt_m_step2[0 .. 1]);
*/
static void attitude_measure(const nmpc_state_t *state, nmpc_real_t tilt_m_step2[2]);

/* Whatever reads a target also calls this. */
/*@ requires no_nan_in_the_target: nan_at < TARGET || nan_at == INPUTS;
    assigns \result \from *bounds, fastest_m_s, position_m[0 .. 1], *target;
*/
static int limits_are_free(const nmpc_bounds_t *bounds, nmpc_real_t fastest_m_s, const nmpc_real_t position_m[2],
                           const nmpc_target_t *target);

/* More than 1/sqrt(x) for any x that is a square of a speed or of a distance beyond the knee. */
#define ROOT_LIMIT 63245.555f

/* The shift of the bits of a float means nothing to Eva; tests try inverse_root() for every float from 1 to 4, and for
 * others times 4, which halves it. */
/*@ requires is_no_small_square: nan_at == INPUTS ==> x >= 1e-09f;
    assigns \result \from x;
    ensures is_small: \is_finite(\result) && 0 <= \result <= ROOT_LIMIT;
    ensures of_a_speed: x >= 0.009f ==> \result <= 12.0f;
    ensures of_a_braking: x >= 0.1f ==> \result <= 4.0f;
*/
static nmpc_real_t inverse_root(nmpc_real_t x);

/* Of any number it is proven with its body; a memory is never NaN. */
/*@ assigns \result \from beyond, last;
    ensures is_a_row: 0 <= \result <= last;
*/
static int motion_row(nmpc_real_t beyond, int last);

/* The functions that have a contract above are static. */
#include "nmpc.c"

/* Returns any number or infinity. It has no body; Eva uses its contract. */
/*@ assigns \result \from any_int;
    ensures is_a_number: !\is_NaN(\result);
*/
nmpc_real_t any_number(void);

void take_numbers(void);
void refuse_nan(void);
void turn_everywhere(void);

static void draw_numbers(nmpc_real_t input[INPUTS])
{
    int i;

    for (i = 0; i < INPUTS; i++) {
        input[i] = any_number();
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
    target.acceleration_m_s2[0] = input[12];
    target.acceleration_m_s2[1] = input[13];
    target.ahead_m_s2[0] = input[14];
    target.ahead_m_s2[1] = input[15];
    target.known = any_int;
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
    const nmpc_real_t next_rad = nmpc_slew_heading(any_number(), any_number(), any_number());

    (void)range_rad;
    (void)next_rad;
    /*@ assert heading_is_within_the_range: -range_rad <= next_rad <= range_rad; */
}

static void shift(nmpc_t *self, const nmpc_real_t input[INPUTS])
{
    (void)nmpc_frame_jumped(self, (any_int != 0) ? input : NULL, (any_int != 0) ? &input[AXES] : NULL, input[2 * AXES]);
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

static void report_command(nmpc_t *self, const nmpc_real_t input[INPUTS])
{
    const nmpc_command_t command = command_of(input);

    (void)nmpc_report_command(self, (any_int != 0) ? &command : NULL);
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

/* Check every stored number: all members of nmpc_t before its single bytes. */
static void check(const nmpc_t *self)
{
    const nmpc_real_t *stored = (const nmpc_real_t *)(const void *)self;
    unsigned int i;

    for (i = 0U; i < (offsetof(nmpc_t, steps_blind) / sizeof(nmpc_real_t)); i++) {
        /*@ assert stored_number_is_finite: \is_finite(stored[i]); */
        (void)stored[i];
    }
}

void take_numbers(void)
{
    nmpc_t controller;

    slew_heading();
    nmpc_init(&controller);
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
            report_command(self, input);
            break;
        case 3:
            read_results(&controller);
            break;
        case 4:
            set_limits(self, input);
            break;
        case 7:
            shift(self, input);
            break;
        default:
            step(self, input);
            break;
        }
        check(&controller);
    }
}

/* A controller in any state, in memory that must not be written. */
extern const nmpc_t untouchable;

/* One that a step may write. */
extern nmpc_t any_controller;

void refuse_nan(void)
{
    nmpc_t *self = (nmpc_t *)&untouchable;
    const nmpc_real_t zero = (nmpc_real_t)0;
    int which;

    for (which = 0; which < INPUTS; which++) {
        nmpc_real_t input[INPUTS];
        nmpc_state_t state;
        nmpc_target_t target;
        nmpc_command_t command;
        nmpc_status_t status;
        int i;

        for (i = 0; i < INPUTS; i++) {
            input[i] = any_real;
        }
        input[which] = zero / zero;
        state = state_of(input);
        target = target_of(input);
        command = command_of(input);
        nan_at = which;

        if (which < 2) {
            status = nmpc_reset(self, &command);
            /*@ assert reset_refuses_nan: status != NMPC_OK; */
            status = nmpc_report_command(self, &command);
            /*@ assert report_command_refuses_nan: status != NMPC_OK; */
        }
        if (which <= (2 * AXES)) {
            status = nmpc_frame_jumped(self, input, &input[AXES], input[2 * AXES]);
            /*@ assert shift_refuses_nan: status != NMPC_OK; */
        }
        if (which < 7) {
            const nmpc_limits_t limits = limits_of(input);

            status = nmpc_set_limits(self, &limits);
            /*@ assert set_limits_refuses_nan: status != NMPC_OK; */
        }
        status = nmpc_step(&any_controller, &state, &target, input[11], &command);
        /*@ assert step_refuses_nan: status != NMPC_OK; */
        (void)status;

        /* The same together with a null pointer. */
        (void)nmpc_reset(NULL, &command);
        (void)nmpc_frame_jumped(NULL, input, &input[AXES], input[2 * AXES]);
        (void)nmpc_report_command(NULL, &command);
        (void)nmpc_step(NULL, &state, &target, input[11], &command);
        (void)nmpc_step(self, NULL, &target, input[11], &command);
        (void)nmpc_step(self, &state, NULL, input[11], &command);
        (void)nmpc_step(&any_controller, &state, &target, input[11], NULL);
    }
}

static void turn(nmpc_real_t first_rad, nmpc_real_t last_rad)
{
    const nmpc_real_t angle_rad = any_number();
    nmpc_real_t sine;
    nmpc_real_t cosine;

    if ((angle_rad >= first_rad) && (angle_rad <= last_rad) && (angle_rad >= -NMPC_YAW_RANGE_RAD)
        && (angle_rad <= NMPC_YAW_RANGE_RAD)) {
        sine_cosine(angle_rad, &sine, &cosine);
        /*@ assert sine_is_small: \is_finite(sine) && -SINE_LIMIT <= sine <= SINE_LIMIT; */
        /*@ assert cosine_is_small: \is_finite(cosine) && -SINE_LIMIT <= cosine <= SINE_LIMIT; */
    }
}

/* Try every heading, by quarters of a turn. */
void turn_everywhere(void)
{
    const nmpc_real_t quarter_rad = 1.5707964f;
    int quarter;

    for (quarter = -653; quarter < 653; quarter++) {
        turn((nmpc_real_t)quarter * quarter_rad, (nmpc_real_t)(quarter + 1) * quarter_rad);
    }
}
