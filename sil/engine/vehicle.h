/* SPDX-License-Identifier: MIT-0
 *
 * Altitude and stock loop, mixer, rotors and integration step: sil/plant/{loops,rotors,integrator,vehicle}.py.
 */
#ifndef ENGINE_VEHICLE_H
#define ENGINE_VEHICLE_H

#include "rigid_body.h"

/* Kinds of attitude loops; any other is the stock loop. */
#define CASCADE 1
#define FIRST_ORDER 2

typedef struct {
    double body[STATE_ROWS];
    double rotor_speed_rad_s[4];
    double memory[9]; /* of the attitude loop; the stock loop: its integrals, 2 */
} vehicle_state_t;

/* The state as controllers receive it, true or estimated. */
typedef struct {
    double position_m[3];
    double velocity_m_s[3];
    double euler_rad[3];
    double rates_rad_s[3];
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

static inline double altitude_thrust_n(const engine_simulation_t *simulation, const seen_t *seen)
{
    const double error_m = simulation->height_reference_m - seen->position_m[2];
    const double thrust_n = (simulation->weight_n - (simulation->altitude_p_n_m * error_m))
                            + (simulation->altitude_d_n_s_m * seen->velocity_m_s[2]);

    return clip(thrust_n, -simulation->thrust_limit_n, simulation->thrust_limit_n);
}

/* Shares of thrust, roll, pitch and yaw in the motor commands, by the stock loop; the integrals grow by a period. */
static inline void stock_shares(const engine_simulation_t *simulation, const seen_t *seen, const double *command_rad,
                                double thrust_n, double heading_rad, double *integral_rad_s, double *shares)
{
    double wrench[4];
    int i;

    wrench[0] = thrust_n;
    for (i = 0; i < 2; i++) {
        const double error_rad = command_rad[i] - seen->euler_rad[i];
        const double growth = error_rad - (simulation->integral_leak_1_s * integral_rad_s[i]);

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

/* Steady rotor speeds of the commands that sum up shares of thrust, roll, pitch and yaw. */
static inline void commanded_speeds(const engine_simulation_t *simulation, const double *share, double *speeds)
{
    double command[4];
    int i;

    command[0] = ((share[0] + share[1]) + share[2]) - share[3];
    command[1] = ((share[0] - share[1]) + share[2]) + share[3];
    command[2] = ((share[0] - share[1]) - share[2]) - share[3];
    command[3] = ((share[0] + share[1]) - share[2]) + share[3];
    for (i = 0; i < 4; i++) {
        speeds[i] = sqrt(simulation->speed_squared_per_command_rad2_s2
                         * clip(command[i], simulation->command_min, simulation->command_max));
    }
}

/* Wrench of the rotors on their way from `before` to `steady`, `decay` being the share of the way that is left. */
static inline void rotor_wrench(const engine_simulation_t *simulation, const engine_flight_t *flight,
                                const double *before, const double *steady, double decay, double thrust_share,
                                double *wrench)
{
    double thrust_n[4];
    int i;

    for (i = 0; i < 4; i++) {
        const double speed = steady[i] + ((before[i] - steady[i]) * decay);

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
                             const surroundings_t *around, double thrust_share, const rotation_t *r,
                             const double *steady, vehicle_state_t *state)
{
    const double half_s = simulation->step_s / 2.0;
    const double three_quarters_s = (3.0 * simulation->step_s) / 4.0;
    const double ninth_s = simulation->step_s / 9.0;
    double *body = state->body;
    double *speeds = state->rotor_speed_rad_s;
    double first[STATE_ROWS];
    double second[STATE_ROWS];
    double third[STATE_ROWS];
    double inner[STATE_ROWS];
    double wrench[4];
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
