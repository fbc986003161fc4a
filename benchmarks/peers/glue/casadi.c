#include "run.h"
#include "mpc.h"

static const casadi_real *arg[mpc_SZ_ARG];
static casadi_real *res[mpc_SZ_RES];
static casadi_int iw[mpc_SZ_IW];
static casadi_real w[mpc_SZ_W], found[4];

void run(const float error[4], const float last[2], float moves[4])
{
    int i;
    casadi_real parameters[6];
    int memory;

    for (i = 0; i < 4; i++) {
        parameters[i] = error[i];
    }
    parameters[4] = last[0];
    parameters[5] = last[1];
    arg[0] = parameters;
    res[0] = found;
    memory = mpc_checkout();
    mpc(arg, res, iw, w, memory);
    mpc_release(memory);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)found[i];
    }
}
