/* SPDX-License-Identifier: MIT-0
 *
 * The cascade of angle and rate loops: sil/mambo_sil/drone/plant/cascade.py, operation by operation.
 */
#ifndef ENGINE_CASCADE_H
#define ENGINE_CASCADE_H

#include "vehicle.h"

/* Shares of thrust, roll, pitch and yaw in the motor commands. The memory is the integrals of angles and rates, and
 * the last rates. */
static inline void cascade_shares(const engine_simulation_t *simulation, const seen_t *seen, const real_t *command_rad,
                                  real_t thrust_n, real_t heading_rad, real_t *memory, real_t *shares)
{
    const real_t reference_rad[3] = { command_rad[0], command_rad[1], heading_rad };
    int i;

    shares[0] = thrust_n / simulation->wrench_per_command[0];
    for (i = 0; i < 3; i++) {
        const double *gains = simulation->cascade[i];
        const real_t rate = seen->rates_rad_s[i];
        const real_t error_rad = reference_rad[i] - seen->euler_rad[i];
        const real_t change_rad_s2 = (rate - memory[6 + i]) / simulation->step_s;
        real_t rate_demand;
        real_t rate_error;
        real_t output;

        memory[i] = clip(memory[i] + (simulation->step_s * error_rad), -gains[3], gains[3]);
        rate_demand = ((gains[0] * error_rad) + (gains[1] * memory[i])) - (gains[2] * rate);
        rate_error = clip(rate_demand, -simulation->rate_max_rad_s, simulation->rate_max_rad_s) - rate;
        memory[3 + i] = clip(memory[3 + i] + (simulation->step_s * rate_error), -gains[7], gains[7]);
        output = ((gains[4] * rate_error) + (gains[5] * memory[3 + i])) - (gains[6] * change_rad_s2);
        shares[1 + i] = clip(output, -simulation->output_max, simulation->output_max);
        memory[6 + i] = rate;
    }
}

#endif
