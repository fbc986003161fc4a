/* SPDX-License-Identifier: MIT-0
 *
 * Altitude and stock loop, mixer, rotors and integration step: sil/mambo_sil/drone/plant/{loops,rotors,integrator,vehicle}.py,
 * sil/mambo_sil/flight/altitude_loops.py.
 */
#ifndef ENGINE_VEHICLE_H
#define ENGINE_VEHICLE_H

#include "rigid_body.h"

/* Kinds of attitude loops; any other is the stock loop. */
#define CASCADE 1
#define FIRST_ORDER 2

/* Mixers that lower all motors; any other clips each. The second one takes from yaw before. */
#define LOWER 1
#define YAW_LAST 2

/* Altitude loops; any other has feed-forward. */
#define STOCK 0

/* What the altitude loop is to follow: z points down, climb and acceleration up. */
typedef struct {
    real_t z_m;
    real_t climb_m_s;
    real_t acceleration_m_s2;
} vertical_t;

typedef struct {
    real_t body[STATE_ROWS];
    real_t rotor_speed_rad_s[4];
    real_t memory[9]; /* of the attitude loop; the stock loop: its integrals, 2 */
} vehicle_state_t;

/* The state as controllers receive it, true or estimated. */
typedef struct {
    real_t position_m[3];
    real_t velocity_m_s[3];
    real_t euler_rad[3];
    real_t rates_rad_s[3];
} seen_t;

static inline seen_t truth(const vehicle_state_t *state, const rotation_t *r)
{
    seen_t seen;
    int i;

    for (i = 0; i < 3; i++) {
        seen.position_m[i] = state->body[POSITION + i];
        seen.euler_rad[i] = state->body[EULER + i];
        seen.rates_rad_s[i] = state->body[RATES + i];
    }
    to_world(r, state->body + VELOCITY, seen.velocity_m_s);
    return seen;
}

/* What is seen at a place that lies `lever_m` from the one that is. */
static inline seen_t beside(const seen_t *place, const rotation_t *r, const real_t *lever_m)
{
    const real_t *rates = place->rates_rad_s;
    const real_t turning_m_s[3] = { (rates[1] * lever_m[2]) - (rates[2] * lever_m[1]),
                                    (rates[2] * lever_m[0]) - (rates[0] * lever_m[2]),
                                    (rates[0] * lever_m[1]) - (rates[1] * lever_m[0]) };
    seen_t seen = *place;
    real_t arm_m[3];
    real_t moving_m_s[3];
    int i;

    to_world(r, lever_m, arm_m);
    to_world(r, turning_m_s, moving_m_s);
    for (i = 0; i < 3; i++) {
        seen.position_m[i] = place->position_m[i] + arm_m[i];
        seen.velocity_m_s[i] = place->velocity_m_s[i] + moving_m_s[i];
    }
    return seen;
}

static inline real_t altitude_thrust_n(const engine_simulation_t *simulation, const vertical_t *wanted,
                                       const seen_t *seen, real_t *integral_n)
{
    const double most_n = simulation->thrust_limit_n;
    real_t thrust_n;

    if (simulation->altitude_law == STOCK) {
        thrust_n = (simulation->weight_n - (simulation->altitude_p_n_m * (wanted->z_m - seen->position_m[2])))
                   + (simulation->altitude_d_n_s_m * seen->velocity_m_s[2]);
    } else {
        const real_t error_m = seen->position_m[2] - wanted->z_m;
        const real_t climb_error_m_s = wanted->climb_m_s + seen->velocity_m_s[2];
        const real_t upwards_n = (((simulation->weight_n + (simulation->altitude_p_n_m * error_m))
                                   + (simulation->altitude_d_n_s_m * climb_error_m_s))
                                  + (simulation->altitude_mass_kg * wanted->acceleration_m_s2))
                                 + *integral_n;
        const real_t grown_n = *integral_n + (simulation->step_s * (simulation->altitude_i_n_m_s * error_m));
        const mask_t near = magnitude(error_m) < simulation->integrated_error_m;
        real_t sine;
        real_t cos_roll;
        real_t cos_pitch;
        mask_t free;

        sine_cosine(seen->euler_rad[0], &sine, &cos_roll);
        sine_cosine(seen->euler_rad[1], &sine, &cos_pitch);
        thrust_n = upwards_n / maximum(cos_roll * cos_pitch, splat(simulation->least_level));
        free = magnitude(thrust_n) < most_n;
        free = free & near;
        *integral_n = choose(free, clip(grown_n, -simulation->integral_limit_n, simulation->integral_limit_n),
                             *integral_n);
    }
    return clip(thrust_n, -most_n, most_n);
}

/* Shares of thrust, roll, pitch and yaw in the motor commands, by the stock loop; the integrals grow by a period. */
static inline void stock_shares(const engine_simulation_t *simulation, const seen_t *seen, const real_t *command_rad,
                                real_t thrust_n, real_t heading_rad, real_t *integral_rad_s, real_t *shares)
{
    real_t wrench[4];
    int i;

    wrench[0] = thrust_n;
    for (i = 0; i < 2; i++) {
        const real_t error_rad = command_rad[i] - seen->euler_rad[i];
        const real_t growth = error_rad - (simulation->integral_leak_1_s * integral_rad_s[i]);

        wrench[1 + i] = ((simulation->attitude_p_n_m[i] * error_rad)
                         + (simulation->attitude_i_n_m_s[i] * integral_rad_s[i]))
                        - (simulation->attitude_d_n_m_s[i] * seen->rates_rad_s[i]);
        integral_rad_s[i] = clip(integral_rad_s[i] + (simulation->step_s * growth),
                                 -simulation->integral_limit_rad_s, simulation->integral_limit_rad_s);
    }
    wrench[3] = (simulation->yaw_p_n_m * (heading_rad - seen->euler_rad[2]))
                - (simulation->yaw_d_n_m_s * seen->rates_rad_s[2]);
    for (i = 0; i < 4; i++) {
        shares[i] = wrench[i] / simulation->wrench_per_command[i];
    }
}

static inline real_t largest(const real_t *value)
{
    return maximum(maximum(maximum(value[0], value[1]), value[2]), value[3]);
}

static inline real_t smallest(const real_t *value)
{
    return minimum(minimum(minimum(value[0], value[1]), value[2]), value[3]);
}

/* Steady rotor speeds of the commands that sum up shares of thrust, roll, pitch and yaw; returns their thrust. */
static inline real_t commanded_speeds(const engine_simulation_t *simulation, const real_t *share, real_t *speeds)
{
    const real_t others[4] = { (share[0] + share[1]) + share[2], (share[0] - share[1]) + share[2],
                               (share[0] - share[1]) - share[2], (share[0] + share[1]) - share[2] };
    real_t yaw = share[3];
    real_t command[4];
    int i;

    if (simulation->mixer == YAW_LAST) {
        const real_t above = simulation->command_max - largest(others);
        const real_t below = smallest(others) - simulation->command_min;
        const real_t room = maximum(minimum(above, below), splat(simulation->least_yaw));

        yaw = yaw * minimum(room / magnitude(yaw), splat(1.0));
    }
    command[0] = others[0] - yaw;
    command[1] = others[1] + yaw;
    command[2] = others[2] - yaw;
    command[3] = others[3] + yaw;
    if ((simulation->mixer == LOWER) || (simulation->mixer == YAW_LAST)) {
        const real_t excess = maximum(largest(command) - simulation->command_max, splat(0.0));

        for (i = 0; i < 4; i++) {
            command[i] = command[i] - excess;
        }
    }
    for (i = 0; i < 4; i++) {
        command[i] = clip(command[i], simulation->command_min, simulation->command_max);
        speeds[i] = square_root(simulation->speed_squared_per_command_rad2_s2 * command[i]);
    }
    return (((command[0] + command[1]) + command[2]) + command[3]) * (simulation->wrench_per_command[0] / 4.0);
}

/* Wrench of the rotors on their way from `before` to `steady`, `decay` being the share of the way that is left. */
static inline void rotor_wrench(const engine_simulation_t *simulation, const engine_flight_t *flight,
                                const real_t *before, const real_t *steady, real_t decay, real_t thrust_share,
                                real_t *wrench)
{
    real_t thrust_n[4];
    int i;

    for (i = 0; i < 4; i++) {
        const real_t speed = steady[i] + ((before[i] - steady[i]) * decay);

        thrust_n[i] = flight->thrust_factor_n_s2 * (speed * speed);
    }
    wrench[0] = ((thrust_n[0] + thrust_n[1]) + thrust_n[2]) + thrust_n[3];
    wrench[1] = (((thrust_n[0] - thrust_n[1]) - thrust_n[2]) + thrust_n[3]) * simulation->rotor_offset_m;
    wrench[2] = (((thrust_n[0] + thrust_n[1]) - thrust_n[2]) - thrust_n[3]) * simulation->rotor_offset_m;
    wrench[3] = (((thrust_n[1] - thrust_n[0]) - thrust_n[2]) + thrust_n[3]) * flight->torque_per_thrust_m;
    if (simulation->disturbed) {
        for (i = 0; i < 4; i++) {
            wrench[i] = thrust_share * wrench[i];
        }
    }
}

/* Advance body and rotors by a tick with the method of Bogacki and Shampine; `r` belongs to the state before. */
static inline void integrate(const engine_simulation_t *simulation, const engine_flight_t *flight,
                             const surroundings_t *around, real_t thrust_share, const rotation_t *r,
                             const real_t *steady, vehicle_state_t *state)
{
    const double half_s = simulation->step_s / 2.0;
    const double three_quarters_s = (3.0 * simulation->step_s) / 4.0;
    const double ninth_s = simulation->step_s / 9.0;
    real_t *body = state->body;
    real_t *speeds = state->rotor_speed_rad_s;
    real_t first[STATE_ROWS];
    real_t second[STATE_ROWS];
    real_t third[STATE_ROWS];
    real_t inner[STATE_ROWS];
    real_t wrench[4];
    rotation_t turned;
    int i;

    rotor_wrench(simulation, flight, speeds, steady, flight->rotor_decay[0], thrust_share, wrench);
    derivative(simulation, flight, around, r, body, wrench, first);
    for (i = 0; i < STATE_ROWS; i++) {
        inner[i] = body[i] + (half_s * first[i]);
    }
    rotor_wrench(simulation, flight, speeds, steady, flight->rotor_decay[1], thrust_share, wrench);
    turned = rotation(inner + EULER);
    derivative(simulation, flight, around, &turned, inner, wrench, second);
    for (i = 0; i < STATE_ROWS; i++) {
        inner[i] = body[i] + (three_quarters_s * second[i]);
    }
    rotor_wrench(simulation, flight, speeds, steady, flight->rotor_decay[2], thrust_share, wrench);
    turned = rotation(inner + EULER);
    derivative(simulation, flight, around, &turned, inner, wrench, third);
    for (i = 0; i < STATE_ROWS; i++) {
        body[i] = body[i] + (ninth_s * (((2.0 * first[i]) + (3.0 * second[i])) + (4.0 * third[i])));
    }
    for (i = 0; i < 4; i++) {
        speeds[i] = steady[i] + ((speeds[i] - steady[i]) * flight->rotor_decay[3]);
    }
}

#endif
