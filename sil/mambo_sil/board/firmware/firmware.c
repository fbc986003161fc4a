/* SPDX-License-Identifier: MIT-0
 *
 * Minimal firmware with one controller; with EMPTY defined, without. The difference of the two linked programs is
 * the size of the controller.
 */
#ifdef EMPTY

void run(void);

void run(void)
{
}

#else

#include "nmpc.h"

nmpc_t nmpc_controller;

#ifdef NMPC_HAS_HEIGHT

nmpc_status_t run(const nmpc_state_t *state, const nmpc_target_t *target, nmpc_command_t *command);

nmpc_status_t run(const nmpc_state_t *state, const nmpc_target_t *target, nmpc_command_t *command)
{
    nmpc_init(&nmpc_controller);
    return nmpc_step(&nmpc_controller, state, target, command);
}

#else

nmpc_status_t run(const nmpc_state_t *state, const nmpc_target_t *target, nmpc_real_t thrust_acceleration_m_s2,
                  nmpc_command_t *command);

nmpc_status_t run(const nmpc_state_t *state, const nmpc_target_t *target, nmpc_real_t thrust_acceleration_m_s2,
                  nmpc_command_t *command)
{
    nmpc_init(&nmpc_controller);
    return nmpc_step(&nmpc_controller, state, target, thrust_acceleration_m_s2, command);
}

#endif
#endif
