/* SPDX-License-Identifier: MIT-0
 *
 * A group of flights, update by update. engine_fly runs a whole one; whoever changes target, disturbances or sensors
 * between the updates calls these functions.
 */
#ifndef ENGINE_LOOP_H
#define ENGINE_LOOP_H

#include "drift.h"
#include "first_order.h"
#include "ground.h"
#include "mocap.h"
#include "sensors.h"
#include "world.h"

/* All that the flights remember from one update to the next. */
typedef struct {
    vehicle_state_t state;
    suite_t suite;
    mocap_t mocap;
    drift_t drift;
    late_t late;
    gusts_t gusts;
    wire_t wire;
    real_t command[3];        /* roll, pitch and, where controllers command it, thrust over mass */
    real_t altitude_integral_n;
    real_t given_n;           /* what the motors were commanded since the last update, summed over ticks */
    real_t capped;            /* 1 if that was another thrust than the one that arrived, else 0 */
    int64_t ticks;
} flying_t;

/* Put the drones at their start; sensors and gusts start where the simulation has any. */
void engine_begin(const engine_simulation_t *simulation, const engine_flight_t *flight, const engine_draws_t *draws,
                  flying_t *flying);

/* Start the sensors of the simulation at the true state. */
void engine_start_sensors(const engine_simulation_t *simulation, flying_t *flying);

/* Advance the flights by one update: the one with row `update` of times, targets, draws and trace. */
void engine_update(const engine_simulation_t *simulation, const engine_flight_t *flight, int64_t index, int64_t update,
                   const double *times_s, const double *targets, const engine_draws_t *draws,
                   engine_controller_t controller, void *self, int64_t stride, flying_t *flying,
                   const engine_trace_t *trace);

#endif
