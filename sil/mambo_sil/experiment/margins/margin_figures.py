"""The figures of an axis in words: verdict, names, units, and formatted values."""

import math
from collections.abc import Iterator, Sequence
from typing import Final

from mambo_sil.experiment.margins.axis_margins import PLACES, HeightMargins, Margins
from mambo_sil.experiment.margins.loop_margins import LoopMargins
from mambo_sil.results.number_format import three_digits

_INFINITE: Final = "\N{INFINITY}"
_DASH: Final = "\N{EN DASH}"
_UNITS: Final = {"position": "m", "velocity": "m/s", "angle": "rad"}
"""Units of what the controller sees."""

Row = tuple[str, float, str]
"""Name, value and unit of a figure."""


def number(value: float) -> str:
    """Format a figure: infinity as its sign, and a dash for what is not there."""
    if math.isnan(value):
        return _DASH
    return three_digits(value) if math.isfinite(value) else _INFINITE


def figure_table(axes: Sequence[Margins]) -> list[tuple[str, list[str], str]]:
    """Return name, formatted value of each axis, and unit of every figure that one of the axes has."""
    known = [{(name, unit): value for name, value, unit in figure_rows(axis)} for axis in axes]
    # In the order of the longest column; figures of one name, which differ in their unit, stand together.
    keys = list(dict.fromkeys(key for one in sorted(known, key=len, reverse=True) for key in one))
    names = [name for name, _ in keys]
    return [
        (name, [number(one.get((name, unit), math.nan)) for one in known], unit)
        for name, unit in sorted(keys, key=lambda key: names.index(key[0]))
    ]


def verdict(axis: Margins) -> str:
    """Return in words how far an axis is from instability."""
    if not axis.stable:
        return f"{axis.axis}: UNSTABLE, grows e-fold in {three_digits(1.0 / axis.poles.growth_1_s)} s"
    parts = []
    for place, loop in axis.loops.items():
        gain = "any gain" if math.isinf(loop.gain_up) else f"{loop.gain_up:.2g} times the gain"
        delay = "any delay" if math.isinf(loop.delay_s) else f"{1e3 * loop.delay_s:.0f} ms more delay"
        where = "" if place == "command" else f"at {PLACES['motors']} "
        parts.append(f"{where}{gain} or {delay}")
    return f"{axis.axis}: tolerates {'; '.join(parts)}"


def figure_rows(axis: Margins) -> Iterator[Row]:
    """Yield the figures of an axis."""
    for place, loop in axis.loops.items():
        where = "command" if place == "command" else "motors"
        yield from ((f"{where}: {name}", value, unit) for name, value, unit in _loop_rows(loop))
    poles = axis.poles
    yield "least damped pole: damping", poles.least_damping, ""
    yield "least damped pole: frequency", poles.least_damped_rad_s, "rad/s"
    yield "slowest pole: time constant", poles.slowest_s, "s"
    yield "gust to position", axis.gust_to_place_s2, "m per m/s^2"
    if isinstance(axis, HeightMargins):
        unit, gust, variation = "m/s^2", axis.gust_to_thrust, axis.sensed_variation_m_s2
    else:
        unit, gust, variation = "rad", axis.gust_to_command_rad_s2_m, axis.sensed_variation_rad
    yield "gust to command", gust, f"{unit} per m/s^2"
    for name, noise in axis.noise.items():
        yield f"noise of {name} to position", noise.to_place, f"m per {_UNITS[name]}"
        yield f"noise of {name} to command", noise.to_command, f"{unit} per {_UNITS[name]}"
    if variation is not None:
        yield "sensors' noise to change of command", variation, unit


def _loop_rows(loop: LoopMargins) -> Iterator[Row]:
    yield "gain margin up", loop.gain_up, "times"
    yield "gain margin down", loop.gain_down, "times"
    yield "phase margin", loop.phase_deg, "degrees"
    yield "its crossover", loop.crossover_rad_s, "rad/s"
    yield "delay margin", 1e3 * loop.delay_s, "ms"
    yield "delay margin", loop.delay_updates, "update periods"
    yield "largest sensitivity", loop.sensitivity, ""
    yield "its frequency", loop.sensitivity_rad_s, "rad/s"
    yield "largest complementary sensitivity", loop.complementary, ""
    yield "bandwidth", loop.bandwidth_rad_s, "rad/s"
