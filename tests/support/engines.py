"""Build engines from changed C, with functions that run their blocks on any numbers."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Final

import cffi
import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.faults.fault import Fault
from mambo_sil.experiment.faults.injection import native_faulty
from mambo_sil.flight.engine.engine_library import FLAGS, LANES, LIBRARIES, SOURCES, ffi, load, pointer
from mambo_sil.flight.engine.native import Native
from mambo_sil.flight.engine.records import flight_records, in_lanes, simulation_record
from mambo_sil.flight.loop import Flight
from mambo_sil.results.shared_library import LIBRARY_FLAGS
from tests.support.tools import toolchain

BLOCKS: Final = """\
#include <string.h>

#include "cascade.h"
#include "first_order.h"
#include "sensors.h"

/* Each block is a static function of a header. Lane i works on row `first` + i, or on the last one. */
static real_t column(const double *rows, int first, int n, int width, int place)
{
    lanes_t lanes;
    int lane;

    for (lane = 0; lane < LANES; lane++) {
        const int row = ((first + lane) < n) ? (first + lane) : (n - 1);

        lanes.lane[lane] = rows[(width * row) + place];
    }
    return lanes.real;
}

static void write_column(real_t value, double *rows, int first, int n, int width, int place)
{
    int lane;

    for (lane = 0; (lane < LANES) && ((first + lane) < n); lane++) {
        rows[(width * (first + lane)) + place] = lane_of(value, lane);
    }
}

static seen_t seen_of(const double *rows, int n, int tick)
{
    seen_t seen;
    int i;

    for (i = 0; i < 3; i++) {
        seen.position_m[i] = column(&rows[12 * tick], 0, LANES, 12 * n, i);
        seen.velocity_m_s[i] = column(&rows[12 * tick], 0, LANES, 12 * n, 3 + i);
        seen.euler_rad[i] = column(&rows[12 * tick], 0, LANES, 12 * n, 6 + i);
        seen.rates_rad_s[i] = column(&rows[12 * tick], 0, LANES, 12 * n, 9 + i);
    }
    return seen;
}

/* True states (LANES, n, 12) and random numbers (n, 8). */
void run_suite(const engine_simulation_t *simulation, const engine_flight_t *flight, const double *truths,
               const double *draws, double *found, int n)
{
    seen_t truth_now = seen_of(truths, n, 0);
    rotation_t r = rotation(truth_now.euler_rad);
    suite_t suite;
    int i;
    int k;

    suite_start(simulation, &truth_now, &r, &suite);
    for (i = 0; i < n; i++) {
        real_t drawn[8];
        seen_t seen;

        for (k = 0; k < 8; k++) {
            drawn[k] = splat(draws[(8 * i) + k]);
        }
        truth_now = seen_of(truths, n, i);
        r = rotation(truth_now.euler_rad);
        seen = estimate(simulation, flight, &truth_now, &r, drawn, &suite);
        for (k = 0; k < 3; k++) {
            write_column(seen.position_m[k], &found[12 * i], 0, LANES, 12 * n, k);
            write_column(seen.velocity_m_s[k], &found[12 * i], 0, LANES, 12 * n, 3 + k);
            write_column(seen.euler_rad[k], &found[12 * i], 0, LANES, 12 * n, 6 + k);
            write_column(seen.rates_rad_s[k], &found[12 * i], 0, LANES, 12 * n, 9 + k);
        }
    }
}

/* A tick from any state; without motors the last commands were all the same two, the last demands one. */
void run_tick(const engine_simulation_t *simulation, const engine_flight_t *flight, double *rows, int n)
{
    int i;
    int k;

    for (i = 0; i < n; i += LANES) {
        surroundings_t around;
        vehicle_state_t state;
        vertical_t wanted;
        late_t late;
        real_t row[33];
        real_t shares[4];
        real_t steady_rad_s[4];
        rotation_t r;
        seen_t seen;

        for (k = 0; k < 33; k++) {
            row[k] = column(rows, i, n, 33, k);
        }
        around.mass_kg = flight->mass_kg + row[29];
        around.air_m_s[0] = row[30];
        around.air_m_s[1] = row[31];
        around.lift_m_s2 = flight->vertical_gust_m_s2;
        memcpy(&state, row, sizeof state);
        r = rotation(state.body + EULER);
        seen = truth(&state, &r);
        if (simulation->attitude == FIRST_ORDER) {
            for (k = 0; k < LATE_TICKS_MAX + 2; k++) {
                late.sent_rad[k][0] = row[16];
                late.sent_rad[k][1] = row[17];
                late.demanded_n[k] = row[19];
            }
            late.thrust_n = row[18];
            advance(simulation, flight, &around, row[32], row[27], row[28], 3, &row[25], &r, &late,
                    state.body);
            if (simulation->thrust_lags) {
                state.memory[2] = late.thrust_n;
            }
        } else {
            if (simulation->attitude == CASCADE) {
                cascade_shares(simulation, &seen, &row[25], row[27], row[28], state.memory, shares);
            } else {
                stock_shares(simulation, &seen, &row[25], row[27], row[28], state.memory, shares);
            }
            (void)commanded_speeds(simulation, shares, steady_rad_s);
            integrate(simulation, flight, &around, row[32], &r, steady_rad_s, &state);
        }
        memcpy(row, &state, sizeof state);
        wanted.z_m = splat(simulation->height_reference_m);
        wanted.climb_m_s = row[26];
        wanted.acceleration_m_s2 = row[28];
        row[25] = altitude_thrust_n(simulation, &wanted, &seen, &row[29]);
        for (k = 0; k < 3; k++) {
            row[26 + k] = seen.velocity_m_s[k];
        }
        for (k = 0; k < 33; k++) {
            write_column(row[k], rows, i, n, 33, k);
        }
    }
}

static double *recorded;

/* A controller whose memory is the number of its calls; records its inputs, refuses every third call. */
int64_t record(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
               double *command_rad)
{
    int64_t *calls = self;
    int i;

    for (i = 0; i < 14; i++) {
        recorded[i] = (i < 7) ? state[i] : ((i < 13) ? target[i - 7] : thrust_acceleration_m_s2);
    }
    (*calls)++;
    command_rad[0] = (double)*calls;
    command_rad[1] = -2.0 * (double)*calls;
    return ((*calls % 3) == 0) ? 1 : 0;
}

void run_faulty(void *faulty, const double *inputs, double *found, int n)
{
    int i;

    for (i = 0; i < n; i++) {
        const double *row = &inputs[14 * i];

        recorded = &found[17 * i];
        recorded[16] = (double)engine_faulty_step(faulty, row, row + 7, row[13], recorded + 14);
    }
}

void tabulate(const double *x, double *y, int n)
{
    int i;

    for (i = 0; i < n; i += LANES) {
        const real_t number = column(x, i, n, 1, 0);
        real_t sine;
        real_t cosine;

        sine_cosine(number, &sine, &cosine);
        write_column(sine, y, i, n, 4, 0);
        write_column(cosine, y, i, n, 4, 1);
        write_column(arc_tangent(number), y, i, n, 4, 2);
        write_column(arc_sine(number), y, i, n, 4, 3);
    }
}
"""
_INTERFACE: Final = cffi.FFI()
_INTERFACE.cdef("""
    void tabulate(const double *x, double *y, int n);
    int64_t record(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                   double *command_rad);
    void run_tick(const void *simulation, const void *flight, double *rows, int n);
    void run_faulty(void *faulty, const double *inputs, double *found, int n);
    void run_suite(const void *simulation, const void *flight, const double *truths, const double *draws,
                   double *found, int n);
""")

_DRAWN: Final = np.concatenate(
    [
        np.random.default_rng(0).uniform(-10.0, 10.0, 20_000),
        np.random.default_rng(1).uniform(-2e6, 2e6, 5_000),
    ]
)
_CORNERS: Final = np.concatenate(
    [
        np.arange(-40, 41) * (np.pi / 4.0),
        np.array([2.0**20 - 1.0, 2.0**20, 2.0**20 + 1.0]) * (np.pi / 2.0),
        [0.0, -0.0, 1e-310, -1e-310, np.inf, -np.inf, np.nan, 1e300, 0.1875, 0.375, 0.625, 0.875, 1.0],
    ]
)
NUMBERS: Final[FloatArray] = np.concatenate([_DRAWN, _DRAWN / 10.0, _CORNERS, -_CORNERS])
"""Arguments of the elementary functions."""


TICKS: Final = 3000


def truths() -> FloatArray:
    """Return true states (4, TICKS, 12), as no flight has them, that begin at four points of time.

    Two wander through all gates, two jump and end with infinity and NaN. The columns are position, velocity,
    angles and rates.
    """
    rng = np.random.default_rng(7)
    walk = np.cumsum(rng.normal(0.0, np.repeat([0.02, 0.2, 0.03, 0.4], 3), (TICKS, 12)), axis=0)
    walk = np.repeat([2.0, 8.0, 1.2, 9.0], 3) * np.sin(walk)
    walk[:, 2] = -1.0 + 0.5 * walk[:, 2]
    wild = walk.copy()
    wild[rng.random(walk.shape) < 0.001] *= 1e3
    wild[-300:][rng.random((300, 12)) < 0.002] = np.inf
    wild[-100:][rng.random((100, 12)) < 0.002] = np.nan
    half = TICKS // 2
    wild_later = np.concatenate([wild[half - 500 : -500], wild[: half - 500], wild[-500:]])
    return np.stack([walk, wild, np.roll(walk, half, axis=0), wild_later])


def build(files: Mapping[str, str], folder: Path, *flags: str, lanes: int = 1) -> Path:
    """Compile the engine in `files` with gcc in a new folder, since a library is loaded once.

    Raises BuildError.
    """
    place = Path(mkdtemp(dir=folder))
    for name, text in (dict(files) | {"blocks.c": BLOCKS}).items():
        (place / name).write_text(text, "utf-8")
    sources = [*SOURCES, "blocks.c"]
    options = [*FLAGS, *LANES[lanes], *LIBRARY_FLAGS, *flags]
    toolchain("gcc").run([*options, *sources, "-o", "engine.so", *LIBRARIES], place)
    return place / "engine.so"


def lanes_here() -> list[int]:
    """Return the numbers of lanes that this processor has."""
    most = int(load(toolchain("gcc")).engine_fastest_lanes())
    return [lanes for lanes in LANES if lanes <= most]


def _records(path: Path, flight: Flight) -> tuple[Any, Any]:
    """Return the records of a simulation and of its first group in the engine at `path`."""
    flights = flight_records(flight, np.zeros((1, 4)))
    return simulation_record(flight, flight.times_s()), in_lanes(flights, _lanes(path))


def _lanes(path: Path) -> int:
    engine: Any = ffi.dlopen(str(path))
    return int(engine.engine_lanes())


def estimates(path: Path, flight: Flight, truths: FloatArray, draws: FloatArray) -> FloatArray:
    """Return what the sensors of a flight make of true states (4, k, 12) with random numbers (k, 8).

    The columns of the result (4, k, 12) are position, velocity, angles and rates, as in `Seen`.
    """
    found = np.empty_like(truths)
    records, lanes = _records(path, flight), _lanes(path)
    engine: Any = _INTERFACE.dlopen(str(path))
    for first in range(0, len(truths), lanes):
        engine.run_suite(
            *(pointer("void *", record) for record in records),
            *(pointer("double *", array) for array in (truths[first:], draws, found[first:])),
            truths.shape[1],
        )
    return found


def ticked(path: Path, flight: Flight, rows: FloatArray) -> FloatArray:
    """Return what a tick makes of `any_states` in the engine at `path`, as (k, 30).

    The columns are body, rotor speeds, memory, and before the tick the thrust that the altitude loop demands,
    the velocity in the world, and the integral of the altitude loop, which was the payload.
    """
    found = rows.copy()
    records = _records(path, flight)
    engine: Any = _INTERFACE.dlopen(str(path))
    pointers = (pointer("void *", record) for record in records)
    engine.run_tick(*pointers, pointer("double *", found), len(found))
    return found[:, :30]


def any_states() -> FloatArray:
    """Return states and what acts on them (TICKS, 33), as no flight has them; the last with infinity and NaN.

    The columns are body, rotor speeds, memory (9), command, thrust, heading, payload, air velocity, share of
    the thrust.
    """
    rng = np.random.default_rng(11)
    scales = np.repeat(
        [2.0, 2.0, 1.0, 3.0, 100.0, 0.02, 0.3, 1.0, 0.01, 3.0, 0.1], [3, 3, 3, 3, 4, 9, 2, 2, 1, 2, 1]
    )
    rows = rng.normal(0.0, scales, (TICKS, len(scales)))
    rows[:, 12:16] += 250.0
    rows[:, [27, 32]] += 0.7
    rows[rng.random(rows.shape) < 0.002] *= 1e3
    for number in (np.inf, -np.inf, np.nan, 0.0, -0.0):
        rows[-500:][rng.random((500, rows.shape[1])) < 0.003] = number
    return rows


def tabulate(path: Path) -> FloatArray:
    """Return sine, cosine, arc tangent and arc sine (n, 4) of `NUMBERS` in the engine at `path`."""
    found = np.empty((len(NUMBERS), 4))
    engine: Any = _INTERFACE.dlopen(str(path))
    engine.tabulate(*(pointer("double *", array) for array in (NUMBERS, found)), len(NUMBERS))
    return found


def injected(path: Path, fault: Fault, inputs: FloatArray) -> FloatArray:
    """Return what a fault makes of inputs (k, 14) in the engine at `path`, as (k, 17).

    The columns are state, target and thrust of the controller, the command, and the status.
    """
    found = np.empty((len(inputs), 17))
    engine: Any = _INTERFACE.dlopen(str(path))
    memory = np.zeros((1, 8), np.uint8)
    address = int(_INTERFACE.cast("intptr_t", _INTERFACE.addressof(engine, "record")))
    inner = Native(ffi.cast("engine_controller_t", address), pointer("char *", memory), 0)
    faulty = native_faulty(ffi.dlopen(str(path)), inner, [fault], memory, (0.0, 0.0, GRAVITY_M_S2))
    record: Any = ffi.cast("engine_faulty_t *", faulty.instance(0))
    if not any(record.columns):  # an effect that does not use them must not show them
        record.columns = (2, 5)
    engine.run_faulty(
        _INTERFACE.cast("void *", int(ffi.cast("intptr_t", faulty.instance(0)))),
        *(pointer("double *", array) for array in (inputs, found)),
        len(inputs),
    )
    return found
