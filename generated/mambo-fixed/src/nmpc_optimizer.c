/* SPDX-License-Identifier: MIT-0
 *
 * Optimizer: the exact minimum of the quadratic cost (not in the paper).
 * MISRA C:2012: departs from rule 8.9, for the reason in deviations.txt.
 */
#include "nmpc_optimizer.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* U1 and U2 from e, v, w, j, a, i, c, u, for right and forward. */
static const nmpc_real_t rows[2][2][NMPC_STATES] = {
    {
    { -169881193, -20659517, -2425026, 37249335, -1108732, -1185716, -198544, 7270462 },
    { -645531653, -119096516, -21898683, 543645545, -6465260, -12167309, -1207633, -5843842 }
    },
    {
    { -170431038, -19830286, -2219138, 32298837, -810315, -1297120, -280381, 7259827 },
    { -642891465, -115263620, -20590701, 499474102, -4674244, -13180671, -1710208, -5823726 }
    }
};

/* H12/H11 of the second derivatives H of the cost by U1 and U2, for right and forward. */
static const nmpc_real_t ratios[2] = { 1359810574, 1363286600 };

static nmpc_real_t row_product(const nmpc_real_t row[NMPC_STATES], const nmpc_real_t state[NMPC_STATES])
{
    nmpc_sum_t sum = (nmpc_sum_t)row[0] * state[0];
    int k;

    NMPC_UNROLL
    for (k = 1; k < NMPC_STATES; k++) {
        sum = sum + ((nmpc_sum_t)row[k] * state[k]);
    }
    return nmpc_row_sum(sum);
}

nmpc_real_t nmpc_optimizer_minimize(int axis, const nmpc_real_t state[NMPC_STATES], nmpc_real_t limit_m_step2)
{
    const nmpc_real_t first = row_product(rows[axis][0], state);
    const nmpc_real_t second = row_product(rows[axis][1], state);
    const nmpc_real_t second_change = nmpc_clamp(second, limit_m_step2) - second;

    return nmpc_clamp(first - nmpc_ratio_product(ratios[axis], second_change), limit_m_step2);
}
