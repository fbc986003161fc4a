/* SPDX-License-Identifier: MIT-0
 *
 * Cost function: the Manhattan distance to the target and the variation of the moves (eq 12).
 */
#ifndef NMPC_COST_H
#define NMPC_COST_H

#include "nmpc.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Return the cost of `moves_rad`, of which the first follows `last_rad`; fill `gradient`, per rad. */
nmpc_sum_t nmpc_cost_evaluate(const nmpc_prediction_t *prediction, const nmpc_weights_t *weights,
                              const nmpc_real_t last_rad[NMPC_AXES], const nmpc_real_t moves_rad[NMPC_MOVES],
                              nmpc_sum_t gradient[NMPC_MOVES]);

#ifdef __cplusplus
}
#endif

#endif
