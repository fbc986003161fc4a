/* The gradient of the control step's problem at moves of 0: shares of the limits, over the first element of H. */
#include "problem.h"

static void gradient(const float state[16], c_float linear[4])
{
    int axis;
    int move;
    int k;

    for (axis = 0; axis < 2; axis++) {
        for (move = 0; move < 2; move++) {
            const c_float *row = &from_state[8 * ((2 * axis) + move)];
            c_float sum = row[0] * state[8 * axis];

            for (k = 1; k < 8; k++) {
                sum += row[k] * state[(8 * axis) + k];
            }
            linear[(2 * axis) + move] = sum;
        }
    }
}
