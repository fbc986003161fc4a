/* SPDX-License-Identifier: MIT-0
 *
 * Optimizer: RPROP with a fixed number of iterations.
 */
#ifndef NMPC_OPTIMIZER_H
#define NMPC_OPTIMIZER_H

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Run I_max iterations of RPROP on `self->plan_rad`, starting from its present value. The cost may rise from one
 * iteration to the next; the plan after the last update is not evaluated, unless the search
 * has converged. */
void nmpc_optimizer_minimize(nmpc_t *self);

#ifdef __cplusplus
}
#endif

#endif
