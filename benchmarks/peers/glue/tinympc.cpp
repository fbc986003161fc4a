#include "run.h"
#include "tinympc/tiny_api.hpp"
#include "tinympc/tiny_data.hpp"

void run(const float error[4], const float last[2], float moves[4])
{
    int i;
    tinyVector x0(4);

    (void)last;
    x0 << error[0], error[1], error[2], error[3];
    tiny_set_x0(&tiny_solver, x0);
    tiny_solve(&tiny_solver);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)tiny_solver.solution->u(i % 2, i / 2);
    }
}
