#include "run.h"
#include "cpg_workspace.h"
#include "cpg_solve.h"

#ifdef NEEDS_CLOCK /* ECOS reads a clock for its log; newlib leaves it to the board */
#include <time.h>

int clock_gettime(clockid_t clock, struct timespec *now)
{
    (void)clock;
    now->tv_sec = 0;
    now->tv_nsec = 0;
    return 0;
}
#endif

void run(const float error[4], const float last[2], float moves[4])
{
    int i;

    for (i = 0; i < 4; i++) {
        cpg_update_state(i, error[i]);
    }
    cpg_update_last(0, last[0]);
    cpg_update_last(1, last[1]);
    cpg_solve();
    for (i = 0; i < 4; i++) {
        moves[i] = (float)CPG_Result.prim->moves[i];
    }
}
