#include "run.h"
#include "osqp.h"
#include "workspace.h"

static const OSQPFloat from_state[4][4] = {GRADIENT};

void run(const float error[4], const float last[2], float moves[4])
{
    int i;
    OSQPFloat q[4];

    for (i = 0; i < 4; i++) {
        q[i] = from_state[i][0] * error[0] + from_state[i][1] * error[1] + from_state[i][2] * error[2] +
               from_state[i][3] * error[3];
    }
    q[0] -= EFFORT * last[0];
    q[1] -= EFFORT * last[1];
    osqp_update_data_vec(&solver, q, OSQP_NULL, OSQP_NULL);
    osqp_solve(&solver);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)solver.solution->x[i];
    }
}
