/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: does this build, on this board, compute the bits that the reference computed?
 * MISRA C:2012: departs from rule 2.5, for the reason in deviations.txt.
 */
#ifndef NMPC_SELF_TEST_H
#define NMPC_SELF_TEST_H

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xD4C905DCUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* Frozen steps: an episode is a controller stepped NMPC_SELF_TEST_TICKS times from nmpc_init(). */
#define NMPC_SELF_TEST_EPISODES 1000
#define NMPC_SELF_TEST_TICKS 100

/* The digest of all episodes, as the reference computed it. */
#define NMPC_SELF_TEST_DIGEST 0x2C85F95AUL

#ifdef __cplusplus
extern "C" {
#endif

/* Step `scratch` through 24 built-in steps, good and bad input among them, and compare status, command,
 * cost and the gradient of the first move exactly. Returns 0 if all agree, else the number, from 1, of the
 * first step that does not. Call it at start-up, with the controller that will fly if there is no room for
 * another: it is initialised before and after. `scratch` must not be null. */
int nmpc_self_test(nmpc_t *scratch);

/* Step `scratch` through one episode, from 0, of built-in inputs, good and bad ones, and fold every bit of every
 * outcome into `digest`: status, iterations, convergence, command, cost, gradient and plan. Returns the new
 * digest, of 32 bits. Begin with digest 0, go through all episodes in order, on the board and with the flags
 * that will fly, and compare with NMPC_SELF_TEST_DIGEST:
 *
 *     for (episode = 0; episode < NMPC_SELF_TEST_EPISODES; episode++) {
 *         digest = nmpc_self_test_episode(&scratch, episode, digest);
 *     }
 *
 * Between two episodes there is time to feed a watchdog. `scratch` is initialised before and after; it must not
 * be null. Work: NMPC_SELF_TEST_TICKS calls of nmpc_step(). */
unsigned long nmpc_self_test_episode(nmpc_t *scratch, int episode, unsigned long digest);

#ifdef __cplusplus
}
#endif

#endif
