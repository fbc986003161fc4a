/* SPDX-License-Identifier: MIT-0
 *
 * Optimizer: the exact minimum of the quadratic cost (not in the paper).
 * MISRA C:2012: departs from rule 8.9, for the reason in deviations.txt.
 */
#include "nmpc_optimizer.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xF1B3B6C8UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* U1 and U2 from e, v, w, j, a, i, c, u, for right and forward. */
static const nmpc_real_t rows[2][2][NMPC_STATES] = {
    {
    { -0.00015450604463643135, -0.009620337414067308, -0.2890856172809384, 4.440466808249315,
      -0.13217110046372602, -0.14134839839393518, -0.02366829695935195, 0.8667066442891347 },
    { -0.0005871076179515106, -0.055458636878889626, -2.610526496412795, 64.807599200034, -0.7707190543562472,
      -1.4504562647517376, -0.1439610131962313, -0.6966402423181492 }
    },
    {
    { -0.00015500612602044046, -0.009234196289240795, -0.26454188673033835, 3.8503214688044762,
      -0.0965970294308272, -0.15462872627257776, -0.03342403311952132, 0.8654387667869144 },
    { -0.0005847063811395699, -0.05367380547321207, -2.4546028367156154, 59.54195280907525,
      -0.5572133458317952, -1.5712583970015104, -0.20387267010445345, -0.6942422685527939 }
    }
};

/* H12/H11 of the second derivatives H of the cost by U1 and U2, for right and forward. */
static const nmpc_real_t ratios[2] = { 0.3166055711186864, 0.3174148966671222 };

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
