/* SPDX-License-Identifier: MIT-0
 *
 * The functions of nmpc.c for gcc and clang against those for other compilers (plain_*), for every float and
 * every word of signs; returns 0 if they agree, else prints where they do not. */
#include <stdio.h>

#include "nmpc.h"

#define NMPC_INLINE static inline
#include "functions.h"
#include "plain.h"

#define INFINITE 0x7F800000U
#define BLOCK 256U              /* floats side by side, in a loop that compilers vectorise */
#define STRIDE (2654435761U * BLOCK) /* an odd number of blocks: each has its turn, and a fault is found early */

static float real_of(unsigned int bits)
{
    union {
        unsigned int bits;
        float real;
    } view;

    view.bits = bits;
    return view.real;
}

static const float limits[] = {NMPC_TILT_LIMIT_RAD, 3.4028235e38F};

static unsigned int word_of(float real)
{
    union {
        float real;
        unsigned int bits;
    } view;

    view.real = real;
    return view.bits;
}

static inline int differ_for(unsigned int bits)
{
    const float value = real_of(bits);
    const int is_nan = (value != value);
    unsigned int i;
    int differ = (is_nan == 0) && (absolute(value) != plain_absolute(value));

    differ |= (between(value, NMPC_THRUST_ACCELERATION_MIN_M_S2, NMPC_THRUST_ACCELERATION_MAX_M_S2)
               != plain_between(value, NMPC_THRUST_ACCELERATION_MIN_M_S2, NMPC_THRUST_ACCELERATION_MAX_M_S2));
    for (i = 0U; i < (sizeof limits / sizeof limits[0]); i++) {
        differ |= (within(value, limits[i]) != plain_within(value, limits[i]));
        differ |= (is_nan == 0) && (reaches(value, limits[i]) != plain_reaches(value, limits[i]));
    }
    /* What holds for one limit holds for all: the bits of positive floats are ordered as they are. */
    differ |= (bits < INFINITE) && !(value < real_of(bits + 1U));
    return differ;
}

int main(void)
{
    unsigned int bits;
    unsigned int i;
    nmpc_steps_t word;

    for (word = 1U; word < ((nmpc_steps_t)1 << NMPC_LAST_STEP); word++) {
        if (lowest_set_bit(word) != plain_lowest_set_bit(word)) {
            printf("they differ for the word %lx\n", (unsigned long)word);
            return 1;
        }
    }
    for (i = 0U; i < (sizeof limits / sizeof limits[0]); i++) { /* found early: a fault at a limit alone */
        if ((differ_for(word_of(limits[i])) != 0) || (differ_for(word_of(-limits[i])) != 0)) {
            printf("they differ for the float with the bits %08x or its negative\n", word_of(limits[i]));
            return 1;
        }
    }
    bits = 0U;
    do {
        int differ = 0;

        for (i = 0U; i < BLOCK; i++) {
            differ |= differ_for(bits + i);
        }
        if (differ != 0) {
            printf("they differ for the float with the bits %08x or one of the %u behind it\n", bits, BLOCK - 1U);
            return 1;
        }
        bits += STRIDE;
    } while (bits != 0U);
    return 0;
}
