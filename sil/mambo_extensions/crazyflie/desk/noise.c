#include "noise.h"

#include <math.h>

static uint64_t random_state;

void noise_start(uint32_t seed) { random_state = 0x9E3779B97F4A7C15ULL * (seed + 1ULL); }

/* Marsaglia's xorshift64. */
double uniform(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (double)(random_state >> 11) * 0x1p-53;
}

/* Box and Muller. */
double normal(void) { return sqrt(-2.0 * log(1.0 - uniform())) * cos(2.0 * M_PI * uniform()); }
