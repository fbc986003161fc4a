#include "run.h"
#include "api.h"
#include "utils.h"
#include "problem.h"

static c_float linear[4], plan[4], multipliers[4];
static c_float upper[4] = {TILT, TILT, TILT, TILT};
static c_float lower[4] = {-TILT, -TILT, -TILT, -TILT};
static int sense[4];
static DAQPProblem problem = {4, 4, 4, hessian, linear, NULL, upper, lower, sense};
static DAQPResult result = {plan, multipliers};
static DAQPWorkspace workspace;
static int is_set_up;

void run(const float error[4], const float last[2], float moves[4])
{
    int i;

    if (!is_set_up) {
        setup_daqp(&problem, &workspace, NULL);
        is_set_up = 1;
    }
    for (i = 0; i < 4; i++) {
        const c_float *row = &from_state[4 * i];

        linear[i] = row[0] * error[0] + row[1] * error[1] + row[2] * error[2] + row[3] * error[3];
    }
    linear[0] -= EFFORT * last[0];
    linear[1] -= EFFORT * last[1];
    daqp_update_ldp(DAQP_UPDATE_v, &workspace, &problem);
    daqp_solve(&result, &workspace);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)plan[i];
    }
}
