/* SPDX-License-Identifier: MIT-0
 *
 * Makes the calls in a file, the first argument, and writes what came of every call to the standard output. The
 * second is the time of the processor that this may take, in seconds. Compiled together with a bundle, never
 * part of one.
 */
#include "nmpc_fuzz.c"

#include <sys/resource.h>

#include "nmpc_self_test.h"

#if defined(__has_feature)
#if __has_feature(memory_sanitizer)
#define NMPC_REPLAY_POISONED 1
#include <sanitizer/msan_interface.h>
#endif
#endif

/* What a command holds that no step wrote. */
#define NMPC_REPLAY_UNWRITTEN ((nmpc_real_t)9)

/* Initialise memory that held something else, such that reading what is not set shows: in the outcome, or to
 * the sanitizer. Returns 0 if all is as promised: the weights of the settings, all else zero but padding. */
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
        wrong = (self->weights.tracking != NMPC_TRACKING_WEIGHT) || (self->weights.effort != NMPC_EFFORT_WEIGHT);
        (void)memcpy(&one, self, sizeof(one));
        (void)memset(&one.controller.weights, 0, sizeof(nmpc_weights_t));
        (void)memset(&other.controller.weights, 0, sizeof(nmpc_weights_t));
        for (i = 0; i < sizeof(nmpc_t); i++) {
            if (one.bytes[i] != other.bytes[i]) {
                untouched++;
            } else {
                wrong = wrong || (one.bytes[i] != 0U) || (untouched > 0U); /* padding is at the end alone */
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

static void nmpc_replay_call(nmpc_t *self, const uint8_t *bytes)
{
    const nmpc_fuzz_call_t call = nmpc_fuzz_decode(bytes);
    nmpc_command_t command = { NMPC_REPLAY_UNWRITTEN, NMPC_REPLAY_UNWRITTEN };
    int32_t numbers[3];
    nmpc_sum_t cost;

    if ((call.function == NMPC_FUZZ_INIT) && ((call.nulls & NMPC_FUZZ_NULL_SELF) == 0U)) {
        numbers[0] = (int32_t)nmpc_replay_init(self);
    } else {
        numbers[0] = (int32_t)nmpc_fuzz_make(self, &call, &command);
    }
    numbers[1] = (int32_t)nmpc_last_iterations(self);
    numbers[2] = (int32_t)nmpc_has_converged(self);
    cost = nmpc_last_cost(self);
    nmpc_replay_write(numbers, sizeof(numbers));
    nmpc_replay_write(&command, sizeof(command));
    nmpc_replay_write(&cost, sizeof(cost));
    nmpc_replay_write(self->gradient, sizeof(self->gradient));
    nmpc_replay_write(self->plan_rad, sizeof(self->plan_rad));
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

/* Returns 0, 2 if the file cannot be read or the output not written, 3 if the self-test fails. */
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
    return ((nmpc_version()[0] != '\0') && passes_self_test(&self)) ? 0 : 3;
}
