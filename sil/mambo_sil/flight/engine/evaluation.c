/* SPDX-License-Identifier: MIT-0
 *
 * What is computed of traces: sil/mambo_sil/flight/engine/evaluate.py for a group of flights, in one pass
 * over their samples.
 */
#include "elementary.h"

/* Fields of Metrics in sil/mambo_sil/flight/metrics.py. */
#define METRICS 13

/* Samples of the group: the first sample of the flight in each lane. */
typedef struct {
    int64_t start[LANES];
} group_t;

/* Number `place` of sample `k` of every lane, of an array whose samples have `axes` numbers. */
static inline real_t sample(const double *array, const group_t *group, int64_t k, int axes, int place)
{
    lanes_t lanes;
    int lane;

    for (lane = 0; lane < LANES; lane++) {
        lanes.lane[lane] = array[((group->start[lane] + k) * axes) + place];
    }
    return lanes.real;
}

/* The metrics, in the order of Metrics in sil/mambo_sil/flight/metrics.py. */
static inline void measure(const engine_evaluation_t *evaluation, const group_t *group, const double *times_s,
                           const double *targets, const double *position_m, const double *command_rad,
                           real_t *metrics)
{
    const int64_t first = evaluation->first_update;
    const int64_t last = evaluation->updates - 1;
    real_t before[8];
    int64_t k;
    int i;

    for (i = 0; i < METRICS; i++) {
        metrics[i] = splat(0.0);
    }
    for (k = first; k <= last; k++) {
        const real_t x_m = sample(targets, group, k, 3, 0) - sample(position_m, group, k, 3, 0);
        const real_t y_m = sample(targets, group, k, 3, 1) - sample(position_m, group, k, 3, 1);
        const real_t error_m = square_root((x_m * x_m) + (y_m * y_m));
        const real_t squared_m2 = error_m * error_m;
        const real_t height_m = -sample(position_m, group, k, 3, 2) - sample(targets, group, k, 3, 2);
        const real_t height_m2 = height_m * height_m;
        const real_t whole_m2 = squared_m2 + height_m2;
        const real_t now[8] = { error_m,
                                squared_m2,
                                times_s[k] * squared_m2,
                                times_s[k] * error_m,
                                sample(command_rad, group, k, 2, 0),
                                sample(command_rad, group, k, 2, 1),
                                height_m2,
                                whole_m2 };

        if (k > first) {
            const double step_s = times_s[k] - times_s[k - 1];

            for (i = 0; i < 4; i++) {
                metrics[i] = metrics[i] + ((step_s * (now[i] + before[i])) / 2.0);
            }
            metrics[9] = metrics[9] + ((step_s * (now[6] + before[6])) / 2.0);
            metrics[11] = metrics[11] + ((step_s * (now[7] + before[7])) / 2.0);
            metrics[7] = metrics[7] + (step_s * (magnitude(before[4]) + magnitude(before[5])));
            metrics[8] = metrics[8] + (magnitude(now[4] - before[4]) + magnitude(now[5] - before[5]));
        }
        metrics[5] = maximum(metrics[5], error_m);
        metrics[6] = error_m;
        metrics[10] = maximum(metrics[10], magnitude(height_m));
        metrics[12] = maximum(metrics[12], whole_m2);
        for (i = 0; i < 8; i++) {
            before[i] = now[i];
        }
    }
    metrics[4] = square_root(metrics[1] / (times_s[last] - times_s[first]));
    metrics[8] = metrics[8] / (double)(last - first);
    metrics[9] = square_root(metrics[9] / (times_s[last] - times_s[first]));
    metrics[11] = square_root(metrics[11] / (times_s[last] - times_s[first]));
    metrics[12] = square_root(metrics[12]);
}

static void write_metrics(const engine_evaluation_t *evaluation, int64_t index, const real_t *metrics, double *rows)
{
    int lane;
    int i;

    for (lane = 0; (lane < LANES) && ((index + lane) < evaluation->flights); lane++) {
        for (i = 0; i < METRICS; i++) {
            rows[((index + lane) * METRICS) + i] = lane_of(metrics[i], lane);
        }
    }
}

/* Whether the drones crash: tilted too far, on the ground below a high target, or lost. */
static inline mask_t crash(const engine_evaluation_t *evaluation, const group_t *group, const double *targets,
                           const engine_trace_t *trace)
{
    mask_t safe = splat(0.0) == splat(0.0);
    int64_t k;

    for (k = evaluation->first_update; k < evaluation->updates; k++) {
        const real_t height_m = -sample(trace->position_m, group, k, 3, 2);
        const mask_t low = sample(targets, group, k, 3, 2) <= evaluation->low_target_m;
        real_t sine;
        real_t cos_roll;
        real_t cos_pitch;

        sine_cosine(sample(trace->euler_rad, group, k, 3, 0), &sine, &cos_roll);
        sine_cosine(sample(trace->euler_rad, group, k, 3, 1), &sine, &cos_pitch);
        safe = safe & ((cos_roll * cos_pitch) > evaluation->least_level);
        safe = safe & ((height_m > 0.0) | (low & (height_m <= 0.0)));
    }
    return safe == 0;
}

void engine_evaluate(const engine_evaluation_t *evaluation, int64_t index, const double *times_s,
                     const double *targets, const engine_trace_t *trace, const engine_results_t *results)
{
    group_t group;
    lanes_t crashed;
    real_t metrics[METRICS];
    int64_t k;
    int lane;

    for (lane = 0; lane < LANES; lane++) {
        const int64_t flight = ((index + lane) < evaluation->flights) ? (index + lane) : index;

        group.start[lane] = flight * evaluation->updates;
    }
    crashed.whole = crash(evaluation, &group, targets, trace);
    for (lane = 0; (lane < LANES) && ((index + lane) < evaluation->flights); lane++) {
        int64_t refused = 0;
        int64_t saturated = 0;

        for (k = group.start[lane]; k < (group.start[lane] + evaluation->updates); k++) {
            const double *command_rad = &trace->command_rad[2 * k];

            refused += (trace->status[k] != 0) && (trace->status[k] != evaluation->not_called);
            saturated += (fabs(command_rad[0]) >= evaluation->limit_rad) ||
                         (fabs(command_rad[1]) >= evaluation->limit_rad);
        }
        results->crashed[index + lane] = crashed.whole_lane[lane] != 0;
        results->refused[index + lane] = refused;
        results->saturated[index + lane] = saturated;
    }
    measure(evaluation, &group, times_s, targets, trace->position_m, trace->command_rad, metrics);
    write_metrics(evaluation, index, metrics, results->metrics);
    if (trace->seen_position_m != NULL) {
        measure(evaluation, &group, times_s, targets, trace->seen_position_m, trace->command_rad, metrics);
        write_metrics(evaluation, index, metrics, results->seen_metrics);
    }
}
