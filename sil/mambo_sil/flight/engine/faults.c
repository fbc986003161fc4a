/* SPDX-License-Identifier: MIT-0
 *
 * Faults between drone and controller: sil/mambo_sil/experiment/faults/injection.py.
 */
#include <string.h>

#include "engine.h"

/* Effect; 0 keeps the inputs. */
#define FREEZE_STATE 1
#define SET_STATE 2
#define SCALE_STATE 3
#define SHIFT_STATE 4
#define WRAP_YAW 5
#define SHIFT_TARGET 6
#define SET_THRUST 7

/* Python's remainder by a positive number, but for the sign of zero, which what follows ignores. */
static double remainder_of(double value, double period)
{
    const double rest = fmod(value, period);

    return (rest < 0.0) ? (rest + period) : rest;
}

/* Alteration.__call__: change the inputs `since` updates after the onset. */
static void alter(const engine_faulty_t *faulty, int64_t since, double *state, double *target, double *thrust_m_s2)
{
    const double *values = faulty->values;
    const int64_t states = faulty->states;
    int64_t i;

    switch (faulty->effect) {
    case FREEZE_STATE:
        for (i = 0; i < states; i++) {
            state[i] = faulty->began[i];
        }
        break;
    case SET_STATE:
        for (i = faulty->columns[0]; ((since % faulty->of) < faulty->on) && (i < faulty->columns[1]); i++) {
            state[i] = values[0];
        }
        break;
    case SCALE_STATE:
        for (i = 0; i < states; i++) {
            state[i] = state[i] * values[i];
        }
        break;
    case SHIFT_STATE:
        for (i = 0; i < states; i++) {
            state[i] = state[i] + values[i];
        }
        break;
    case WRAP_YAW:
        state[YAW_COLUMN] = remainder_of(state[YAW_COLUMN] + values[0], 2.0 * values[0]) - values[0];
        break;
    case SHIFT_TARGET:
        for (i = 0; i < LEVEL_TARGET_COLUMNS; i++) {
            target[i] = target[i] + values[i];
        }
        break;
    case SET_THRUST:
        *thrust_m_s2 = values[0];
        break;
    }
}

int64_t engine_faulty_step(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                           double *command_rad)
{
    engine_faulty_t *faulty = self;
    const int64_t since = faulty->update - faulty->begin;
    const int64_t depth = faulty->late_updates + 1;
    const int active = (faulty->begin <= faulty->update) && (faulty->update < faulty->end);
    const int dropped = active && (faulty->drop_every > 0) && ((since % faulty->drop_every) == 0);
    const size_t states = (size_t)faulty->states * sizeof(double);
    const size_t targets = (size_t)faulty->targets * sizeof(double);
    double *computed = faulty->computed + (COMMAND_COLUMNS * (faulty->update % depth));
    const double *before = faulty->computed + (COMMAND_COLUMNS * ((faulty->update + faulty->late_updates) % depth));
    const double *sent = computed;
    double given[STATE_COLUMNS];
    double aimed[TARGET_COLUMNS];
    double answer[COMMAND_COLUMNS] = { 0.0 };
    int64_t status;
    int i;

    memcpy(given, state, states);
    memcpy(aimed, target, targets);
    if (active) {
        if (since == 0) {
            memcpy(faulty->began, state, states);
        }
        alter(faulty, since, given, aimed, &thrust_acceleration_m_s2);
    }
    if (dropped) {
        for (i = 0; i < STATE_COLUMNS; i++) {
            given[i] = NAN;
        }
        if (faulty->memory != NULL) {
            memcpy(faulty->saved, faulty->memory, (size_t)faulty->memory_bytes);
        }
    }
    status = faulty->controller(faulty->self, given, aimed, thrust_acceleration_m_s2, answer);
    if (dropped) {
        status = -1;
        memcpy(answer, before, sizeof answer);
        if (faulty->memory != NULL) {
            memcpy(faulty->memory, faulty->saved, (size_t)faulty->memory_bytes);
        }
    }
    memcpy(computed, answer, sizeof answer);
    if (active) {
        const int64_t late = (faulty->late_updates <= since) ? faulty->late_updates : (since + 1);

        sent = faulty->computed + (COMMAND_COLUMNS * (((faulty->update + depth) - late) % depth));
    }
    memcpy(command_rad, sent, (size_t)faulty->commands * sizeof *sent);
    faulty->update++;
    return status;
}

int64_t engine_levelling_step(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                              double *command_rad)
{
    engine_levelling_t *caller = self;
    const int64_t status = caller->controller(caller->self, state, target, thrust_acceleration_m_s2, command_rad);
    int ignored;

    caller->refused = (status != 0) ? (caller->refused + 1) : 0;
    if (caller->refused == caller->patience) {
        caller->reset(caller->memory, 1, caller->level, &ignored);
    }
    if (caller->refused >= caller->patience) {
        memcpy(command_rad, caller->hover, (size_t)caller->commands * sizeof *command_rad);
    }
    return status;
}

int64_t engine_adjusted_step(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                             double *command_rad)
{
    engine_adjusted_t *adjusted = self;
    int64_t i;

    for (i = 0; i < adjusted->count; i++) {
        const engine_adjustment_t *adjustment = &adjusted->adjustments[i];

        if (adjustment->update == adjusted->update) {
            int status;

            adjustment->set(adjusted->memory, 1, adjustment->values, &status);
            *adjustment->status = status;
        }
    }
    adjusted->update++;
    return adjusted->controller(adjusted->memory, state, target, thrust_acceleration_m_s2, command_rad);
}
