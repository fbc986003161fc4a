#include "run.h"
#include "api.h"
#include "utils.h"
#include "problem.h"

static c_float plan[28], multipliers[76];
static int sense[76];
static DAQPProblem problem = {28, 76, 28, hessian, linear, constraints, upper, lower, sense};
static DAQPResult result = {plan, multipliers};
static DAQPWorkspace workspace;
static int is_set_up;

void run(const float error[4], const float last[2], float moves[4])
{
    int i;

    for (i = 0; i < 24; i++) {
        const c_float *row = &from_input[6 * i];

        upper[28 + i] = row[0] * error[0] + row[1] * error[1] + row[2] * error[2] + row[3] * error[3] +
                        row[4] * last[0] + row[5] * last[1];
        upper[52 + i] = -upper[28 + i];
    }
    if (!is_set_up) {
        setup_daqp(&problem, &workspace, NULL);
        is_set_up = 1;
    } else {
        daqp_update_ldp(DAQP_UPDATE_d, &workspace, &problem);
    }
    daqp_solve(&result, &workspace);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)plan[i];
    }
}
