/* Time one contender, call by call. Every reading of the clock waits for what came before it; what the readings
 * and the call itself take is measured with a call of nothing, and not taken off here. */
#define _POSIX_C_SOURCE 199309L

#include <stddef.h>
#include <time.h>

typedef void run_t(const float error[4], const float last[2], float moves[4]);

static void nothing(const float error[4], const float last[2], float moves[4])
{
    moves[0] = error[0] + error[1] + error[2] + error[3];
    moves[1] = last[0] + last[1];
}

run_t *volatile timing_nothing = nothing;

static long long now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (now.tv_sec * 1000000000LL) + now.tv_nsec;
}

/* Read a byte of every cache line, so that nothing else stays in a cache that is smaller. */
static unsigned char sweep(const volatile unsigned char *room, size_t bytes)
{
    unsigned char sum = 0;
    size_t i;

    for (i = 0; i < bytes; i += 64) {
        sum = (unsigned char)(sum + room[i]);
    }
    return sum;
}

/* Run `run`, or nothing if it is null, on `count` inputs of six numbers: error and last command. If `follows`,
 * the last command is that of the call before, from level on, and not the input's. `room`, if any, is swept
 * before each call; clock and inputs are then used once more, so that of all only the contender is cold.
 * `ns` is what each call took, `moves` (count, 4) what it planned. */
void timing_measure(run_t *run, const float *inputs, int count, int follows, const unsigned char *room, size_t bytes,
                    double *ns, float *moves)
{
    run_t *const timed = (run != NULL) ? run : timing_nothing;
    float last[2] = {0.0f, 0.0f};
    int i;

    for (i = 0; i < count; i++) {
        const float *input = &inputs[6 * i];
        float *plan = &moves[4 * i];
        long long start_ns;

        if (!follows) {
            last[0] = input[4];
            last[1] = input[5];
        }
        if (room != NULL) {
            (void)sweep(room, bytes);
            timing_nothing(input, last, plan);
            (void)now_ns();
        }
        start_ns = now_ns();
        timed(input, last, plan);
        ns[i] = (double)(now_ns() - start_ns);
        last[0] = plan[0];
        last[1] = plan[1];
    }
}
