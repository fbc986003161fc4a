/* SPDX-License-Identifier: MIT-0
 *
 * Gusts, battery, payload and push: sil/plant/{gusts,disturbances}.py; the delay of sil/plant/link.py.
 */
#ifndef ENGINE_WORLD_H
#define ENGINE_WORLD_H

#include "vehicle.h"

#define DELAY_TICKS_MAX 200

typedef struct {
    double u;
    double a;
    double b;
} gusts_t;

static inline gusts_t gusts_start(const double *draws)
{
    const gusts_t gusts = { draws[0], draws[1], (0.5 * draws[1]) + (0.5 * draws[2]) };

    return gusts;
}

/* Air velocity along x and y of the world; advances the filters by a tick. */
static inline void blow(const engine_simulation_t *simulation, const engine_flight_t *flight, const double *draws,
                        gusts_t *gusts, double *air_m_s)
{
    const double *gain = simulation->gust_across;
    const double *root = flight->gust_roots;
    const double along = flight->gust_mean_m_s + (flight->gust_sigma_m_s * gusts->u);
    const double across = flight->gust_sigma_m_s * ((gain[0] * gusts->a) + (gain[1] * gusts->b));
    const double decay = flight->gust_decay;

    gusts->u = (decay * gusts->u) + (root[0] * draws[0]);
    gusts->b = (decay * (gusts->b + (flight->gust_x * gusts->a))) + ((root[1] * draws[1]) + (root[2] * draws[2]));
    gusts->a = (decay * gusts->a) + (root[0] * draws[1]);
    air_m_s[0] = (flight->gust_heading[0] * along) - (flight->gust_heading[1] * across);
    air_m_s[1] = (flight->gust_heading[1] * along) + (flight->gust_heading[0] * across);
}

/* Change the velocity by the impulse that is due at this tick, if any. */
static inline void push(const engine_flight_t *flight, double payload_kg, const rotation_t *r, vehicle_state_t *state)
{
    double change_m_s[3];
    int pushed = 0;
    int i;

    for (i = 0; i < 3; i++) {
        pushed = pushed || (flight->push_n_s[i] != 0.0);
        change_m_s[i] = flight->push_n_s[i] / (flight->mass_kg + payload_kg);
    }
    if (pushed) {
        to_body(r, change_m_s, change_m_s);
        for (i = 0; i < 3; i++) {
            state->body[VELOCITY + i] = state->body[VELOCITY + i] + change_m_s[i];
        }
    }
}

/* Commands on their way to the stock loops. */
typedef struct {
    double sent_rad[DELAY_TICKS_MAX + 1][2];
} wire_t;

static inline void carry(const engine_flight_t *flight, int64_t tick, const double *command_rad, wire_t *wire,
                         double *arriving_rad)
{
    const int64_t depth = flight->delay_ticks + 1;
    int i;

    for (i = 0; i < 2; i++) {
        wire->sent_rad[tick % depth][i] = command_rad[i];
        arriving_rad[i] = wire->sent_rad[(tick + 1) % depth][i];
    }
}

#endif
