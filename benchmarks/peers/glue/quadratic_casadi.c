#include "quadratic.h"
#include "mpc.h"
typedef casadi_real c_float;
#include "gradient.h"

static const casadi_real *arg[mpc_SZ_ARG];
static casadi_real *res[mpc_SZ_RES];
static casadi_int iw[mpc_SZ_IW];
static casadi_real w[mpc_SZ_W], found[4];

void run(const float state[16], float moves[2])
{
    casadi_real q[4];
    int memory;

    gradient(state, q);
    arg[0] = q;
    res[0] = found;
    memory = mpc_checkout();
    mpc(arg, res, iw, w, memory);
    mpc_release(memory);
    moves[0] = (float)(limits[0] * found[0]);
    moves[1] = (float)(limits[1] * found[2]);
}
