"""Traces as no flight has them, to evaluate, and the results as text of all bits."""

from collections.abc import Iterator
from dataclasses import fields

import numpy as np

from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.elementary import arc_cosine, sine_cosine
from mambo_sil.flight.crashes import least_level
from mambo_sil.flight.engine.evaluate import Evaluation
from mambo_sil.flight.loop import allocate_trace
from mambo_sil.flight.metrics import Metrics
from mambo_sil.flight.traces import Trace

LIMIT_RAD = 0.35


def any_trace(
    seed: int, samples: int, flights: int, *, sensed: bool, lifting: int = 0, spatial: bool = False
) -> Trace:
    """Return flights with any errors, angles, heights, commands and statuses; `lifting` samples before t = 0.

    If `spatial` the targets have heights, many of them so low that the drone may be on the ground.

    A third of the flights has no fault; of the others each has some samples with a crash, NaN or infinity.
    """
    rng = np.random.default_rng(seed)
    time_s = np.cumsum(rng.uniform(0.001, 0.02, samples))
    time_s -= time_s[lifting] - 5e-4  # no sample at 0 itself
    targets = rng.normal(0.0, 2.0, (samples, flights, 4))
    if spatial:
        heights = rng.choice([0.0, 0.5, np.nextafter(0.5, 1.0), 1.1], (samples, flights, 2))
        targets = np.concatenate([targets, heights], axis=-1)
    trace = allocate_trace(time_s, targets, sensed=sensed)
    scales = {"position_m": 2.0, "velocity_m_s": 1.0, "euler_rad": 0.2, "command_rad": 0.1}
    for field in fields(trace):
        array = getattr(trace, field.name)
        scale = scales.get(field.name.removeprefix("seen_"))
        if scale is not None:
            array[...] = rng.normal(0.0, scale, array.shape)
    trace.thrust_acceleration_m_s2[...] = 9.81
    trace.status[...] = rng.choice([0, 0, 0, -1, 1, 2], trace.status.shape)
    trace.position_m[..., 2] = -np.abs(trace.position_m[..., 2]) - 1e-3
    trace.euler_rad[...] = np.clip(trace.euler_rad, -0.6, 0.6)
    saturated = rng.random(trace.command_rad.shape) < 0.1
    trace.command_rad[saturated] = (LIMIT_RAD * rng.choice([-1.0, 1.0, 0.999], saturated.shape))[saturated]
    for flight in range(flights):
        sample = rng.integers(samples)
        match flight % 6:
            case 1:
                trace.position_m[sample, flight, 2] = rng.choice([0.0, -0.0, 0.5])
            case 2:
                trace.euler_rad[sample, flight, rng.integers(2)] = rng.choice([1.2, -1.2, 3.0, 1e9])
            case 3:
                trace.position_m[sample:, flight] = np.nan
                trace.euler_rad[sample:, flight] = np.nan
            case 4:
                trace.command_rad[sample, flight, rng.integers(2)] = rng.choice([np.inf, -np.inf, np.nan])
    return trace


def edges() -> Trace:
    """Return five flights at the edge of a crash: level enough by a bit, or not, and at the height 0."""
    trace = any_trace(7, 5, 5, sensed=False)
    least = least_level(NOMINAL)
    tilts_rad = arc_cosine(least) + np.spacing(1.0) * np.arange(-8, 9)
    levels = sine_cosine(tilts_rad)[1]
    trace.position_m[..., 2] = -1.0
    trace.euler_rad[...] = 0.0
    trace.euler_rad[2, 0, 0] = tilts_rad[levels > least][-1]
    trace.euler_rad[2, 1, 1] = tilts_rad[levels <= least][0]
    trace.position_m[4, 2, 2] = -np.finfo(np.float64).tiny
    trace.position_m[4, 3, 2] = 0.0
    trace.position_m[0, 4, 2] = 1.0
    return trace


def edges_in_space() -> Trace:
    """Return five flights on the ground, and near it, below targets at the edge of a crash and beyond."""
    trace = any_trace(8, 5, 5, sensed=False, spatial=True)
    trace.position_m[..., 2] = -1.0
    trace.euler_rad[...] = 0.0
    trace.target[..., 4] = 1.1
    trace.target[2, :, 4] = [0.5, np.nextafter(0.5, 1.0), 0.0, 0.5, 0.5]
    trace.position_m[2, :, 2] = [0.0, 0.0, 0.3, -0.0, np.nan]
    trace.target[2, :, 5] = [9.0, 0.0, 9.0, 9.0, 0.0]
    trace.target[2, :, 1] = [9.0, 0.0, 9.0, 9.0, 0.0]
    return trace


def traces() -> Iterator[Trace]:
    """Yield the traces on which C and NumPy are compared."""
    yield edges()
    yield edges_in_space()
    for seed, (samples, flights, lifting) in enumerate([(2, 1, 0), (3, 5, 1), (700, 13, 0), (300, 6, 200)]):
        spatial = seed in (1, 2)
        yield any_trace(seed, samples, flights, sensed=bool(seed % 2), lifting=lifting, spatial=spatial)


def bits(results: Evaluation) -> str:
    """Return every number of an evaluation; all NaN are one."""
    found = {name: getattr(results, name).tolist() for name in ("crashed", "refused", "saturated_share")}
    for name in ("metrics", "seen"):
        metrics: Metrics | None = getattr(results, name)
        found[name] = metrics and {key: values.tolist() for key, values in vars(metrics).items()}
    return repr(found)
