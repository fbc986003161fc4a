/* SPDX-License-Identifier: MIT-0
 *
 * Makes the calls in the file named by the first argument, and writes the outcome of every call to standard
 * output. The second argument limits the processor time, in seconds. Compiled with a bundle, never part of one.
 */
#include "nmpc_fuzz.c"

#include <math.h>
#include <sys/resource.h>

#include "nmpc_self_test.h"

#if defined(__has_feature)
#if __has_feature(memory_sanitizer)
#define NMPC_REPLAY_POISONED 1
#include <sanitizer/msan_interface.h>
#endif
#endif

/* The value of a command that no step has written. */
#define NMPC_REPLAY_UNWRITTEN ((nmpc_real_t)9)

/* Initialise memory with other content before, so that a member that nmpc_init() does not set shows in the
 * outcome or is reported by the sanitizer. Returns 0 if only padding keeps its content, and with a 1-norm if the weights
 * are those of the settings and everything else but the bounds is zero. With a quadratic cost each outcome has all numbers. */
static int nmpc_replay_init(nmpc_t *self)
{
    int wrong = 0;

    (void)memset(self, 0xA5, sizeof(*self));
#if defined(NMPC_REPLAY_POISONED)
    __msan_poison(self, sizeof(*self));
    nmpc_init(self);
#else
    {
        static union {
            nmpc_t controller;
            uint8_t bytes[sizeof(nmpc_t)];
        } one, other;
        size_t untouched = 0;
        size_t i;

        (void)memset(&other, 0x5A, sizeof(other));
        nmpc_init(self);
        nmpc_init(&other.controller);
        (void)memcpy(&one, self, sizeof(one));
#ifndef NMPC_STORED_NUMBERS
        wrong = (self->weights.tracking != NMPC_TRACKING_WEIGHT) || (self->weights.effort != NMPC_EFFORT_WEIGHT);
        (void)memset(&one.controller.weights, 0, sizeof(nmpc_weights_t));
        (void)memset(&other.controller.weights, 0, sizeof(nmpc_weights_t));
#ifdef NMPC_LIMIT_SPEED
        (void)memset(&one.controller.bounds, 0, sizeof(nmpc_bounds_t));
        (void)memset(&other.controller.bounds, 0, sizeof(nmpc_bounds_t));
#endif
#endif
        for (i = 0; i < sizeof(nmpc_t); i++) {
            if (one.bytes[i] != other.bytes[i]) {
                untouched++;
            } else {
#ifndef NMPC_STORED_NUMBERS
                wrong = wrong || (one.bytes[i] != 0U);
#endif
                wrong = wrong || (untouched > 0U); /* padding is at the end alone */
            }
        }
        wrong = wrong || (untouched >= sizeof(nmpc_sum_t));
    }
#endif
    return wrong;
}

static void nmpc_replay_write(const void *values, size_t bytes)
{
    if (fwrite(values, bytes, 1, stdout) != 1) {
        exit(2);
    }
}

#ifdef NMPC_STORED_NUMBERS
/* Write what a call leaves in the controller and in `command`. */
static void nmpc_replay_outcome(const nmpc_t *self, int32_t status, const nmpc_command_t *command)
{
    const int32_t numbers[3] = { status, (int32_t)self->steps_blind, (int32_t)nmpc_is_saturated(self) };

    nmpc_replay_write(numbers, sizeof(numbers));
    nmpc_replay_write(command, sizeof(*command));
    nmpc_replay_write(self, NMPC_STORED_NUMBERS * sizeof(nmpc_real_t));
#ifdef NMPC_LIMIT_SPEED
    {
        const int32_t active = (int32_t)(nmpc_limits_active(self) & ~NMPC_LIMIT_TILT);

        nmpc_replay_write(&active, sizeof(active));
    }
#endif
}
#else
/* Write what a call leaves in the controller and in `command`. */
static void nmpc_replay_outcome(const nmpc_t *self, int32_t status, const nmpc_command_t *command)
{
    const int32_t numbers[4] = { status, (int32_t)nmpc_last_iterations(self), (int32_t)nmpc_has_converged(self),
                                 (int32_t)nmpc_is_saturated(self) };
    const nmpc_sum_t cost = nmpc_last_cost(self);

    nmpc_replay_write(numbers, sizeof(numbers));
    nmpc_replay_write(command, sizeof(*command));
    nmpc_replay_write(&cost, sizeof(cost));
    nmpc_replay_write(self->gradient, sizeof(self->gradient));
    nmpc_replay_write(self->plan_rad, sizeof(self->plan_rad));
#ifdef NMPC_LIMIT_SPEED
    {
        const int32_t left[2] = { (int32_t)self->steps_blind, (int32_t)(nmpc_limits_active(self) & ~NMPC_LIMIT_TILT) };

        nmpc_replay_write(&self->bounds, sizeof(self->bounds));
        nmpc_replay_write(left, sizeof(left));
    }
#endif
}
#endif

static void nmpc_replay_call(nmpc_t *self, const uint8_t *bytes)
{
    const nmpc_fuzz_call_t call = nmpc_fuzz_decode(bytes);
    nmpc_command_t command;
    nmpc_real_t *const numbers = (nmpc_real_t *)(void *)&command;
    int32_t status;
    size_t i;

    for (i = 0; i < (sizeof(command) / sizeof(*numbers)); i++) {
        numbers[i] = NMPC_REPLAY_UNWRITTEN;
    }
    if ((call.function == NMPC_FUZZ_INIT) && ((call.nulls & NMPC_FUZZ_NULL_SELF) == 0U)) {
        status = (int32_t)nmpc_replay_init(self);
    } else {
        status = (int32_t)nmpc_fuzz_make(self, &call, &command);
    }
    nmpc_replay_outcome(self, status, &command);
}

/* nmpc_init() starts with what follows from the limits of nmpc_default_limits(), which sets nothing through null. */
static int starts_with_its_limits(nmpc_t *self)
{
    int is_good = 1;
#ifdef NMPC_LIMIT_SPEED
    nmpc_limits_t limits;
    nmpc_t other;

    nmpc_default_limits(NULL);
    nmpc_default_limits(&limits);
    nmpc_init(self);
    nmpc_init(&other);
    is_good = (nmpc_set_limits(&other, &limits) == NMPC_OK)
              && (memcmp(&self->bounds, &other.bounds, sizeof(other.bounds)) == 0) && (nmpc_limits_active(self) == 0U);
#else
    (void)self;
#endif
    return is_good;
}

static int passes_self_test(nmpc_t *self)
{
    unsigned long digest = 0UL;
    int episode;

    for (episode = 0; episode < NMPC_SELF_TEST_EPISODES; episode++) {
        digest = nmpc_self_test_episode(self, episode, digest);
    }
    return (nmpc_self_test(self) == 0) && (digest == NMPC_SELF_TEST_DIGEST);
}

#if defined(NMPC_POSITION_BITS)
/* With a height a step takes no thrust: it commands one. */
#ifdef NMPC_FUZZ_SET_THRUST
#define NMPC_REPLAY_THRUST(thrust_m_s2)
#else
#define NMPC_REPLAY_THRUST(thrust_m_s2) (thrust_m_s2),
#endif

/* A number of the C in SI units. */
static float in_si(nmpc_sum_t number, int bits)
{
    return (float)number / (float)((nmpc_sum_t)1 << bits);
}

static int is_alike(nmpc_status_t status, nmpc_status_t expected, const nmpc_float_command_t *found,
                    const nmpc_command_t *command)
{
    return (status == expected) && (found->roll_rad == in_si(command->roll_rad, NMPC_ANGLE_BITS))
           && (found->pitch_rad == in_si(command->pitch_rad, NMPC_ANGLE_BITS))
#ifdef NMPC_FUZZ_SET_THRUST
           && (found->thrust_m_s2 == in_si(command->thrust_m_s2, NMPC_THRUST_BITS))
#endif
        ;
}

/* The largest float that does not exceed a number. */
static float largest_float(nmpc_real_t number, int bits)
{
    const float found = in_si(number, bits);

    return (((double)found * (double)((nmpc_sum_t)1 << bits)) > (double)number) ? (found * 0.99999994f) : found;
}

/* A level command, with a height the command of hover. */
static nmpc_float_command_t level_command(void)
{
    nmpc_float_command_t command;

    (void)memset(&command, 0, sizeof(command));
#ifdef NMPC_FUZZ_SET_THRUST
    command.thrust_m_s2 = 9.75f;
#endif
    return command;
}

/* The same in numbers. */
static nmpc_command_t level_numbers(void)
{
    nmpc_command_t command;

    (void)memset(&command, 0, sizeof(command));
#ifdef NMPC_FUZZ_SET_THRUST
    command.thrust_m_s2 = NMPC_THRUST_ACCELERATION(9.75);
#endif
    return command;
}

/* Half a unit is rounded away from zero, less than half towards it. */
static int rounds_halves(nmpc_t *self)
{
    const float angle_unit_rad = 1.0f / (float)((nmpc_sum_t)1 << NMPC_ANGLE_BITS);
    const float given[3] = { 0.49999997f, 0.5f, 1.5f };
    const nmpc_real_t nearest[3] = { 0, 1, 2 };
    int is_good = 1;
    int i;

#ifndef NMPC_STORED_NUMBERS
    const nmpc_float_weights_t weights = { 0.49999997f / (float)((nmpc_sum_t)1 << NMPC_TRACKING_BITS),
                                           0.5f / (float)((nmpc_sum_t)1 << NMPC_EFFORT_BITS) };

    is_good = (nmpc_float_set_weights(self, &weights) == NMPC_OK) && (self->weights.tracking == 0)
              && (self->weights.effort == 1);
#endif
    for (i = 0; i < 3; i++) {
        nmpc_float_command_t last = level_command();

        last.roll_rad = given[i] * angle_unit_rad;
        last.pitch_rad = -given[i] * angle_unit_rad;
        is_good = is_good && (nmpc_float_reset(self, &last) == NMPC_OK) && (self->command_rad[0] == nearest[i])
                  && (self->command_rad[1] == -nearest[i]);
    }
    return is_good;
}

/* The largest floats within the ranges are accepted, an attitude beyond its range is not. */
static int takes_the_ends(nmpc_t *self)
{
    const float position_m = largest_float(NMPC_POSITION_RANGE_M, NMPC_POSITION_BITS);
    const float velocity_m_s = largest_float(NMPC_VELOCITY_RANGE_M_S, NMPC_VELOCITY_BITS);
    const float attitude_rad = largest_float(NMPC_ATTITUDE_RANGE_RAD, NMPC_ANGLE_BITS);
    nmpc_float_state_t state;
    nmpc_float_target_t target;
    const float thrust_m_s2 = largest_float(NMPC_THRUST_ACCELERATION_MAX_M_S2, NMPC_THRUST_BITS);
    nmpc_float_state_t other;
    nmpc_float_command_t command;
    int is_good = 1;
    int k;

    (void)thrust_m_s2;
    (void)memset(&state, 0, sizeof(state));
    (void)memset(&target, 0, sizeof(target));
    for (k = 0; k < 2; k++) {
        state.position_m[k] = (k == 0) ? position_m : -position_m;
        state.velocity_m_s[k] = (k == 0) ? velocity_m_s : -velocity_m_s;
        target.position_m[k] = -state.position_m[k];
        target.velocity_m_s[k] = -state.velocity_m_s[k];
    }
    state.roll_rad = attitude_rad;
    state.pitch_rad = -attitude_rad;
    state.yaw_rad = largest_float(NMPC_YAW_RANGE_RAD, NMPC_YAW_BITS);
#ifdef NMPC_FUZZ_SET_THRUST
    state.height_m = -position_m;
    state.climb_m_s = velocity_m_s;
    target.height_m = position_m;
    target.climb_m_s = -velocity_m_s;
#endif
    is_good = nmpc_float_step(self, &state, &target, NMPC_REPLAY_THRUST(thrust_m_s2) & command) == NMPC_OK;
    other = state;
    other.roll_rad = 2.0f * attitude_rad;
    is_good = is_good
              && (nmpc_float_step(self, &other, &target, NMPC_REPLAY_THRUST(thrust_m_s2) & command) == NMPC_BAD_STATE);
    other = state;
    other.pitch_rad = 2.0f * attitude_rad;
    is_good = is_good
              && (nmpc_float_step(self, &other, &target, NMPC_REPLAY_THRUST(thrust_m_s2) & command) == NMPC_BAD_STATE);
#ifdef NMPC_FUZZ_SET_THRUST
    other = state;
    other.height_m = 2.0f * position_m;
    is_good = is_good && (nmpc_float_step(self, &other, &target, &command) == NMPC_BAD_STATE)
              && (nmpc_float_report_thrust(self, thrust_m_s2) == NMPC_OK)
              && (nmpc_float_report_thrust(self, NAN) == NMPC_BAD_THRUST);
#endif
    return is_good;
}

#ifdef NMPC_STORED_NUMBERS
/* Set the last command of `self` with floats and of `other` with numbers. */
static int sets_alike(nmpc_t *self, nmpc_t *other)
{
    nmpc_float_command_t flown = level_command();
    nmpc_command_t flown_numbers = level_numbers();

    flown.roll_rad = 0.0625f;
    flown.pitch_rad = -0.125f;
    flown_numbers.roll_rad = NMPC_ANGLE(0.0625);
    flown_numbers.pitch_rad = NMPC_ANGLE(-0.125);
    return (nmpc_float_report_command(self, NULL) == NMPC_NULL_POINTER)
           && (nmpc_float_report_command(self, &flown) == nmpc_report_command(other, &flown_numbers));
}

/* The estimate in floats is that in numbers, divided by powers of two. */
static int tells_alike(const nmpc_t *self, const nmpc_t *other)
{
    nmpc_float_estimate_t found;
    nmpc_estimate_t expected;
    int is_good = (nmpc_float_last_estimate(self, NULL) == NMPC_NULL_POINTER)
                  && (nmpc_float_last_estimate(NULL, &found) == NMPC_NULL_POINTER)
                  && (nmpc_float_last_estimate(self, &found) == NMPC_OK)
                  && (nmpc_last_estimate(other, &expected) == NMPC_OK) && (found.is_valid == expected.is_valid);
    int axis;

#ifdef NMPC_FUZZ_SET_THRUST
    is_good = is_good && (found.height_m == in_si(expected.height_m, NMPC_POSITION_BITS))
              && (found.climb_m_s == in_si(expected.climb_m_s, NMPC_VELOCITY_BITS));
#endif
    for (axis = 0; is_good && (axis < 2); axis++) {
        is_good = (found.position_m[axis] == in_si(expected.position_m[axis], NMPC_POSITION_BITS))
                  && (found.velocity_m_s[axis] == in_si(expected.velocity_m_s[axis], NMPC_VELOCITY_BITS))
                  && (found.disturbance_m_s2[axis] == in_si(expected.disturbance_m_s2[axis], NMPC_DISTURBANCE_BITS));
    }
    return is_good;
}
#else
/* Set the weights of `self` with floats and of `other` with numbers: a float holds 24 bits of a weight. */
static int sets_alike(nmpc_t *self, nmpc_t *other)
{
    const nmpc_float_weights_t weights = { NMPC_TRACKING_WEIGHT / (float)(1L << NMPC_TRACKING_BITS),
                                           NMPC_EFFORT_WEIGHT / (float)(1L << NMPC_EFFORT_BITS) };

    return (nmpc_float_set_weights(self, NULL) == NMPC_NULL_POINTER)
           && (nmpc_float_set_weights(self, &weights) == NMPC_OK)
           && ((float)self->weights.effort == (float)NMPC_EFFORT_WEIGHT)
           && (nmpc_set_weights(other, &self->weights) == NMPC_OK);
}

static int tells_alike(const nmpc_t *self, const nmpc_t *other)
{
    return (nmpc_last_cost(self) == nmpc_last_cost(other))
           && (nmpc_float_last_cost(self) == in_si(nmpc_last_cost(other), NMPC_COST_BITS));
}
#endif

/* A jump of the frame in floats, with a turn of sixteenths of a radian, is that in numbers. */
static int shifts_alike(nmpc_t *self, nmpc_t *other, int sixteenths)
{
    const float position_m[3] = { 0.5f, -0.25f, 0.125f };
    const float velocity_m_s[3] = { 0.0078125f, -0.015625f, 0.25f };
    const float heading_rad = 0.0625f * (float)sixteenths;
    const nmpc_real_t position[3] = { NMPC_POSITION(0.5), NMPC_POSITION(-0.25), NMPC_POSITION(0.125) };
    const nmpc_real_t velocity[3] = { NMPC_VELOCITY(0.0078125), NMPC_VELOCITY(-0.015625), NMPC_VELOCITY(0.25) };
    int is_good = (nmpc_float_frame_jumped(self, NULL, velocity_m_s, heading_rad) == NMPC_NULL_POINTER)
                  && (nmpc_float_frame_jumped(self, position_m, NULL, heading_rad) == NMPC_NULL_POINTER);
    int axis;

    for (axis = 0; axis < 2; axis++) {
        float far[3] = { 0.0f, 0.0f, 0.0f };

        far[axis] = 1e9f;
        is_good = is_good && (nmpc_float_frame_jumped(self, far, velocity_m_s, heading_rad) == NMPC_BAD_JUMP)
                  && (nmpc_float_frame_jumped(self, position_m, far, heading_rad) == NMPC_BAD_JUMP);
    }
    return is_good && (nmpc_float_frame_jumped(self, position_m, velocity_m_s, heading_rad) == NMPC_OK)
           && (nmpc_frame_jumped(other, position, velocity, NMPC_YAW(0.0625) * sixteenths) == NMPC_OK);
}

/* A heading in floats is that in numbers. */
static int turns_alike(void)
{
    const float found_rad = nmpc_float_slew_heading(0.25f, -0.5f, 0.0625f);
    const nmpc_real_t expected = nmpc_slew_heading(NMPC_YAW(0.25), NMPC_YAW(-0.5), NMPC_YAW(0.0625));

    return found_rad == in_si(expected, NMPC_YAW_BITS);
}

/* A step with floats gives the same as one with the equal numbers of fixed point; floats outside every format are
 * refused. */
static int passes_floats(nmpc_t *self)
{
    const float position_unit_m = 1.0f / (float)(1L << NMPC_POSITION_BITS);
    const nmpc_real_t gravity_m_s2 = NMPC_THRUST_ACCELERATION(9.75);
    const float unheld[4] = { NAN, INFINITY, -INFINITY, 2147483648.0f / (float)(1L << NMPC_THRUST_BITS) };
    nmpc_float_state_t state;
    nmpc_float_target_t target;
    nmpc_state_t state_numbers;
    nmpc_target_t target_numbers;
    nmpc_float_command_t last = level_command();
    nmpc_command_t last_numbers = level_numbers();
    nmpc_t other;
    nmpc_command_t command;
    nmpc_float_command_t found;
    nmpc_status_t expected;
    int i;
    int is_good;

    (void)gravity_m_s2;
    (void)memset(&state, 0, sizeof(state));
    (void)memset(&target, 0, sizeof(target));
    (void)memset(&state_numbers, 0, sizeof(state_numbers));
    (void)memset(&target_numbers, 0, sizeof(target_numbers));
    state.position_m[0] = 0.5f;
    state.position_m[1] = -0.25f;
    state.velocity_m_s[0] = 0.125f;
    state.velocity_m_s[1] = -0.5f;
    state.roll_rad = 0.0625f;
    state.pitch_rad = -0.03125f;
    state.yaw_rad = 0.75f;
    target.position_m[0] = 0.75f * position_unit_m;
    target.position_m[1] = -0.75f * position_unit_m;
    target.velocity_m_s[1] = 0.25f;
    state_numbers.position_m[0] = NMPC_POSITION(0.5);
    state_numbers.position_m[1] = NMPC_POSITION(-0.25);
    state_numbers.velocity_m_s[0] = NMPC_VELOCITY(0.125);
    state_numbers.velocity_m_s[1] = NMPC_VELOCITY(-0.5);
    state_numbers.roll_rad = NMPC_ANGLE(0.0625);
    state_numbers.pitch_rad = NMPC_ANGLE(-0.03125);
    state_numbers.yaw_rad = NMPC_YAW(0.75);
    target_numbers.position_m[0] = 1;
    target_numbers.position_m[1] = -1;
    target_numbers.velocity_m_s[1] = NMPC_VELOCITY(0.25);
    last.roll_rad = 0.125f;
    last.pitch_rad = -0.25f;
    last_numbers.roll_rad = NMPC_ANGLE(0.125);
    last_numbers.pitch_rad = NMPC_ANGLE(-0.25);
#ifdef NMPC_FUZZ_SET_THRUST
    state.height_m = 0.5f;
    state.climb_m_s = -0.25f;
    state.on_ground = 1;
    target.height_m = 1.0f;
    target.climb_m_s = 0.125f;
    state_numbers.height_m = NMPC_POSITION(0.5);
    state_numbers.climb_m_s = NMPC_VELOCITY(-0.25);
    state_numbers.on_ground = 1;
    target_numbers.height_m = NMPC_POSITION(1.0);
    target_numbers.climb_m_s = NMPC_VELOCITY(0.125);
#endif

    nmpc_init(self);
    nmpc_init(&other);
    is_good = (nmpc_float_reset(self, NULL) == NMPC_NULL_POINTER)
              && (nmpc_float_step(self, &state, &target, NMPC_REPLAY_THRUST(9.75f) NULL) == NMPC_NULL_POINTER)
              && (nmpc_float_reset(self, &last) == nmpc_reset(&other, &last_numbers)) && sets_alike(self, &other);
    expected = nmpc_step(&other, &state_numbers, &target_numbers, NMPC_REPLAY_THRUST(gravity_m_s2) & command);
    is_good = is_good
              && is_alike(nmpc_float_step(self, &state, &target, NMPC_REPLAY_THRUST(9.75f) & found), expected, &found,
                          &command)
              && tells_alike(self, &other)
              && is_alike(nmpc_float_step(self, NULL, &target, NMPC_REPLAY_THRUST(9.75f) & found), NMPC_NULL_POINTER,
                          &found, &command)
              && is_alike(nmpc_float_step(self, &state, NULL, NMPC_REPLAY_THRUST(9.75f) & found), NMPC_NULL_POINTER,
                          &found, &command);
    for (i = 0; i < 2; i++) {
        is_good = is_good && shifts_alike(self, &other, i);
        expected = nmpc_step(&other, &state_numbers, &target_numbers, NMPC_REPLAY_THRUST(gravity_m_s2) & command);
        is_good = is_good
                  && is_alike(nmpc_float_step(self, &state, &target, NMPC_REPLAY_THRUST(9.75f) & found), expected, &found,
                              &command)
                  && tells_alike(self, &other);
    }
    for (i = 0; i < 4; i++) {
#ifdef NMPC_FUZZ_SET_THRUST
        is_good = is_good && (nmpc_float_report_thrust(self, unheld[i]) == NMPC_BAD_THRUST);
#else
        is_good = is_good
                  && is_alike(nmpc_float_step(self, &state, &target, unheld[i], &found),
                              (expected == NMPC_OK) ? NMPC_BAD_THRUST : expected, &found, &command);
#endif
    }
    return is_good && rounds_halves(self) && takes_the_ends(self) && turns_alike();
}
#else
static int passes_floats(nmpc_t *self)
{
    (void)self;
    return 1;
}
#endif

/* Returns 0, 2 if the file cannot be read or the output not written, 3 if the self-test, that of the limits or that of
 * floats fails. */
int main(int count, char **arguments)
{
    static nmpc_t self;
    uint8_t bytes[NMPC_FUZZ_BYTES];
    struct rlimit limit;
    FILE *file;

    if (count != 3) {
        return 2;
    }
    limit.rlim_cur = (rlim_t)strtoul(arguments[2], 0, 10);
    limit.rlim_max = limit.rlim_cur;
    (void)setrlimit(RLIMIT_CPU, &limit);
    file = fopen(arguments[1], "rb");
    if (file == 0) {
        return 2;
    }
    (void)nmpc_replay_init(&self);
    while (fread(bytes, sizeof(bytes), 1, file) == 1) {
        nmpc_replay_call(&self, bytes);
    }
    (void)fclose(file);
    return ((nmpc_version()[0] != '\0') && starts_with_its_limits(&self) && passes_self_test(&self)
            && passes_floats(&self))
               ? 0
               : 3;
}
