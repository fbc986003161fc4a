/* The call that contenders for the quadratic cost answer. Input: for right and forward e (m), v (m/step), and w, j, a,
 * i, c, u (m/step^2). Output: the first free moves, right and forward (m/step^2). */
void run(const float state[16], float moves[2]);

#ifdef TIMED /* a board has no such clock */
#include <time.h>

__attribute__((visibility("default"))) void time_all(const float *states, int count, float *moves, double *ns);

/* Time each call on `count` states (16), clock and call included; `moves` is (count, 2) and `ns` (count). */
void time_all(const float *states, int count, float *moves, double *ns)
{
    int i;

    for (i = 0; i < count; i++) {
        struct timespec start;
        struct timespec end;

        clock_gettime(CLOCK_MONOTONIC, &start);
        run(&states[16 * i], &moves[2 * i]);
        clock_gettime(CLOCK_MONOTONIC, &end);
        ns[i] = (1e9 * (double)(end.tv_sec - start.tv_sec)) + (double)(end.tv_nsec - start.tv_nsec);
    }
}
#endif
