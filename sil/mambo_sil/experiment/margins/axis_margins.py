"""One axis of a controller on a drone: margins, poles, gains from gust and noise."""

import math
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.experiment.margins.hover_loop import (
    AT_COMMAND,
    AT_MOTORS,
    BY_PUSH,
    BY_SEEN,
    PLACE,
    SEEN_OF,
    SENT,
    TURNING,
    Loops,
    PeriodicLoop,
    choose,
)
from mambo_sil.experiment.margins.loop_margins import LoopMargins, measure_loop
from mambo_sil.flight.loop import Flight
from mambo_sil.results.summary import Number

TiltName = Literal["roll", "pitch"]
TILT_AXES: Final[tuple[TiltName, TiltName]] = ("roll", "pitch")
HeightName = Literal["height"]
AxisName = TiltName | HeightName
AXES: Final[tuple[AxisName, ...]] = (*TILT_AXES, "height")
PlaceName = Literal["command", "motors"]
PLACES: Final[dict[PlaceName, str]] = {"command": "the command", "motors": "the motors' torque"}
"""Where a loop is broken, in words."""
SLOWEST_RAD_S: Final = 0.02
"""Least frequency at which a loop is looked at."""
GROWTH_1_S: Final = 1e-3
"""A pole that grows more slowly counts as a drift, such as an estimated position has."""
_LEAST_SHARE: Final = 1e-3
"""A pole with a smaller share of the largest residue is left out."""
_DEAD: Final = 1e-9


class Poles(BaseModel):
    """The closed loop's poles that matter: those that a command or a torque moves and shows."""

    model_config = ConfigDict(frozen=True)

    least_damping: Number
    least_damped_rad_s: Number
    """Natural frequency of the least damped pole."""
    slowest_s: Number
    """Time constant of the slowest pole."""
    growth_1_s: Number
    """Largest real part: positive if the loop is unstable."""


class NoiseGain(BaseModel):
    """What white noise on one quantity that the controller sees does: rms over rms, in SI units."""

    model_config = ConfigDict(frozen=True)

    to_place: Number
    to_command: Number


class AxisMargins(BaseModel):
    """Roll or pitch; without margins if the loop is unstable, without `motors` on a drone that has none."""

    model_config = ConfigDict(frozen=True)

    axis: TiltName
    stable: bool
    command: LoopMargins | None
    """Broken at the command of the position controller."""
    motors: LoopMargins | None
    """Broken at the torque that the attitude loop demands of the motors."""
    poles: Poles
    gust_to_place_s2: Number
    """Largest displacement over the amplitude of an acceleration that is a sine."""
    gust_to_command_rad_s2_m: Number
    """Largest command over it."""
    noise: dict[Literal["position", "velocity", "angle"], NoiseGain]
    sensed_variation_rad: Number | None
    """Rms of the change of the command, from update to update, by the noise of the sensors; None without."""

    @property
    def loops(self) -> dict[str, LoopMargins]:
        """The margins by the place where the loop is broken."""
        found = {"command": self.command, "motors": self.motors}
        return {name: one for name, one in found.items() if one is not None}


class HeightMargins(BaseModel):
    """The height; without margins if its loop is unstable.

    It is broken at the command only: no loop of the drone lies between it and the motors.
    """

    model_config = ConfigDict(frozen=True)

    axis: HeightName = "height"
    stable: bool
    command: LoopMargins | None
    """Broken at the commanded thrust."""
    motors: None = None
    poles: Poles
    gust_to_place_s2: Number
    """As of `AxisMargins`; the acceleration is a vertical one."""
    gust_to_thrust: Number
    """Largest commanded thrust over mass over the amplitude of that acceleration."""
    noise: dict[Literal["position", "velocity"], NoiseGain]
    sensed_variation_m_s2: Number | None
    """As of `AxisMargins`, of the commanded thrust over mass."""

    @property
    def loops(self) -> dict[str, LoopMargins]:
        """The margins by the place where the loop is broken."""
        return {} if self.command is None else {"command": self.command}


Margins = AxisMargins | HeightMargins


@dataclass(frozen=True)
class _Figures:
    """What all axes have in common; infinity where a figure has no bound in an unstable loop."""

    stable: bool
    command: LoopMargins | None
    poles: Poles
    gust_to_place: float
    gust_to_command: float
    noise: list[NoiseGain]
    sensed_variation: float | None


def frequencies(loop: PeriodicLoop, update_period_s: float, count: int) -> tuple[FloatArray, FloatArray]:
    """Return frequencies up to half the rate of updates, and of ticks."""
    limits = math.pi / update_period_s, math.pi / loop.step_s
    updates, ticks = (np.geomspace(SLOWEST_RAD_S, limit, count) for limit in limits)
    return updates, ticks


def measure_loops(loops: Loops, flight: Flight, *, count: int = 400) -> tuple[Margins, ...]:
    """Return the margins of the loops of a drone of a flight, from `count` frequencies."""
    motors = not isinstance(flight.vehicle.loop, FirstOrderDrone)
    period_s = flight.update_period_s
    tilts = tuple(
        measure_axis(loop, name, period_s, motors=motors, count=count)
        for name, loop in zip(TILT_AXES, loops, strict=False)
    )
    return (*tilts, *(measure_height(loop, period_s, count=count) for loop in loops[len(tilts) :]))


def measure_axis(
    loop: PeriodicLoop, axis: TiltName, update_period_s: float, *, motors: bool, count: int = 400
) -> AxisMargins:
    """Return the figures of the loop of roll or pitch; `count` is the number of frequencies."""
    found = _measure(loop, TILT_AXES.index(axis), update_period_s, count)
    at_motors = None
    if found.stable and motors:
        _, ticks = frequencies(loop, update_period_s, count)
        at_motors = measure_loop(choose(loop, [AT_MOTORS], [TURNING]), ticks, update_period_s)
    return AxisMargins(
        axis=axis,
        stable=found.stable,
        command=found.command,
        motors=at_motors,
        poles=found.poles,
        gust_to_place_s2=found.gust_to_place,
        gust_to_command_rad_s2_m=found.gust_to_command,
        noise=dict(zip(("position", "velocity", "angle"), found.noise, strict=True)),
        sensed_variation_rad=found.sensed_variation,
    )


def measure_height(loop: PeriodicLoop, update_period_s: float, *, count: int = 400) -> HeightMargins:
    """Return the figures of the loop of the height; `count` is the number of frequencies."""
    found = _measure(loop, len(TILT_AXES), update_period_s, count)
    return HeightMargins(
        stable=found.stable,
        command=found.command,
        poles=found.poles,
        gust_to_place_s2=found.gust_to_place,
        gust_to_thrust=found.gust_to_command,
        noise=dict(zip(("position", "velocity"), found.noise, strict=True)),
        sensed_variation_m_s2=found.sensed_variation,
    )


def _measure(loop: PeriodicLoop, axis: int, update_period_s: float, count: int) -> _Figures:
    """Return the figures of a loop of `axis_loop`."""
    updates, ticks = frequencies(loop, update_period_s, count)
    noise = BY_SEEN + len(SEEN_OF[axis])
    poles = measure_poles(choose(loop, [AT_COMMAND, AT_MOTORS], [SENT, TURNING]))
    stable = poles.growth_1_s < GROWTH_1_S
    answer = loop.response(ticks)
    magnitude = np.abs(answer)
    slow = ticks <= updates[-1]
    at_update = loop.response(updates)[:, [PLACE, SENT], BY_SEEN:noise]
    rms = _rms(at_update, updates * update_period_s)
    variation = None
    if answer.shape[2] > noise:
        change = 1.0 - np.exp(-1j * ticks[:, np.newaxis] * update_period_s)
        by_noise = _rms(answer[:, SENT, noise:] * change, ticks * loop.step_s)
        variation = float(np.linalg.norm(by_noise)) if stable else math.inf
    at_command = choose(loop, [AT_COMMAND], [SENT])
    return _Figures(
        stable,
        measure_loop(at_command, updates, update_period_s) if stable else None,
        poles,
        float(magnitude[slow, PLACE, BY_PUSH].max()) if stable else math.inf,
        float(magnitude[slow, SENT, BY_PUSH].max()) if stable else math.inf,
        [
            NoiseGain(to_place=place, to_command=command)
            for place, command in (rms.T if stable else np.full_like(rms.T, math.inf)).tolist()
        ],
        variation,
    )


def _rms(answer: NDArray[np.complex128], theta: FloatArray) -> FloatArray:
    """Return the rms of answers (f, ...) to white noise of rms 1, at angles (f,) up to pi in a sample."""
    power = np.abs(answer) ** 2
    theta = np.concatenate([[0.0], theta])
    power = np.concatenate([power[:1], power])
    areas = np.diff(theta) * (power[1:] + power[:-1]).T / 2.0
    return np.asarray(np.sqrt(areas.sum(axis=-1).T / math.pi))


def measure_poles(loop: PeriodicLoop) -> Poles:
    """Return the poles of a loop that have a share in its answers."""
    poles, vectors = np.linalg.eig(loop.monodromy())
    forced = np.zeros((len(vectors), loop.inputs.shape[2]))
    for transition, inputs in zip(loop.transition, loop.inputs, strict=True):
        forced = transition @ forced + inputs
    shown = loop.outputs.sum(axis=0) @ vectors
    moved: Any = np.linalg.lstsq(vectors, forced, rcond=None)[0]
    shares = np.einsum("ok,ki->koi", np.abs(shown), np.abs(moved))
    shares = (shares / np.maximum(shares.max(axis=0), 1e-300)).max(axis=(1, 2))
    alive = (np.abs(poles) > _DEAD) & (shares > _LEAST_SHARE)
    roots = np.log(poles[alive].astype(np.complex128)) / loop.period_s
    roots = roots[np.abs(roots) > GROWTH_1_S]
    damping = -roots.real / np.abs(roots)
    least, slowest = int(np.argmin(damping)), int(np.argmax(roots.real))
    return Poles(
        least_damping=damping[least],
        least_damped_rad_s=abs(roots[least]),
        slowest_s=-1.0 / roots[slowest].real,
        growth_1_s=roots[slowest].real,
    )
