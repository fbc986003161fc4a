/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: does this build, on this board, compute the bits that the reference computed?
 */
#ifndef NMPC_SELF_TEST_H
#define NMPC_SELF_TEST_H

#include "nmpc.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Step `scratch` through 24 built-in steps, good and bad input among them, and compare status, command,
 * cost and the gradient of the first move exactly. Returns 0 if all agree, else the number, from 1, of the
 * first step that does not. Call it at start-up, with the controller that will fly if there is no room for
 * another: it is initialised before and after. `scratch` must not be null. */
int nmpc_self_test(nmpc_t *scratch);

#ifdef __cplusplus
}
#endif

#endif
