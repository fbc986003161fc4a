/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: whether this build, on this board, computes the same bits as the reference: the NumPy controller
 * of mambo-nmpc, run with the same settings when this bundle was generated.
 * MISRA C:2012: departs from rule 2.5, for the reason in deviations.txt.
 */
#ifndef NMPC_SELF_TEST_H
#define NMPC_SELF_TEST_H

#include "nmpc.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x65406E0BUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* An episode is nmpc_init() and NMPC_SELF_TEST_TICKS calls of nmpc_step() with built-in inputs; between them the other
 * functions of nmpc.h are called, with good and bad arguments. */
#define NMPC_SELF_TEST_EPISODES 1000
#define NMPC_SELF_TEST_TICKS 100

/* The digest of all episodes, computed by the reference. */
#define NMPC_SELF_TEST_DIGEST 0xEF822537UL

#ifdef __cplusplus
extern "C" {
#endif

/* Make 41 control steps on `scratch`, with built-in good and bad inputs, and calls of the other functions of nmpc.h
 * between them; compare a digest of every bit of their results with that of the reference. Returns 0 if all agree, else
 * the number, counted from 1, of the first step that differs, or that stands behind a call that does. Call it at
 * start-up, before nmpc_init() of the flight controller. `scratch` may be the flight controller itself: it is
 * initialised before and after, which loses its state and its limits. `scratch` must not be null. */
int nmpc_self_test(nmpc_t *scratch);

/* Run one episode, counted from 0, on `scratch`, with good and bad inputs, and fold every bit of every result
 * into `digest`: status, saturation, every stored number and command. Returns the new
 * digest, of 32 bits. Start with digest 0, run all episodes in order, on the flight board and with the compiler
 * flags of the flight build, and compare with NMPC_SELF_TEST_DIGEST:
 *
 *     for (episode = 0; episode < NMPC_SELF_TEST_EPISODES; episode++) {
 *         digest = nmpc_self_test_episode(&scratch, episode, digest);
 *     }
 *
 * A watchdog can be serviced between two episodes. `scratch` is initialised before and after, and must not be null.
 * Work: NMPC_SELF_TEST_TICKS calls of nmpc_step(). */
unsigned long nmpc_self_test_episode(nmpc_t *scratch, int episode, unsigned long digest);

#ifdef __cplusplus
}
#endif

#endif
