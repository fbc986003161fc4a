/* Time each call of one contender. The clock readings are serialising. The overhead of clock and call is measured
 * separately, with an empty call, and not subtracted here. */
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

/* Read a byte of every cache line, which evicts everything else from caches smaller than `bytes`. */
static unsigned char sweep(const volatile unsigned char *room, size_t bytes)
{
    unsigned char sum = 0;
    size_t i;

    for (i = 0; i < bytes; i += 64) {
        sum = (unsigned char)(sum + room[i]);
    }
    return sum;
}

/* Call `run`, or an empty function if it is null, on `count` inputs (6): error and last command. If `follows`, the
 * last command is that of the previous call, initially 0. If `room` is given, it is swept before each call, then
 * clock and inputs are used once, so that only the contender's code and data are cold.
 * Outputs: `ns` (count), the time of each call, and `moves` (count, 4), its plan. */
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
