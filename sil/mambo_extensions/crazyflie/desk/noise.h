/* Random numbers of a flight, the same for the same seed. */
#ifndef NOISE_H
#define NOISE_H

#include <stdint.h>

void noise_start(uint32_t seed);
double uniform(void); /* in [0, 1) */
double normal(void);  /* of deviation 1 */

#endif
