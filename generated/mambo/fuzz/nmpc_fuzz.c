/* SPDX-License-Identifier: MIT-0
 *
 * Fuzzing: decodes any bytes as calls of the controller, and checks every promise of nmpc.h after each call. It needs
 * clang and its run-time library (Debian: clang, libclang-rt-*-dev). In the folder of the bundle:
 *
 *   mkdir -p build/corpus
 *   clang -std=c99 -g -O1 -ffp-contract=off -fno-sanitize-recover=all \
 *       -fsanitize=fuzzer,address,undefined,float-divide-by-zero,implicit-conversion,local-bounds \
 *       -I. -o build/fuzz fuzz/nmpc_fuzz.c nmpc.c
 *   build/fuzz -seed=1 -runs=1000000 -artifact_prefix=build/ build/corpus
 *
 * It stops at the first broken promise, prints it, and writes the bytes to build/crash-*; `build/fuzz build/crash-*`
 * repeats them. Not part of the library.
 */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x65406E0BUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* A call is one byte and NMPC_FUZZ_REALS numbers of the host's format. Bits 0 and 1 of the byte choose the
 * function; each of the bits 2 to 5 makes a pointer argument null, the first argument's first. */
#define NMPC_FUZZ_REALS 17
#define NMPC_FUZZ_BYTES (1U + (NMPC_FUZZ_REALS * sizeof(nmpc_real_t)))
#define NMPC_FUZZ_STEP 0U
#define NMPC_FUZZ_RESET 1U
#define NMPC_FUZZ_SET_COMMAND 2U
#define NMPC_FUZZ_INIT 3U
#define NMPC_FUZZ_SET_LIMITS 4U /* written as 2 with bit 6 */
#define NMPC_FUZZ_SLEW_HEADING 6U /* written as 1 with bit 6 */
#define NMPC_FUZZ_SHIFT 8U /* written as 0 with bit 7 */
#define NMPC_FUZZ_AXES 2
#define NMPC_FUZZ_NULL_SELF 1U
#define NMPC_FUZZ_NULL_FIRST 2U
#define NMPC_FUZZ_NULL_SECOND 4U
#define NMPC_FUZZ_NULL_COMMAND 8U

#define NMPC_FUZZ_REQUIRE(promise) \
    do { \
        if (!(promise)) { \
            (void)fprintf(stderr, "broken promise, line %d: %s\n", __LINE__, #promise); \
            abort(); \
        } \
    } while (0)

/* One call, decoded: a step reads state, target and thrust, nmpc_reset() and nmpc_report_command() start. */
typedef struct {
    unsigned int function;
    unsigned int nulls;
    nmpc_state_t state;
    nmpc_target_t target;
    nmpc_real_t thrust_acceleration_m_s2;
    nmpc_command_t start;
    nmpc_real_t headings_rad[3]; /* previous, wanted, most change */
    nmpc_real_t position_change_m[NMPC_FUZZ_AXES];
    nmpc_real_t velocity_change_m_s[NMPC_FUZZ_AXES];
    nmpc_real_t heading_change_rad;
    nmpc_limits_t limits;
} nmpc_fuzz_call_t;

/* A whole number. A fraction, NaN, and what is less than 0 or large become 100, which no `known` is. */
static int nmpc_fuzz_whole(nmpc_real_t number)
{
    const int found = ((number >= (nmpc_real_t)0) && (number < (nmpc_real_t)100)) ? (int)number : 100;

    return (number > (nmpc_real_t)found) ? 100 : found;
}

static nmpc_fuzz_call_t nmpc_fuzz_decode(const uint8_t *bytes)
{
    nmpc_real_t values[NMPC_FUZZ_REALS];
    nmpc_fuzz_call_t call;

    (void)memcpy(values, &bytes[1], sizeof(values));
    call.function = (unsigned int)bytes[0] & 3U;
    call.nulls = ((unsigned int)bytes[0] >> 2) & 15U;
    call.state.position_m[0] = values[0];
    call.state.position_m[1] = values[1];
    call.state.velocity_m_s[0] = values[2];
    call.state.velocity_m_s[1] = values[3];
    call.state.roll_rad = values[4];
    call.state.pitch_rad = values[5];
    call.state.yaw_rad = values[6];
    call.target.position_m[0] = values[7];
    call.target.position_m[1] = values[8];
    call.target.velocity_m_s[0] = values[9];
    call.target.velocity_m_s[1] = values[10];
    call.target.acceleration_m_s2[0] = values[12];
    call.target.acceleration_m_s2[1] = values[13];
    call.target.ahead_m_s2[0] = values[14];
    call.target.ahead_m_s2[1] = values[15];
    call.target.known = nmpc_fuzz_whole(values[16]);
    call.thrust_acceleration_m_s2 = values[11];
    call.start.roll_rad = values[0];
    call.start.pitch_rad = values[1];
    (void)memcpy(call.position_change_m, &values[0], sizeof(call.position_change_m));
    (void)memcpy(call.velocity_change_m_s, &values[NMPC_FUZZ_AXES], sizeof(call.velocity_change_m_s));
    call.heading_change_rad = values[2 * NMPC_FUZZ_AXES];
    if ((call.function == NMPC_FUZZ_STEP) && (((unsigned int)bytes[0] & 128U) != 0U)) {
        call.function = NMPC_FUZZ_SHIFT;
    }
    call.headings_rad[0] = values[0];
    call.headings_rad[1] = values[1];
    call.headings_rad[2] = values[2];
    if ((call.function == NMPC_FUZZ_RESET) && (((unsigned int)bytes[0] & 64U) != 0U)) {
        call.function = NMPC_FUZZ_SLEW_HEADING;
    }
    if ((call.function == 2U) && (((unsigned int)bytes[0] & 64U) != 0U)) {
        call.function = NMPC_FUZZ_SET_LIMITS;
    }
    call.limits.speed_m_s = values[0];
    call.limits.braking_m_s2 = values[1];
    call.limits.fence_min_m[0] = values[2];
    call.limits.fence_min_m[1] = values[3];
    call.limits.fence_max_m[0] = values[4];
    call.limits.fence_max_m[1] = values[5];
    call.limits.tilt_rad = values[6];
    return call;
}

/* Make `call`; a step writes `command`, a heading its roll. */
static nmpc_status_t nmpc_fuzz_make(nmpc_t *controller, const nmpc_fuzz_call_t *call, nmpc_command_t *command)
{
    nmpc_t *self = ((call->nulls & NMPC_FUZZ_NULL_SELF) != 0U) ? 0 : controller;
    const int no_first = (call->nulls & NMPC_FUZZ_NULL_FIRST) != 0U;
    const int no_second = (call->nulls & NMPC_FUZZ_NULL_SECOND) != 0U;
    const int no_command = (call->nulls & NMPC_FUZZ_NULL_COMMAND) != 0U;
    nmpc_status_t status = NMPC_OK;

    switch (call->function) {
    case NMPC_FUZZ_STEP:
        status = nmpc_step(self, no_first ? 0 : &call->state, no_second ? 0 : &call->target,
                           call->thrust_acceleration_m_s2, no_command ? 0 : command);
        break;
    case NMPC_FUZZ_RESET:
        status = nmpc_reset(self, no_first ? 0 : &call->start);
        break;
    case NMPC_FUZZ_SET_COMMAND:
        status = nmpc_report_command(self, no_first ? 0 : &call->start);
        break;
    case NMPC_FUZZ_SET_LIMITS:
        status = nmpc_set_limits(self, no_first ? 0 : &call->limits);
        break;
    case NMPC_FUZZ_SHIFT:
        status = nmpc_frame_jumped(self, no_first ? 0 : call->position_change_m,
                                   no_second ? 0 : call->velocity_change_m_s, call->heading_change_rad);
        break;
    case NMPC_FUZZ_SLEW_HEADING:
        command->roll_rad = nmpc_slew_heading(call->headings_rad[0], call->headings_rad[1], call->headings_rad[2]);
        break;
    default:
        nmpc_init(self);
        break;
    }
    return status;
}

static int nmpc_fuzz_lies_in(nmpc_real_t value, nmpc_real_t least, nmpc_real_t most)
{
    return !((value != value) || (value < least) || (value > most));
}

static int nmpc_fuzz_is_within(nmpc_real_t value, nmpc_real_t most)
{
    return nmpc_fuzz_lies_in(value, -most, most);
}

static int nmpc_fuzz_is_good_state(const nmpc_state_t *state)
{
    int good = 1;

    good = good && nmpc_fuzz_is_within(state->position_m[0], NMPC_POSITION_RANGE_M);
    good = good && nmpc_fuzz_is_within(state->position_m[1], NMPC_POSITION_RANGE_M);
    good = good && nmpc_fuzz_is_within(state->velocity_m_s[0], NMPC_VELOCITY_RANGE_M_S);
    good = good && nmpc_fuzz_is_within(state->velocity_m_s[1], NMPC_VELOCITY_RANGE_M_S);
    good = good && nmpc_fuzz_is_within(state->roll_rad, NMPC_ATTITUDE_RANGE_RAD);
    good = good && nmpc_fuzz_is_within(state->pitch_rad, NMPC_ATTITUDE_RANGE_RAD);
    good = good && nmpc_fuzz_is_within(state->yaw_rad, NMPC_YAW_RANGE_RAD);
    return good;
}

static int nmpc_fuzz_is_good_target(const nmpc_target_t *target)
{
    int good = 1;

    good = good && nmpc_fuzz_is_within(target->position_m[0], NMPC_POSITION_RANGE_M);
    good = good && nmpc_fuzz_is_within(target->position_m[1], NMPC_POSITION_RANGE_M);
    good = good && nmpc_fuzz_is_within(target->velocity_m_s[0], NMPC_VELOCITY_RANGE_M_S);
    good = good && nmpc_fuzz_is_within(target->velocity_m_s[1], NMPC_VELOCITY_RANGE_M_S);
    good = good && nmpc_fuzz_is_within(target->acceleration_m_s2[0], NMPC_THRUST_ACCELERATION_MAX_M_S2);
    good = good && nmpc_fuzz_is_within(target->acceleration_m_s2[1], NMPC_THRUST_ACCELERATION_MAX_M_S2);
    good = good && nmpc_fuzz_is_within(target->ahead_m_s2[0], NMPC_THRUST_ACCELERATION_MAX_M_S2);
    good = good && nmpc_fuzz_is_within(target->ahead_m_s2[1], NMPC_THRUST_ACCELERATION_MAX_M_S2);
    good = good && (target->known >= 0) && (target->known <= NMPC_MOST_KNOWN);
    return good;
}

static int nmpc_fuzz_is_good_command(const nmpc_command_t *command)
{
    int good = 1;

    good = good && nmpc_fuzz_is_within(command->roll_rad, NMPC_ATTITUDE_RANGE_RAD);
    good = good && nmpc_fuzz_is_within(command->pitch_rad, NMPC_ATTITUDE_RANGE_RAD);
    return good;
}

/* Return whether a jump of the frame is within its ranges. */
static int nmpc_fuzz_is_good_shift(const nmpc_fuzz_call_t *call)
{
    int good = nmpc_fuzz_is_within(call->heading_change_rad, NMPC_YAW_RANGE_RAD);
    int axis;

    for (axis = 0; axis < NMPC_FUZZ_AXES; axis++) {
        good = good && nmpc_fuzz_is_within(call->position_change_m[axis], NMPC_POSITION_RANGE_M)
               && nmpc_fuzz_is_within(call->velocity_change_m_s[axis], NMPC_VELOCITY_RANGE_M_S);
    }
    return good;
}

/* Return the status that nmpc.h promises for a step without null pointers. */
static nmpc_status_t nmpc_fuzz_promised_step(const nmpc_fuzz_call_t *call)
{
    nmpc_status_t status = NMPC_OK;

    if (!nmpc_fuzz_lies_in(call->thrust_acceleration_m_s2, NMPC_THRUST_ACCELERATION_MIN_M_S2,
                           NMPC_THRUST_ACCELERATION_MAX_M_S2)) {
        status = NMPC_BAD_THRUST;
    }
    if (!nmpc_fuzz_is_good_target(&call->target)) {
        status = NMPC_BAD_TARGET;
    }
    if (!nmpc_fuzz_is_good_state(&call->state)) {
        status = NMPC_BAD_STATE;
    }
    return status;
}

/* Return whether every limit lies within its range; a braking may still be more than the tilt limit gives. */
static int nmpc_fuzz_are_in_range(const nmpc_limits_t *limits)
{
    int axis;
    int good = nmpc_fuzz_lies_in(limits->speed_m_s, NMPC_SMALLEST_SPEED_LIMIT_M_S, NMPC_VELOCITY_RANGE_M_S)
               && nmpc_fuzz_lies_in(limits->tilt_rad, (nmpc_real_t)0, NMPC_TILT_LIMIT_RAD)
               && !((limits->braking_m_s2 != limits->braking_m_s2)
                    || (limits->braking_m_s2 < NMPC_SMALLEST_BRAKING_LIMIT_M_S2));

    for (axis = 0; axis < 2; axis++) {
        good = good && nmpc_fuzz_lies_in(limits->fence_min_m[axis], -NMPC_POSITION_RANGE_M, NMPC_POSITION_RANGE_M)
               && nmpc_fuzz_lies_in(limits->fence_max_m[axis], -NMPC_POSITION_RANGE_M, NMPC_POSITION_RANGE_M)
               && (limits->fence_min_m[axis] < limits->fence_max_m[axis]);
    }
    return good;
}

/* Return the status that nmpc.h promises for limits: another controller's, where they are in range. */
static nmpc_status_t nmpc_fuzz_promised_limits(const nmpc_limits_t *limits)
{
    static nmpc_t other;

    nmpc_init(&other);
    return nmpc_fuzz_are_in_range(limits) ? nmpc_set_limits(&other, limits) : NMPC_BAD_LIMITS;
}

/* Return the status that nmpc.h promises for `call`; NMPC_OK for nmpc_init(), which returns none. */
static nmpc_status_t nmpc_fuzz_promised(const nmpc_fuzz_call_t *call)
{
    unsigned int pointers = NMPC_FUZZ_NULL_SELF | NMPC_FUZZ_NULL_FIRST;
    nmpc_status_t status = NMPC_OK;

    switch (call->function) {
    case NMPC_FUZZ_STEP:
        pointers |= NMPC_FUZZ_NULL_SECOND | NMPC_FUZZ_NULL_COMMAND;
        status = nmpc_fuzz_promised_step(call);
        break;
    case NMPC_FUZZ_RESET:
    case NMPC_FUZZ_SET_COMMAND:
        if (!nmpc_fuzz_is_good_command(&call->start)) {
            status = NMPC_BAD_COMMAND;
        }
        break;
    case NMPC_FUZZ_SET_LIMITS:
        status = nmpc_fuzz_promised_limits(&call->limits);
        break;
    case NMPC_FUZZ_SHIFT:
        pointers |= NMPC_FUZZ_NULL_SECOND;
        if (!nmpc_fuzz_is_good_shift(call)) {
            status = NMPC_BAD_JUMP;
        }
        break;
    default:
        pointers = 0U;
        break;
    }
    return ((call->nulls & pointers) != 0U) ? NMPC_NULL_POINTER : status;
}

/* Return whether two numbers have the same bits. */
static int nmpc_fuzz_same(nmpc_real_t a, nmpc_real_t b)
{
    return memcmp(&a, &b, sizeof(a)) == 0;
}

/* Return `value` clamped to the tilt limit. */
static nmpc_real_t nmpc_fuzz_limited(const nmpc_t *self, nmpc_real_t value)
{
    if (value > self->bounds.tilt_rad) {
        return self->bounds.tilt_rad;
    }
    return (value < -self->bounds.tilt_rad) ? -self->bounds.tilt_rad : value;
}

/* The numbers of a controller, in the order of its members. */
static const nmpc_real_t *nmpc_fuzz_stored(const nmpc_t *self)
{
    return (const nmpc_real_t *)(const void *)self;
}

/* Return `call` with every refused input replaced by another that is refused for the same reason. */
static nmpc_fuzz_call_t nmpc_fuzz_other_refused(const nmpc_fuzz_call_t *call)
{
    nmpc_fuzz_call_t other = *call;

    if (nmpc_fuzz_promised_step(call) == NMPC_BAD_STATE) {
        other.state.position_m[0] = (nmpc_real_t)2 * NMPC_POSITION_RANGE_M;
        other.state.roll_rad = (nmpc_real_t)0;
    }
    if (!nmpc_fuzz_is_good_target(&call->target)) {
        other.target.velocity_m_s[1] = (nmpc_real_t)2 * NMPC_VELOCITY_RANGE_M_S;
        other.target.position_m[0] = (nmpc_real_t)0;
    }
    return other;
}

/* Make `call` on `self` and `twin`, which gets other values in place of refused ones; check every promise. `last` is
 * the last command. */
static void nmpc_fuzz_check(nmpc_t *self, nmpc_t *twin, const nmpc_fuzz_call_t *call, nmpc_command_t *last)
{
    const nmpc_status_t promised = nmpc_fuzz_promised(call);
    const nmpc_fuzz_call_t other = nmpc_fuzz_other_refused(call);
    const int is_step = call->function == NMPC_FUZZ_STEP;
    const int has_self = (call->nulls & NMPC_FUZZ_NULL_SELF) == 0U;
    nmpc_command_t command = { (nmpc_real_t)9, (nmpc_real_t)9 };
    nmpc_command_t twin_command = { (nmpc_real_t)9, (nmpc_real_t)9 };
    nmpc_estimate_t estimate;
    nmpc_t before;
    int k;

    (void)memcpy(&before, self, sizeof(before));
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_make(self, call, &command) == promised);
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_make(twin, &other, &twin_command) == promised);
    if ((promised == NMPC_NULL_POINTER) || (promised == NMPC_BAD_COMMAND) || (promised == NMPC_BAD_JUMP)
        || (promised == NMPC_BAD_LIMITS)) {
        NMPC_FUZZ_REQUIRE(memcmp(&before, self, sizeof(before)) == 0);
        if (is_step && ((call->nulls & NMPC_FUZZ_NULL_COMMAND) == 0U)) {
            NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.roll_rad, has_self ? last->roll_rad : (nmpc_real_t)0));
            NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.pitch_rad, has_self ? last->pitch_rad : (nmpc_real_t)0));
        }
    } else if (is_step && ((promised == NMPC_BAD_TARGET) || (promised == NMPC_BAD_THRUST)
                           || ((promised == NMPC_BAD_STATE) && (before.steps_blind >= (NMPC_OUTAGE_STEPS + 2U))))) {
        /* The last command, at first less its rate feedback. */
        if (before.steps_blind != 0U) {
            NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.roll_rad, last->roll_rad));
            NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.pitch_rad, last->pitch_rad));
        }
        *last = command;
    } else if (is_step) {
        *last = command;
    } else if ((call->function == NMPC_FUZZ_RESET) || (call->function == NMPC_FUZZ_SET_COMMAND)) {
        last->roll_rad = nmpc_fuzz_limited(self, call->start.roll_rad);
        last->pitch_rad = nmpc_fuzz_limited(self, call->start.pitch_rad);
    } else if (call->function == NMPC_FUZZ_SET_LIMITS) {
        last->roll_rad = nmpc_fuzz_limited(self, last->roll_rad);
        last->pitch_rad = nmpc_fuzz_limited(self, last->pitch_rad);
    } else if (call->function == NMPC_FUZZ_SHIFT) {
        NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(self->command_rad[0], before.command_rad[0]));
        NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(self->command_rad[1], before.command_rad[1]));
    } else if (call->function == NMPC_FUZZ_SLEW_HEADING) {
        NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.roll_rad, twin_command.roll_rad));
        NMPC_FUZZ_REQUIRE(nmpc_fuzz_lies_in(command.roll_rad, -NMPC_YAW_RANGE_RAD, NMPC_YAW_RANGE_RAD));
        NMPC_FUZZ_REQUIRE(memcmp(&before, self, sizeof(before)) == 0);
    } else if (has_self) {
        last->roll_rad = (nmpc_real_t)0;
        last->pitch_rad = (nmpc_real_t)0;
    } else {
        /* nmpc_init(NULL) does nothing. */
    }

    /* Determinism: what is refused leaves no trace of its value. */
    for (k = 0; k < NMPC_STORED_NUMBERS; k++) {
        const nmpc_real_t stored = nmpc_fuzz_stored(self)[k];

        NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(stored, nmpc_fuzz_stored(twin)[k]));
        NMPC_FUZZ_REQUIRE((stored - stored) == (nmpc_real_t)0);
    }
    NMPC_FUZZ_REQUIRE((self->steps_blind == twin->steps_blind) && (nmpc_is_saturated(self) == nmpc_is_saturated(twin)));
    NMPC_FUZZ_REQUIRE(nmpc_limits_active(self) == nmpc_limits_active(twin));
    NMPC_FUZZ_REQUIRE(nmpc_step(self, 0, 0, (nmpc_real_t)0, &command) == NMPC_NULL_POINTER);
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.roll_rad, last->roll_rad));
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.pitch_rad, last->pitch_rad));
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_lies_in(command.roll_rad, -self->bounds.tilt_rad, self->bounds.tilt_rad));
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_lies_in(command.pitch_rad, -self->bounds.tilt_rad, self->bounds.tilt_rad));
    NMPC_FUZZ_REQUIRE((nmpc_is_saturated(self) == 0) || (nmpc_is_saturated(self) == 1));
    NMPC_FUZZ_REQUIRE(nmpc_last_estimate(self, 0) == NMPC_NULL_POINTER);
    NMPC_FUZZ_REQUIRE(nmpc_last_estimate(0, &estimate) == NMPC_NULL_POINTER);
    NMPC_FUZZ_REQUIRE(nmpc_last_estimate(self, &estimate) == NMPC_OK);
    NMPC_FUZZ_REQUIRE((estimate.is_valid == 0) || (estimate.is_valid == 1));
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

/* The two controllers start in memory with different, nonzero content. */
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    static nmpc_t self;
    static nmpc_t twin;
    nmpc_command_t last = { (nmpc_real_t)0, (nmpc_real_t)0 };
    size_t at;

    (void)memset(&self, 0xA5, sizeof(self));
    (void)memset(&twin, 0x5A, sizeof(twin));
    nmpc_init(&self);
    nmpc_init(&twin);
    for (at = 0; (size - at) >= NMPC_FUZZ_BYTES; at += NMPC_FUZZ_BYTES) {
        const nmpc_fuzz_call_t call = nmpc_fuzz_decode(&bytes[at]);

        nmpc_fuzz_check(&self, &twin, &call, &last);
    }
    return 0;
}
