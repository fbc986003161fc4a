/* SPDX-License-Identifier: MIT-0
 *
 * Gusts, battery, payload and impulse: sil/mambo_sil/drone/plant/{gusts,disturbances}.py; the delay of sil/mambo_sil/drone/plant/link.py.
 */
#ifndef ENGINE_WORLD_H
#define ENGINE_WORLD_H

#include "vehicle.h"

#define DELAY_TICKS_MAX 200

typedef struct {
    real_t u;
    real_t a;
    real_t b;
} gusts_t;

static inline gusts_t gusts_start(const real_t *draws)
{
    const gusts_t gusts = { draws[0], draws[1], (0.5 * draws[1]) + (0.5 * draws[2]) };

    return gusts;
}

/* Air velocity along x and y of the world; advances the filters by a tick. */
static inline void blow(const engine_simulation_t *simulation, const engine_flight_t *flight, const real_t *draws,
                        gusts_t *gusts, real_t *air_m_s)
{
    const double *gain = simulation->gust_across;
    const real_t *root = flight->gust_roots;
    const real_t along = flight->gust_mean_m_s + (flight->gust_sigma_m_s * gusts->u);
    const real_t across = flight->gust_sigma_m_s * ((gain[0] * gusts->a) + (gain[1] * gusts->b));
    const real_t decay = flight->gust_decay;

    gusts->u = (decay * gusts->u) + (root[0] * draws[0]);
    gusts->b = (decay * (gusts->b + (flight->gust_x * gusts->a))) + ((root[1] * draws[1]) + (root[2] * draws[2]));
    gusts->a = (decay * gusts->a) + (root[0] * draws[1]);
    air_m_s[0] = (flight->gust_heading[0] * along) - (flight->gust_heading[1] * across);
    air_m_s[1] = (flight->gust_heading[1] * along) + (flight->gust_heading[0] * across);
}

/* Change the velocity of the flights with an impulse at this tick. */
static inline void apply_impulse(const engine_flight_t *flight, int64_t tick, real_t payload_kg, const rotation_t *r,
                        vehicle_state_t *state)
{
    const mask_t any_axis = (flight->impulse_n_s[0] != 0.0) | (flight->impulse_n_s[1] != 0.0) | (flight->impulse_n_s[2] != 0.0);
    const mask_t due = (flight->impulse_tick == tick) & any_axis;
    real_t change_m_s[3];
    int i;

    if (any(due)) {
        for (i = 0; i < 3; i++) {
            change_m_s[i] = flight->impulse_n_s[i] / (flight->mass_kg + payload_kg);
        }
        to_body(r, change_m_s, change_m_s);
        for (i = 0; i < 3; i++) {
            const real_t before_m_s = state->body[VELOCITY + i];

            state->body[VELOCITY + i] = choose(due, before_m_s + change_m_s[i], before_m_s);
        }
    }
}

/* Commands on their way to the stock loops, at the remainder of their tick. */
typedef struct {
    real_t sent[DELAY_TICKS_MAX + 1][3];
} wire_t;

static inline void wire_start(const real_t *first, wire_t *wire)
{
    int k;
    int i;

    for (k = 0; k < (DELAY_TICKS_MAX + 1); k++) {
        for (i = 0; i < 3; i++) {
            wire->sent[k][i] = first[i];
        }
    }
}

static inline void carry(const engine_flight_t *flight, int64_t tick, const real_t *command, wire_t *wire,
                         real_t *arrived)
{
    const int64_t depth = DELAY_TICKS_MAX + 1;
    lanes_t delay_ticks;
    lanes_t arriving[3];
    int lane;
    int i;

    delay_ticks.whole = flight->delay_ticks;
    for (i = 0; i < 3; i++) {
        wire->sent[tick % depth][i] = command[i];
        for (lane = 0; lane < LANES; lane++) {
            const int64_t sent = (tick + depth) - delay_ticks.whole_lane[lane];

            arriving[i].lane[lane] = lane_of(wire->sent[sent % depth][i], lane);
        }
        arrived[i] = arriving[i].real;
    }
}

#endif
