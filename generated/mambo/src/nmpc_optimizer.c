/* SPDX-License-Identifier: MIT-0
 *
 * Optimizer: the exact minimum of the quadratic cost (not in the paper).
 * MISRA C:2012: departs from rule 8.9, for the reason in deviations.txt.
 */
#include "nmpc_optimizer.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xF8CA429DUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* U1 and U2 from e, v, w, j, a, i, c, u, for right and forward. */
static const nmpc_real_t rows[2][2][NMPC_STATES] = {
    {
    { -0.00015450605f, -0.009620338f, -0.28908563f, 4.440467f, -0.1321711f, -0.14134839f, -0.023668297f,
      0.86670667f },
    { -0.0005871076f, -0.055458635f, -2.6105266f, 64.8076f, -0.77071905f, -1.4504563f, -0.14396101f,
      -0.69664025f }
    },
    {
    { -0.00015500613f, -0.0092341965f, -0.2645419f, 3.8503215f, -0.09659703f, -0.15462872f, -0.033424035f,
      0.86543876f },
    { -0.0005847064f, -0.053673804f, -2.4546027f, 59.541954f, -0.55721337f, -1.5712584f, -0.20387267f,
      -0.69424224f }
    }
};

/* H12/H11 of the second derivatives H of the cost by U1 and U2, for right and forward. */
static const nmpc_real_t ratios[2] = { 0.31660557f, 0.3174149f };

static nmpc_real_t row_product(const nmpc_real_t row[NMPC_STATES], const nmpc_real_t state[NMPC_STATES])
{
    nmpc_sum_t sum = row[0] * state[0];
    int k;

    NMPC_UNROLL
    for (k = 1; k < NMPC_STATES; k++) {
        sum = sum + (row[k] * state[k]);
    }
    return sum;
}

nmpc_real_t nmpc_optimizer_minimize(int axis, const nmpc_real_t state[NMPC_STATES], nmpc_real_t limit_m_step2)
{
    const nmpc_real_t first = row_product(rows[axis][0], state);
    const nmpc_real_t second = row_product(rows[axis][1], state);
    const nmpc_real_t second_change = nmpc_clamp(second, limit_m_step2) - second;

    return nmpc_clamp(first - (ratios[axis] * second_change), limit_m_step2);
}
