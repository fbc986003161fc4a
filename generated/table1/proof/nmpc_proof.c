/* SPDX-License-Identifier: MIT-0
 *
 * `make proof` proves, by abstract interpretation with Frama-C's plug-in Eva: for any inputs, including NaN and
 * infinity, and any number of calls in any order, there is no run-time error (access out of bounds or to uninitialised
 * memory, overflow, division by zero, conversion out of range), only finite numbers are stored, and no command exceeds
 * the tilt limit.
 *
 * There are two proofs. take_numbers() calls every function with any numbers and infinities; an operation that could
 * result in NaN is an alarm. refuse_nan() passes NaN: each call is refused and writes nothing into the controller, so
 * the states that take_numbers() covers are all states there are.
 *
 * Settings 1b8bfce44e6fc1aa. Not for firmware: Eva assumes that a read of a volatile variable gives any value of its type.
 */
#include <stddef.h>

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#define INPUTS 12

static volatile nmpc_real_t any_real;
static volatile int any_int;

/* The functions that have a contract above are static. */
#include "nmpc.c"

/* Returns any number or infinity. It has no body; Eva uses its contract. */
/*@ assigns \result \from any_int;
    ensures is_a_number: !\is_NaN(\result);
*/
nmpc_real_t any_number(void);

void take_numbers(void);
void refuse_nan(void);

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
    return target;
}

static nmpc_command_t command_of(const nmpc_real_t input[INPUTS])
{
    nmpc_command_t command;

    command.roll_rad = input[0];
    command.pitch_rad = input[1];
    return command;
}

static nmpc_weights_t weights_of(const nmpc_real_t input[INPUTS])
{
    nmpc_weights_t weights;

    weights.tracking = input[0];
    weights.effort = input[1];
    return weights;
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

static void reset(nmpc_t *self, const nmpc_real_t input[INPUTS])
{
    const nmpc_command_t command = command_of(input);

    (void)nmpc_reset(self, (any_int != 0) ? &command : NULL);
}

static void set_weights(nmpc_t *self, const nmpc_real_t input[INPUTS])
{
    const nmpc_weights_t weights = weights_of(input);

    (void)nmpc_set_weights(self, (any_int != 0) ? &weights : NULL);
}

static void read_results(const nmpc_t *self)
{
    (void)nmpc_last_cost(self);
    (void)nmpc_last_iterations(self);
    (void)nmpc_has_converged(self);
    (void)nmpc_is_saturated(self);
    (void)nmpc_version();
}

/* Check every stored number: all members of nmpc_t before its single bytes. */
static void check(const nmpc_t *self)
{
    const nmpc_real_t *stored = (const nmpc_real_t *)(const void *)self;
    unsigned int i;

    for (i = 0U; i < (offsetof(nmpc_t, iterations) / sizeof(nmpc_real_t)); i++) {
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
            set_weights(self, input);
            break;
        case 3:
            read_results(&controller);
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
        nmpc_weights_t weights;
        nmpc_status_t status;
        int i;

        for (i = 0; i < INPUTS; i++) {
            input[i] = any_real;
        }
        input[which] = zero / zero;
        state = state_of(input);
        target = target_of(input);
        command = command_of(input);
        weights = weights_of(input);

        if (which < 2) {
            status = nmpc_reset(self, &command);
            /*@ assert reset_refuses_nan: status != NMPC_OK; */
            status = nmpc_set_weights(self, &weights);
            /*@ assert set_weights_refuses_nan: status != NMPC_OK; */
        }
        status = nmpc_step(self, &state, &target, input[11], &command);
        /*@ assert step_refuses_nan: status != NMPC_OK; */
        (void)status;

        /* The same together with a null pointer. */
        (void)nmpc_reset(NULL, &command);
        (void)nmpc_set_weights(NULL, &weights);
        (void)nmpc_step(NULL, &state, &target, input[11], &command);
        (void)nmpc_step(self, NULL, &target, input[11], &command);
        (void)nmpc_step(self, &state, NULL, input[11], &command);
        (void)nmpc_step(self, &state, &target, input[11], NULL);
    }
}
