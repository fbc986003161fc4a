#define _POSIX_C_SOURCE 199309L
#include "quadratic.h"
#include "api.h"
#include "utils.h"
#include "gradient.h"

static c_float linear[4], plan[4], multipliers[4];
static int sense[4];
static DAQPProblem problem = {4, 4, 4, hessian, linear, NULL, upper, lower, sense};
static DAQPResult result = {plan, multipliers};
static DAQPWorkspace workspace;
static int is_set_up;

void run(const float state[16], float moves[2])
{
    if (!is_set_up) {
        setup_daqp(&problem, &workspace, NULL);
        is_set_up = 1;
    }
    gradient(state, linear);
    daqp_update_ldp(DAQP_UPDATE_v, &workspace, &problem);
    daqp_solve(&result, &workspace);
    moves[0] = (float)(limits[0] * plan[0]);
    moves[1] = (float)(limits[1] * plan[2]);
}
