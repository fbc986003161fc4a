/* SPDX-License-Identifier: MIT-0
 *
 * Cost function: the Manhattan distance to the target and the change of the moves (eq 12).
 */
#ifndef NMPC_COST_H
#define NMPC_COST_H

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Return J, eq 12, of the plan, and store its subgradient in `self->gradient`. */
nmpc_sum_t nmpc_cost_evaluate(nmpc_t *self);

#ifdef __cplusplus
}
#endif

#endif
