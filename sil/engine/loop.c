/* SPDX-License-Identifier: MIT-0
 *
 * The closed loop: sil/flight/loop.py for one flight.
 */
#include "cascade.h"
#include "loop.h"

/* A number of the trace: all NaN are one, whatever the processor makes of them. */
static inline double number(double value)
{
    return (value == value) ? value : NAN;
}

static inline void write_axes(double *array, int64_t row, int axes, const double *values)
{
    int i;

    for (i = 0; i < axes; i++) {
        array[(row * axes) + i] = number(values[i]);
    }
}

/* NaN in the state of a flight that left the bounds or is not finite. */
static inline void mark_lost(const engine_simulation_t *simulation, vehicle_state_t *state)
{
    int lost = 0;
    int i;

    for (i = 0; i < STATE_ROWS; i++) {
        lost = lost || !isfinite(state->body[i]) || ((i < VELOCITY) && !(fabs(state->body[i]) < simulation->lost_m));
    }
    if (lost) {
        for (i = 0; i < STATE_ROWS; i++) {
            state->body[i] = NAN;
        }
    }
}

/* Call the controller, unless the update is dropped, and record the update. */
static inline void call(const engine_simulation_t *simulation, const engine_flight_t *flight, int64_t index,
                        int64_t update, const double *targets, const engine_draws_t *draws,
                        engine_controller_t controller, void *self,
                        const seen_t *truth_now, const seen_t *seen, double thrust_n, double *command_rad,
                        const engine_trace_t *trace)
{
    const int64_t row = (index * simulation->updates) + update;
    const double thrust_acceleration_m_s2 = thrust_n / simulation->nominal_mass_kg;
    const int dropped = simulation->dropping && (draws->drops[update] < flight->dropped_share);
    double measured[7];
    double answer_rad[2];
    int64_t status;
    int i;

    for (i = 0; i < 7; i++) {
        measured[i] = dropped ? NAN : ((i < 2) ? seen->position_m[i] : ((i < 4) ? seen->velocity_m_s[i - 2] : seen->euler_rad[i - 4]));
    }
    status = controller(self, measured, targets + (6 * row), thrust_acceleration_m_s2, answer_rad);
    if (dropped) {
        status = -1;
    } else {
        command_rad[0] = number(answer_rad[0]);
        command_rad[1] = number(answer_rad[1]);
    }
    write_axes(trace->position_m, row, 3, truth_now->position_m);
    write_axes(trace->velocity_m_s, row, 3, truth_now->velocity_m_s);
    write_axes(trace->euler_rad, row, 3, truth_now->euler_rad);
    write_axes(trace->command_rad, row, 2, command_rad);
    write_axes(trace->thrust_acceleration_m_s2, row, 1, &thrust_acceleration_m_s2);
    trace->status[row] = status;
    if (simulation->sensed) {
        write_axes(trace->seen_position_m, row, 3, seen->position_m);
        write_axes(trace->seen_velocity_m_s, row, 3, seen->velocity_m_s);
        write_axes(trace->seen_euler_rad, row, 3, seen->euler_rad);
    }
}

void engine_start_sensors(const engine_simulation_t *simulation, flying_t *flying)
{
    const rotation_t r = rotation(flying->state.body + EULER);
    const seen_t start = truth(&flying->state, &r);

    if (simulation->captured) {
        mocap_start(simulation, &start, &flying->mocap);
    } else {
        suite_start(simulation, &start, &r, &flying->suite);
    }
}

void engine_begin(const engine_simulation_t *simulation, const engine_flight_t *flight, const engine_draws_t *draws,
                  flying_t *flying)
{
    const late_t late = { { { 0.0, 0.0 } } };
    const wire_t wire = { { { 0.0, 0.0 } } };
    vehicle_state_t state;
    int i;

    for (i = 0; i < STATE_ROWS; i++) {
        state.body[i] = flight->body_start[i];
    }
    for (i = 0; i < 4; i++) {
        state.rotor_speed_rad_s[i] = flight->rotor_start_rad_s[i];
    }
    for (i = 0; i < 9; i++) {
        state.memory[i] = 0.0;
    }
    flying->state = state;
    if (simulation->sensed) {
        engine_start_sensors(simulation, flying);
    }
    if (simulation->windy) {
        flying->gusts = gusts_start(draws->gusts);
    }
    flying->late = late;
    flying->wire = wire;
    flying->command_rad[0] = 0.0;
    flying->command_rad[1] = 0.0;
    flying->ticks = 0;
}

void engine_update(const engine_simulation_t *simulation, const engine_flight_t *flight, int64_t index, int64_t update,
                   const double *times_s, const double *targets, const engine_draws_t *draws,
                   engine_controller_t controller, void *self, flying_t *flying, const engine_trace_t *trace)
{
    const double heading_rad = flight->yaw_rad + (flight->yaw_rate_rad_s * maximum(times_s[update], 0.0));
    vehicle_state_t *state = &flying->state;
    int64_t tick;

    mark_lost(simulation, state);
    for (tick = 0; tick < simulation->ticks_per_update; tick++) {
        const rotation_t r = rotation(state->body + EULER);
        const int64_t ticks = flying->ticks;
        const int64_t now = simulation->first_tick + ticks;
        const int64_t row = (update * simulation->ticks_per_update) + tick;
        surroundings_t around = { flight->mass_kg, { 0.0, 0.0 } };
        double thrust_share = 1.0;
        double thrust_n;
        double shares[4];
        double steady_rad_s[4];
        double arriving_rad[2];
        seen_t truth_now;
        seen_t seen;

        if (simulation->disturbed) {
            const double payload_kg = (flight->payload_tick <= now) ? flight->payload_kg : 0.0;

            if (flight->push_tick == now) {
                push(flight, payload_kg, &r, state);
            }
            thrust_share = maximum(1.0 - (flight->battery_sag_1_s * (simulation->step_s * (double)ticks)), 0.0);
            around.mass_kg = flight->mass_kg + payload_kg;
            if (simulation->windy) {
                blow(simulation, flight, draws->gusts + (3 * (row + 1)), &flying->gusts, around.air_m_s);
            }
        }
        truth_now = truth(state, &r);
        seen = truth_now;
        if (simulation->captured) {
            seen = capture(simulation, flight, &truth_now, draws->sensors + (6 * row), &flying->mocap);
        } else if (simulation->sensed) {
            seen = estimate(simulation, flight, &truth_now, &r, draws->sensors + (8 * row), &flying->suite);
        }
        thrust_n = (update < simulation->lifting_updates) ? simulation->take_off_thrust_n
                                                          : altitude_thrust_n(simulation, &seen);
        if (tick == 0) {
            call(simulation, flight, index, update, targets, draws, controller, self, &truth_now, &seen,
                 thrust_n, flying->command_rad, trace);
        }
        carry(flight, ticks, flying->command_rad, &flying->wire, arriving_rad);
        if (simulation->attitude == FIRST_ORDER) {
            advance(simulation, flight, &around, thrust_share, thrust_n, heading_rad, ticks, arriving_rad, &r,
                    &flying->late, state->body);
        } else {
            if (simulation->attitude == CASCADE) {
                cascade_shares(simulation, &seen, arriving_rad, thrust_n, heading_rad, state->memory, shares);
            } else {
                stock_shares(simulation, &seen, arriving_rad, thrust_n, heading_rad, state->memory, shares);
            }
            commanded_speeds(simulation, shares, steady_rad_s);
            integrate(simulation, flight, &around, thrust_share, &r, steady_rad_s, state);
        }
        flying->ticks = ticks + 1;
    }
}

void engine_fly(const engine_simulation_t *simulation, const engine_flight_t *flight, int64_t index,
                const double *times_s, const double *targets, const engine_draws_t *draws,
                engine_controller_t controller, void *self, const engine_trace_t *trace)
{
    flying_t flying;
    int64_t update;

    engine_begin(simulation, flight, draws, &flying);
    for (update = 0; update < simulation->updates; update++) {
        engine_update(simulation, flight, index, update, times_s, targets, draws, controller, self, &flying, trace);
    }
}
