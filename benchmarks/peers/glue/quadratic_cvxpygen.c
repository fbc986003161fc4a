#include "quadratic.h"
#include "cpg_workspace.h"
#include "cpg_solve.h"
typedef cpg_float c_float;
#include "gradient.h"

#ifdef SET_UP
static int is_set_up;
#endif

void run(const float state[16], float moves[2])
{
    cpg_float q[4];
    int i;

#ifdef SET_UP /* what its own main() calls first */
    if (!is_set_up) {
        cpg_set_solver_default_settings();
        is_set_up = 1;
    }
#endif
    gradient(state, q);
    for (i = 0; i < 4; i++) {
        cpg_update_q(i, q[i]);
    }
    cpg_solve();
    moves[0] = (float)(limits[0] * CPG_Result.prim->moves[0]);
    moves[1] = (float)(limits[1] * CPG_Result.prim->moves[2]);
}
