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

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* A call is one byte and NMPC_FUZZ_REALS numbers of the host's format. Bits 0 and 1 of the byte choose the
 * function; each of the bits 2 to 5 makes a pointer argument null, the first argument's first. */
#define NMPC_FUZZ_REALS 12
#define NMPC_FUZZ_BYTES (1U + (NMPC_FUZZ_REALS * sizeof(nmpc_real_t)))
#define NMPC_FUZZ_STEP 0U
#define NMPC_FUZZ_RESET 1U
#define NMPC_FUZZ_SET_WEIGHTS 2U
#define NMPC_FUZZ_INIT 3U
#define NMPC_FUZZ_SLEW_HEADING 6U /* written as 1 with bit 6 */
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

/* One call, decoded: a step reads state, target and thrust, nmpc_reset() start, nmpc_set_weights() weights. */
typedef struct {
    unsigned int function;
    unsigned int nulls;
    nmpc_state_t state;
    nmpc_target_t target;
    nmpc_real_t thrust_acceleration_m_s2;
    nmpc_command_t start;
    nmpc_real_t headings_rad[3]; /* previous, wanted, most change */
    nmpc_weights_t weights;
} nmpc_fuzz_call_t;

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
    call.thrust_acceleration_m_s2 = values[11];
    call.headings_rad[0] = values[0];
    call.headings_rad[1] = values[1];
    call.headings_rad[2] = values[2];
    if ((call.function == NMPC_FUZZ_RESET) && (((unsigned int)bytes[0] & 64U) != 0U)) {
        call.function = NMPC_FUZZ_SLEW_HEADING;
    }
    call.start.roll_rad = values[0];
    call.start.pitch_rad = values[1];
    call.weights.tracking = values[0];
    call.weights.effort = values[1];
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
    case NMPC_FUZZ_SET_WEIGHTS:
        status = nmpc_set_weights(self, no_first ? 0 : &call->weights);
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

static int nmpc_fuzz_is_good_point(const nmpc_real_t position_m[2], const nmpc_real_t velocity_m_s[2])
{
    return nmpc_fuzz_lies_in(position_m[0], -NMPC_POSITION_RANGE_M, NMPC_POSITION_RANGE_M)
           && nmpc_fuzz_lies_in(position_m[1], -NMPC_POSITION_RANGE_M, NMPC_POSITION_RANGE_M)
           && nmpc_fuzz_lies_in(velocity_m_s[0], -NMPC_VELOCITY_RANGE_M_S, NMPC_VELOCITY_RANGE_M_S)
           && nmpc_fuzz_lies_in(velocity_m_s[1], -NMPC_VELOCITY_RANGE_M_S, NMPC_VELOCITY_RANGE_M_S);
}

static int nmpc_fuzz_is_good_target(const nmpc_target_t *target)
{
    return nmpc_fuzz_is_good_point(target->position_m, target->velocity_m_s);
}

/* Return the status that nmpc.h promises for a step without null pointers. */
static nmpc_status_t nmpc_fuzz_promised_step(const nmpc_fuzz_call_t *call)
{
    const nmpc_real_t tilt_rad = NMPC_ATTITUDE_RANGE_RAD;
    nmpc_status_t status = NMPC_OK;

    if (!nmpc_fuzz_lies_in(call->thrust_acceleration_m_s2, NMPC_THRUST_ACCELERATION_MIN_M_S2,
                           NMPC_THRUST_ACCELERATION_MAX_M_S2)) {
        status = NMPC_BAD_THRUST;
    }
    if (!nmpc_fuzz_is_good_target(&call->target)) {
        status = NMPC_BAD_TARGET;
    }
    if (!(nmpc_fuzz_is_good_point(call->state.position_m, call->state.velocity_m_s)
          && nmpc_fuzz_lies_in(call->state.roll_rad, -tilt_rad, tilt_rad)
          && nmpc_fuzz_lies_in(call->state.pitch_rad, -tilt_rad, tilt_rad)
          && nmpc_fuzz_lies_in(call->state.yaw_rad, -NMPC_YAW_RANGE_RAD, NMPC_YAW_RANGE_RAD))) {
        status = NMPC_BAD_STATE;
    }
    return status;
}

/* Return the status that nmpc.h promises for `call`; NMPC_OK for nmpc_init(), which returns none. */
static nmpc_status_t nmpc_fuzz_promised(const nmpc_fuzz_call_t *call)
{
    const nmpc_real_t tilt_rad = NMPC_ATTITUDE_RANGE_RAD;
    unsigned int pointers = NMPC_FUZZ_NULL_SELF | NMPC_FUZZ_NULL_FIRST;
    nmpc_status_t status = NMPC_OK;

    switch (call->function) {
    case NMPC_FUZZ_STEP:
        pointers |= NMPC_FUZZ_NULL_SECOND | NMPC_FUZZ_NULL_COMMAND;
        status = nmpc_fuzz_promised_step(call);
        break;
    case NMPC_FUZZ_RESET:
        if (!(nmpc_fuzz_lies_in(call->start.roll_rad, -tilt_rad, tilt_rad)
              && nmpc_fuzz_lies_in(call->start.pitch_rad, -tilt_rad, tilt_rad))) {
            status = NMPC_BAD_COMMAND;
        }
        break;
    case NMPC_FUZZ_SET_WEIGHTS:
        if (!(nmpc_fuzz_lies_in(call->weights.tracking, (nmpc_real_t)0, NMPC_TRACKING_WEIGHT_LIMIT)
              && nmpc_fuzz_lies_in(call->weights.effort, (nmpc_real_t)0, NMPC_EFFORT_WEIGHT_LIMIT))) {
            status = NMPC_BAD_WEIGHT;
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
static nmpc_real_t nmpc_fuzz_limited(nmpc_real_t value)
{
    if (value > NMPC_TILT_LIMIT_RAD) {
        return NMPC_TILT_LIMIT_RAD;
    }
    return (value < -NMPC_TILT_LIMIT_RAD) ? -NMPC_TILT_LIMIT_RAD : value;
}

/* Make `call` on `self`, and if it is good also on `twin`, which gets good calls only; check every promise. `last` is
 * the command that a refused step repeats. */
static void nmpc_fuzz_check(nmpc_t *self, nmpc_t *twin, const nmpc_fuzz_call_t *call, nmpc_command_t *last)
{
    const nmpc_status_t promised = nmpc_fuzz_promised(call);
    nmpc_command_t command = { (nmpc_real_t)9, (nmpc_real_t)9 };
    nmpc_command_t twin_command = { (nmpc_real_t)9, (nmpc_real_t)9 };
    nmpc_t before;

    (void)memcpy(&before, self, sizeof(before));
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_make(self, call, &command) == promised);
    if (promised != NMPC_OK) {
        NMPC_FUZZ_REQUIRE(memcmp(&before, self, sizeof(before)) == 0);
        if ((call->function == NMPC_FUZZ_STEP) && ((call->nulls & NMPC_FUZZ_NULL_COMMAND) == 0U)) {
            const int level = (call->nulls & NMPC_FUZZ_NULL_SELF) != 0U;

            NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.roll_rad, level ? (nmpc_real_t)0 : last->roll_rad));
            NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.pitch_rad, level ? (nmpc_real_t)0 : last->pitch_rad));
        }
    } else if ((call->nulls & NMPC_FUZZ_NULL_SELF) == 0U) {
        /* Recovery and determinism: a controller that never saw bad input computes the same bits. */
        NMPC_FUZZ_REQUIRE(nmpc_fuzz_make(twin, call, &twin_command) == NMPC_OK);
        NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.roll_rad, twin_command.roll_rad));
        NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.pitch_rad, twin_command.pitch_rad));
        NMPC_FUZZ_REQUIRE(nmpc_last_cost(self) == nmpc_last_cost(twin));
        NMPC_FUZZ_REQUIRE(nmpc_last_iterations(self) == nmpc_last_iterations(twin));
        NMPC_FUZZ_REQUIRE(nmpc_has_converged(self) == nmpc_has_converged(twin));
        if (call->function == NMPC_FUZZ_STEP) {
            *last = command;
        } else if (call->function == NMPC_FUZZ_RESET) {
            last->roll_rad = nmpc_fuzz_limited(call->start.roll_rad);
            last->pitch_rad = nmpc_fuzz_limited(call->start.pitch_rad);
        } else if (call->function == NMPC_FUZZ_INIT) {
            last->roll_rad = (nmpc_real_t)0;
            last->pitch_rad = (nmpc_real_t)0;
        } else {
            /* New weights do not change the command, nor does a heading. */
        }
    } else {
        /* nmpc_init(NULL) does nothing. */
    }

    NMPC_FUZZ_REQUIRE(nmpc_step(self, 0, 0, (nmpc_real_t)0, &command) == NMPC_NULL_POINTER);
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.roll_rad, last->roll_rad));
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_same(command.pitch_rad, last->pitch_rad));
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_lies_in(command.roll_rad, -NMPC_TILT_LIMIT_RAD, NMPC_TILT_LIMIT_RAD));
    NMPC_FUZZ_REQUIRE(nmpc_fuzz_lies_in(command.pitch_rad, -NMPC_TILT_LIMIT_RAD, NMPC_TILT_LIMIT_RAD));
    NMPC_FUZZ_REQUIRE((nmpc_last_iterations(self) >= 0) && (nmpc_last_iterations(self) <= NMPC_ITERATIONS));
    NMPC_FUZZ_REQUIRE((nmpc_has_converged(self) == 0) || (nmpc_has_converged(self) == 1));
    NMPC_FUZZ_REQUIRE(nmpc_last_cost(self) >= (nmpc_sum_t)0);
    NMPC_FUZZ_REQUIRE(nmpc_is_saturated(self)
                      == ((last->roll_rad == NMPC_TILT_LIMIT_RAD) || (last->roll_rad == -NMPC_TILT_LIMIT_RAD)
                          || (last->pitch_rad == NMPC_TILT_LIMIT_RAD) || (last->pitch_rad == -NMPC_TILT_LIMIT_RAD)));
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
