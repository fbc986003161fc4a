/* SPDX-License-Identifier: MIT-0
 *
 * The closed loop: sil/mambo_sil/flight/loop.py for a group of flights.
 */
#include "cascade.h"
#include "loop.h"

/* A number of the trace: all NaN are one, whatever the processor makes of them. */
static inline double number(double value)
{
    return (value == value) ? value : NAN;
}

static inline void write_axes(double *array, int64_t row, int lane, int axes, const real_t *values)
{
    int i;

    for (i = 0; i < axes; i++) {
        array[(row * axes) + i] = number(lane_of(values[i], lane));
    }
}

/* NaN in the state of a flight that left the bounds or is not finite. */
static inline void mark_lost(const engine_simulation_t *simulation, vehicle_state_t *state)
{
    mask_t kept = state->body[0] == state->body[0];
    int i;

    for (i = 0; i < STATE_ROWS; i++) {
        kept = kept & (magnitude(state->body[i]) < ((i < VELOCITY) ? simulation->lost_m : (double)INFINITY));
    }
    for (i = 0; i < STATE_ROWS; i++) {
        state->body[i] = choose(kept, state->body[i], splat(NAN));
    }
}

/* Call the controllers, except of dropped updates, and record the update. The thrust comes from the altitude
 * loop, or is reported to controllers that command it; the trace has the thrust of the loop, of the controllers or of a
 * take-off. */
static inline void call(const engine_simulation_t *simulation, const engine_flight_t *flight, int64_t index,
                        int64_t update, const double *targets, const engine_draws_t *draws,
                        engine_controller_t controller, void *self, int64_t stride, const seen_t *truth_now,
                        const seen_t *seen, real_t thrust_m_s2, real_t *held, const engine_trace_t *trace)
{
    const int take_off = update < simulation->open_loop_updates;
    const real_t lift_m_s2 = splat(simulation->take_off_thrust_n / simulation->nominal_mass_kg);
    const real_t touching = choose(flight->landing & (truth_now->position_m[2] >= 0.0), splat(1.0), splat(0.0));
    const real_t heights[3] = { -seen->position_m[2], -seen->velocity_m_s[2], touching };
    lanes_t command[3] = { { held[0] }, { held[1] }, { held[2] } };
    int lane;
    int i;

    for (lane = 0; (lane < LANES) && ((index + lane) < simulation->flights); lane++) {
        const int64_t row = ((index + lane) * simulation->updates) + update;
        const int64_t drop = (lane * simulation->updates) + update;
        const int dropped = simulation->dropping && (draws->drops[drop] < lane_of(flight->dropped_share, lane));
        double measured[STATE_COLUMNS];
        double answer[COMMAND_COLUMNS] = { 0.0 };
        int64_t status;

        for (i = 0; i < STATE_COLUMNS; i++) {
            measured[i] = dropped ? NAN : 0.0;
        }
        for (i = 0; (i < 3) && !dropped; i++) {
            if (i < 2) {
                measured[POSITION_COLUMN + i] = lane_of(seen->position_m[i], lane);
                measured[VELOCITY_COLUMN + i] = lane_of(seen->velocity_m_s[i], lane);
            }
            measured[ROLL_COLUMN + i] = lane_of(seen->euler_rad[i], lane);
            measured[HEIGHTS_COLUMN + i] = lane_of(heights[i], lane);
        }
        status = controller((char *)self + (lane * stride), measured, targets + (simulation->target_columns * row),
                            lane_of(thrust_m_s2, lane), answer);
        if (dropped) {
            status = -1;
        } else {
            for (i = 0; i < 3; i++) {
                command[i].lane[lane] = number(answer[i]);
                held[i] = command[i].real;
            }
        }
        write_axes(trace->position_m, row, lane, 3, truth_now->position_m);
        write_axes(trace->velocity_m_s, row, lane, 3, truth_now->velocity_m_s);
        write_axes(trace->euler_rad, row, lane, 3, truth_now->euler_rad);
        write_axes(trace->command_rad, row, lane, 2, held);
        write_axes(trace->thrust_acceleration_m_s2, row, lane, 1,
                   take_off ? &lift_m_s2 : (simulation->commands_thrust ? &held[2] : &thrust_m_s2));
        trace->status[row] = status;
        if (simulation->sensed) {
            write_axes(trace->seen_position_m, row, lane, 3, seen->position_m);
            write_axes(trace->seen_velocity_m_s, row, lane, 3, seen->velocity_m_s);
            write_axes(trace->seen_euler_rad, row, lane, 3, seen->euler_rad);
        }
    }
}

void engine_start_sensors(const engine_simulation_t *simulation, flying_t *flying)
{
    const rotation_t r = rotation(flying->state.body + EULER);
    const seen_t start = truth(&flying->state, &r);

    if (simulation->captured) {
        mocap_start(simulation, &start, &r, &flying->mocap);
    } else if (simulation->drifting) {
        drift_start(&flying->drift);
    } else {
        suite_start(simulation, &start, &r, &flying->suite);
    }
}

/* A row of random numbers (lanes, rows, width). */
static inline void take(const double *numbers, int64_t rows, int64_t row, int width, real_t *taken)
{
    int lane;
    int i;

    for (i = 0; i < width; i++) {
        lanes_t lanes;

        for (lane = 0; lane < LANES; lane++) {
            lanes.lane[lane] = numbers[(((lane * rows) + row) * width) + i];
        }
        taken[i] = lanes.real;
    }
}

/* What the altitude loop is to follow, from the targets of an update. */
static inline vertical_t vertical_target(const engine_simulation_t *simulation, int64_t index, int64_t update,
                                         const double *targets)
{
    lanes_t z_m = { splat(simulation->height_reference_m) };
    lanes_t climb_m_s = { splat(0.0) };
    lanes_t acceleration_m_s2 = { splat(0.0) };
    vertical_t wanted;
    int lane;

    if (simulation->target_columns >= TARGET_COLUMNS) {
        for (lane = 0; (lane < LANES) && ((index + lane) < simulation->flights); lane++) {
            const int64_t row = ((index + lane) * simulation->updates) + update;
            const double *target = targets + (simulation->target_columns * row);

            z_m.lane[lane] = 0.0 - target[HEIGHT_COLUMN];
            climb_m_s.lane[lane] = target[CLIMB_COLUMN];
            acceleration_m_s2.lane[lane] = target[CLIMB_ACCELERATION_COLUMN];
        }
    }
    wanted.z_m = z_m.real;
    wanted.climb_m_s = climb_m_s.real;
    wanted.acceleration_m_s2 = acceleration_m_s2.real;
    return wanted;
}

void engine_begin(const engine_simulation_t *simulation, const engine_flight_t *flight, const engine_draws_t *draws,
                  flying_t *flying)
{
    const real_t hover_m_s2 = splat(simulation->gravity_m_s2 / simulation->thrust_gain);
    vehicle_state_t state;
    int i;

    for (i = 0; i < STATE_ROWS; i++) {
        state.body[i] = flight->body_start[i];
    }
    for (i = 0; i < 4; i++) {
        state.rotor_speed_rad_s[i] = flight->rotor_start_rad_s[i];
    }
    for (i = 0; i < 9; i++) {
        state.memory[i] = splat(0.0);
    }
    flying->state = state;
    if (simulation->sensed) {
        engine_start_sensors(simulation, flying);
    }
    if (simulation->windy) {
        real_t drawn[3];

        take(draws->gusts, (simulation->updates * simulation->ticks_per_update) + 1, 0, 3, drawn);
        flying->gusts = gusts_start(drawn);
    }
    late_start(simulation, flight->thrust_start_n, &flying->late);
    flying->command[0] = splat(0.0);
    flying->command[1] = splat(0.0);
    flying->command[2] = choose(flight->body_start[POSITION + 2] < 0.0, hover_m_s2, splat(0.0));
    wire_start(flying->command, &flying->wire);
    flying->altitude_integral_n = splat(0.0);
    flying->given_n = splat(0.0);
    flying->capped = splat(0.0);
    flying->ticks = 0;
}

void engine_update(const engine_simulation_t *simulation, const engine_flight_t *flight, int64_t index, int64_t update,
                   const double *times_s, const double *targets, const engine_draws_t *draws,
                   engine_controller_t controller, void *self, int64_t stride, flying_t *flying,
                   const engine_trace_t *trace)
{
    const int64_t rows = simulation->updates * simulation->ticks_per_update;
    const real_t heading_rad = flight->yaw_rad + (flight->yaw_rate_rad_s * maximum(splat(times_s[update]), splat(0.0)));
    const vertical_t wanted = vertical_target(simulation, index, update, targets);
    vehicle_state_t *state = &flying->state;
    int64_t tick;

    mark_lost(simulation, state);
    for (tick = 0; tick < simulation->ticks_per_update; tick++) {
        const rotation_t r = rotation(state->body + EULER);
        const int64_t ticks = flying->ticks;
        const int64_t now = simulation->first_tick + ticks;
        const int64_t row = (update * simulation->ticks_per_update) + tick;
        surroundings_t around = { flight->mass_kg, { splat(0.0), splat(0.0) }, splat(0.0) };
        real_t thrust_share = splat(1.0);
        real_t thrust_n = splat(simulation->take_off_thrust_n);
        real_t drawn[8];
        real_t shares[4];
        real_t steady_rad_s[4];
        real_t arriving[3];
        real_t reported_thrust_m_s2;
        real_t wanted_n;
        real_t given_n;
        seen_t truth_now;
        seen_t measured;
        seen_t seen;

        if (simulation->disturbed) {
            const real_t payload_kg = choose(flight->payload_tick <= now, flight->payload_kg, splat(0.0));

            apply_impulse(flight, now, payload_kg, &r, state);
            thrust_share = maximum(1.0 - (flight->battery_sag_1_s * (simulation->step_s * (double)ticks)), splat(0.0));
            if (simulation->near_ground) {
                thrust_share = thrust_share * ground_effect(simulation, flight, -state->body[POSITION + 2]);
            }
            around.mass_kg = flight->mass_kg + payload_kg;
            around.lift_m_s2 = choose(flight->vertical_gust_tick <= now, flight->vertical_gust_m_s2, splat(0.0));
            if (simulation->windy) {
                take(draws->gusts, rows + 1, row + 1, 3, drawn);
                blow(simulation, flight, drawn, &flying->gusts, around.air_m_s);
            }
        }
        truth_now = truth(state, &r);
        measured = simulation->seen_beside ? beside(&truth_now, &r, flight->lever_error_m) : truth_now;
        seen = measured;
        if (simulation->captured) {
            take(draws->sensors, rows, row, 6, drawn);
            seen = capture(simulation, flight, &measured, &r, drawn, &flying->mocap);
        } else if (simulation->drifting) {
            take(draws->sensors, rows, row, 3, drawn);
            seen = drift(simulation, flight, &measured, drawn, &flying->drift);
        } else if (simulation->sensed) {
            take(draws->sensors, rows, row, 8, drawn);
            seen = estimate(simulation, flight, &measured, &r, drawn, &flying->suite);
        }
        if ((update >= simulation->open_loop_updates) && !simulation->commands_thrust) {
            thrust_n = altitude_thrust_n(simulation, &wanted, &seen, &flying->altitude_integral_n);
        }
        if (tick == 0) {
            reported_thrust_m_s2 = thrust_n / simulation->nominal_mass_kg;
            if (simulation->commands_thrust) {
                reported_thrust_m_s2 =
                    choose((flying->capped > 0.0), (flying->given_n / (double)simulation->ticks_per_update)
                                                       / simulation->nominal_mass_kg, splat(NAN));
                flying->given_n = splat(0.0);
                flying->capped = splat(0.0);
            }
            call(simulation, flight, index, update, targets, draws, controller, self, stride, &truth_now, &seen,
                 reported_thrust_m_s2, flying->command, trace);
        }
        carry(flight, ticks, flying->command, &flying->wire, arriving);
        wanted_n = simulation->nominal_mass_kg * arriving[2];
        if ((update >= simulation->open_loop_updates) && simulation->commands_thrust) {
            thrust_n = clip(wanted_n, -simulation->thrust_limit_n, simulation->thrust_limit_n);
        }
        if (simulation->attitude == FIRST_ORDER) {
            given_n = maximum(thrust_n, splat(0.0));
            advance(simulation, flight, &around, thrust_share, thrust_n, heading_rad, ticks, arriving, &r,
                    &flying->late, state->body);
        } else {
            if (simulation->attitude == CASCADE) {
                cascade_shares(simulation, &seen, arriving, thrust_n, heading_rad, state->memory, shares);
            } else {
                stock_shares(simulation, &seen, arriving, thrust_n, heading_rad, state->memory, shares);
            }
            given_n = commanded_speeds(simulation, shares, steady_rad_s);
            integrate(simulation, flight, &around, thrust_share, &r, steady_rad_s, state);
        }
        flying->given_n = flying->given_n + given_n;
        flying->capped = choose(magnitude(given_n - wanted_n) > simulation->capped_n, splat(1.0), flying->capped);
        if (simulation->landing) {
            carry_on_ground(flight, state->body);
        }
        flying->ticks = ticks + 1;
    }
}

int64_t engine_lanes(void)
{
    return LANES;
}

int64_t engine_fastest_lanes(void)
{
#if defined(__GNUC__) && defined(__x86_64__)
    return __builtin_cpu_supports("avx2") ? 4 : 2;
#elif defined(__GNUC__) && defined(__aarch64__)
    return 2;
#else
    return 1;
#endif
}

void engine_fly(const engine_simulation_t *simulation, const engine_flight_t *flight, int64_t index,
                const double *times_s, const double *targets, const engine_draws_t *draws,
                engine_controller_t controller, void *self, int64_t stride, const engine_trace_t *trace)
{
    flying_t flying;
    int64_t update;

    engine_begin(simulation, flight, draws, &flying);
    for (update = 0; update < simulation->updates; update++) {
        engine_update(simulation, flight, index, update, times_s, targets, draws, controller, self, stride, &flying,
                      trace);
    }
}
