#include "run.h"
#include "osqp.h"
#include "workspace.h"

static OSQPFloat q[48], lower[48], upper[48];

void run(const float error[4], const float last[2], float moves[4])
{
    int i;

    for (i = 44; i < 48; i++) {
        lower[i] = -TILT;
        upper[i] = TILT;
    }
    for (i = 0; i < 4; i++) {
        lower[i] = upper[i] = -error[i];
    }
    q[44] = -EFFORT * last[0];
    q[45] = -EFFORT * last[1];
    osqp_update_data_vec(&solver, q, lower, upper);
    osqp_solve(&solver);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)solver.solution->x[44 + i];
    }
}
