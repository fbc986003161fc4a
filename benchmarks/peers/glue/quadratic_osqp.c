#include "quadratic.h"
#include "osqp.h"
#include "workspace.h"
typedef OSQPFloat c_float;
#include "gradient.h"

void run(const float state[16], float moves[2])
{
    OSQPFloat q[4];

    gradient(state, q);
    osqp_update_data_vec(&solver, q, OSQP_NULL, OSQP_NULL);
    osqp_solve(&solver);
    moves[0] = (float)(limits[0] * solver.solution->x[0]);
    moves[1] = (float)(limits[1] * solver.solution->x[2]);
}
