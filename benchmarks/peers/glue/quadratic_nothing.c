#define _POSIX_C_SOURCE 199309L
#include "quadratic.h"

void run(const float state[16], float moves[2])
{
    moves[0] = state[0];
    moves[1] = state[8];
}
