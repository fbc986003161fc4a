"""Figures of an axis against their definitions: covariances, sines in the time domain, decaying motion."""

import dataclasses
import math
from functools import lru_cache
from typing import Any, Final

import numpy as np
import pytest
from scipy.linalg import block_diag, solve_discrete_lyapunov

from mambo_codegen.settings.presets import preset
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.experiment.margins.axis_margins import (
    Margins,
    frequencies,
    measure_axis,
    measure_height,
    measure_loops,
    measure_poles,
)
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
    hover_loops,
)
from mambo_sil.experiment.margins.loop_margins import sensitivity
from mambo_sil.experiment.margins.margins_run import MarginSubject, axes_on
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import SensorsName
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.trajectories import Hover
from tests.support.height_settings import height_settings

PAIRS: Final[tuple[tuple[str, SensorsName], ...]] = (
    ("mambo", "true"),
    ("crazyflie", "mocap"),
)


@lru_cache
def hovering(name: str, sensors: SensorsName) -> tuple[Loops, tuple[Margins, ...], float]:
    """Return loops, figures and update period of a preset on its drone; with a height on the Crazyflie."""
    vehicle = Vehicle.from_preset(name)
    settings = height_settings() if name == "crazyflie" else preset(name)
    flight = Flight(
        Hover(),
        vehicle=vehicle,
        update_period_s=settings.horizon.update_period_s,
        sensors=choose_sensors(sensors, vehicle.drone),
    )
    (loops,) = hover_loops(settings, flight)
    return loops, measure_loops(loops, flight), flight.update_period_s


def covariance(loop: PeriodicLoop) -> Any:
    """Return that of the state (k, k) at the first tick under white noise of variance 1 at every input."""
    power = np.zeros((loop.transition.shape[1],) * 2)
    for transition, inputs in zip(loop.transition, loop.inputs, strict=True):
        power = transition @ power @ transition.T + inputs @ inputs.T
    return solve_discrete_lyapunov(loop.monodromy(), power)


def rms_of(loop: PeriodicLoop) -> Any:
    """Return the rms (outputs,) of a loop under such noise, over the ticks at which each is sampled."""
    spread, powers = covariance(loop), []
    for tick, (transition, inputs) in enumerate(zip(loop.transition, loop.inputs, strict=True)):
        shown, fed = loop.outputs[tick], loop.feed[tick]
        powers.append(np.sum((shown @ spread) * shown, axis=1) + np.sum(fed**2, axis=1))
        spread = transition @ spread @ transition.T + inputs @ inputs.T
    return np.sqrt(np.average(powers, axis=0, weights=loop.sampled))


@pytest.mark.parametrize(("name", "sensors"), PAIRS)
def test_noise_gains_are_those_of_a_covariance(name: str, sensors: SensorsName) -> None:
    """White noise on each seen quantity: rms of place and command, to 2 % for the grid of frequencies."""
    loops, found, _ = hovering(name, sensors)
    for loop, margins in zip(loops, found, strict=True):
        for number, noise in enumerate(margins.noise.values()):
            place, command = (rms_of(choose(loop, [BY_SEEN + number], [output])) for output in (PLACE, SENT))
            assert noise.to_place == pytest.approx(place[0], rel=0.02)
            assert noise.to_command == pytest.approx(command[0], rel=0.02)
    assert [list(one.noise) for one in found] == [
        ["position", "velocity", "angle"] if len(seen) == 3 else ["position", "velocity"]
        for seen in SEEN_OF[: len(found)]
    ]


@pytest.mark.parametrize(("name", "sensors"), PAIRS)
def test_the_sensed_variation_is_that_of_a_covariance(name: str, sensors: SensorsName) -> None:
    """The rms of the change of the command from update to update, by all noise of the sensors."""
    loops, found, period_s = hovering(name, sensors)
    for number, (loop, margins) in enumerate(zip(loops, found, strict=True)):
        variation = (
            margins.sensed_variation_m_s2 if margins.axis == "height" else margins.sensed_variation_rad
        )
        first = BY_SEEN + len(SEEN_OF[number])
        if sensors == "true":
            assert variation is None
            continue
        noisy = choose(loop, list(range(first, loop.inputs.shape[2])), [SENT])
        every = round(period_s / loop.step_s)
        assert variation == pytest.approx(changes_of(noisy, every), rel=0.03)


def changes_of(loop: PeriodicLoop, every: int) -> float:
    """Return the rms of the change of the one output of a loop from update to update, each `every` ticks."""
    ticks, k = loop.transition.shape[:2]
    transition = np.array([block_diag(one, 1.0) for one in loop.transition])
    inputs = np.concatenate([loop.inputs, np.zeros((ticks, 1, loop.inputs.shape[2]))], axis=1)
    for tick in range(0, ticks, every):
        transition[tick, k], inputs[tick, k] = [*loop.outputs[tick, 0], 0.0], loop.feed[tick, 0]
    outputs = np.concatenate([loop.outputs, -np.ones((ticks, 1, 1))], axis=2)
    called = np.arange(ticks)[:, None] % every == 0
    (change,) = rms_of(PeriodicLoop(loop.step_s, transition, inputs, outputs, loop.feed, called))
    return float(change)


@pytest.mark.parametrize(("name", "sensors"), PAIRS)
def test_a_gust_moves_no_farther_than_the_figure(name: str, sensors: SensorsName) -> None:
    """Of sines of all frequencies, in the time domain until they are steady, the worst one reaches it."""
    loops, found, _ = hovering(name, sensors)
    for loop, margins in zip(loops, found, strict=True):
        moved, sent = swung(choose(loop, [BY_PUSH], [PLACE, SENT]), np.geomspace(0.3, 30.0, 60))
        assert moved == pytest.approx(margins.gust_to_place_s2, rel=0.02)
        command = margins.gust_to_thrust if margins.axis == "height" else margins.gust_to_command_rad_s2_m
        assert sent == pytest.approx(command, rel=0.02)


def swung(loop: PeriodicLoop, rad_s: Any) -> Any:
    """Return the largest amplitude of each output of a loop by sines of amplitude 1 at frequencies (f,)."""
    settle_s, listen_s = 25.0, 2 * math.pi / rad_s[0]
    state, ticks = np.zeros((loop.transition.shape[1], len(rad_s))), len(loop.transition)
    largest = np.zeros((loop.outputs.shape[1], len(rad_s)))
    for tick in range(round((settle_s + listen_s) / loop.step_s)):
        phase, sines = tick % ticks, np.sin(rad_s * tick * loop.step_s)[None]
        if tick * loop.step_s > settle_s:
            shown = np.abs(loop.outputs[phase] @ state + loop.feed[phase] @ sines)
            largest = np.where(loop.sampled[phase][:, None], np.maximum(largest, shown), largest)
        state = loop.transition[phase] @ state + loop.inputs[phase] @ sines
    return largest.max(axis=1)


def test_the_least_damped_pole_is_that_of_a_known_system() -> None:
    """Two oscillators and a slow lag; what is not moved or not shown, or drifts, is left out."""
    step_s = 0.01
    oscillator = [(0.1, 5.0), (0.6, 2.0)]
    blocks = [
        np.array([[-z * w, w * math.sqrt(1 - z * z)], [-w * math.sqrt(1 - z * z), -z * w]])
        for z, w in (*oscillator, (0.01, 9.0), (0.02, 8.0))
    ]
    slow, drift = np.array([[-0.2]]), np.array([[1e-5]])
    transition = block_diag(*(_exponential(one * step_s) for one in (*blocks, slow, drift)))
    inputs = np.ones((10, 1))
    outputs = np.ones((1, 10))
    inputs[4:6], outputs[:, 6:8] = 0.0, 0.0
    loop = PeriodicLoop(
        step_s, transition[None], inputs[None], outputs[None], np.zeros((1, 1, 1)), np.ones((1, 1), np.bool_)
    )
    found = measure_poles(loop)
    assert (found.least_damping, found.least_damped_rad_s) == pytest.approx((0.1, 5.0), rel=1e-6)
    assert (found.slowest_s, found.growth_1_s) == pytest.approx((5.0, -0.2), rel=1e-6)


def modes(poles: list[float], inputs: Any, outputs: Any) -> PeriodicLoop:
    """Return a system of real poles, each a state of its own, in ticks of 10 ms."""
    moved, shown = (np.array(one, np.float64)[None] for one in (inputs, outputs))
    feed, sampled = (
        kind((1, shown.shape[1], *more), dtype)
        for kind, more, dtype in ((np.zeros, moved.shape[2:], np.float64), (np.ones, (), np.bool_))
    )
    return PeriodicLoop(0.01, np.diag(poles)[None], moved, shown, feed, sampled)


@pytest.mark.parametrize(
    ("inputs", "outputs", "counts"),
    [
        ([[1.0], [1.0]], [[1.0, 1.0]], True),
        ([[1e-2], [1e-2]], [[1e-2, 1e-2]], True),
        ([[-1.0], [1.0]], [[1.0, 1.0]], True),
        ([[1.0], [1.0]], [[-1.0, 1.0]], True),
        ([[1.0], [1.0]], [[1.0, 1.0], [-1.0, 1.0]], True),
        ([[1e-4], [1.0]], [[1.0, 1.0]], False),
        ([[1.0], [1.0]], [[1e-4, 1.0]], False),
        ([[1e-4], [1.0]], [[1.0, 1.0], [1.0, 0.0]], True),
        ([[1e-4, 1.0], [1.0, 0.0]], [[1.0, 1.0]], True),
    ],
)
def test_a_pole_counts_by_its_share_of_an_answer(inputs: Any, outputs: Any, counts: bool) -> None:
    """A thousandth of the largest residue, from one input to one output, whatever its sign and scale."""
    found = measure_poles(modes([0.99, 0.9], inputs, outputs))
    assert found.slowest_s == pytest.approx(-0.01 / math.log(0.99 if counts else 0.9))


def test_a_pole_that_alternates_counts_too() -> None:
    """Its root has half the rate of the ticks."""
    found = measure_poles(modes([-0.9, 0.9], [[1.0], [1.0]], [[1.0, 1.0]]))
    size = math.hypot(math.log(0.9), math.pi)
    assert found.least_damping == pytest.approx(-math.log(0.9) / size)
    assert found.least_damped_rad_s == pytest.approx(size / 0.01)


def _exponential(matrix: Any) -> Any:
    values, vectors = np.linalg.eig(matrix)
    return (vectors * np.exp(values) @ np.linalg.inv(vectors)).real


def test_frequencies_end_at_half_the_rates() -> None:
    """Of updates and of ticks; at 0.02 rad/s they begin."""
    loops, _, period_s = hovering("mambo", "true")
    updates, ticks = frequencies(loops[0], period_s, 50)
    assert updates[[0, -1]] == pytest.approx([0.02, math.pi / period_s])
    assert ticks[[0, -1]] == pytest.approx([0.02, math.pi / loops[0].step_s])
    assert (len(updates), len(ticks)) == (50, 50)
    assert np.ptp(np.diff(np.log(updates))) < 1e-9


@pytest.mark.parametrize(("name", "sensors"), PAIRS)
def test_the_figures_at_each_place_are_those_of_the_loop_broken_there(
    name: str, sensors: SensorsName
) -> None:
    """The largest sensitivity, on the grid of ticks at the motors; the height has no motors."""
    loops, found, period_s = hovering(name, sensors)
    for loop, margins in zip(loops, found, strict=True):
        updates, ticks = frequencies(loop, period_s, 400)
        places = {"command": (choose(loop, [AT_COMMAND], [SENT]), updates)}
        if margins.axis != "height":
            places["motors"] = (choose(loop, [AT_MOTORS], [TURNING]), ticks)
        assert margins.loops.keys() == places.keys()
        for place, (broken, rad_s) in places.items():
            largest = np.abs(sensitivity(broken, rad_s)).max()
            assert largest <= margins.loops[place].sensitivity < 1.005 * largest


@pytest.mark.parametrize(("name", "sensors"), PAIRS)
def test_axes_have_their_names_and_motors_if_the_drone_has(name: str, sensors: SensorsName) -> None:
    """Roll, pitch, height; the figures of the command are those of a drone with motors."""
    loops, found, period_s = hovering(name, sensors)
    assert [one.axis for one in found] == ["roll", "pitch", "height"][: len(found)]
    without = measure_axis(loops[1], "pitch", period_s, motors=False)
    assert without == found[1].model_copy(update={"motors": None})
    assert without != found[1]


def test_an_unstable_loop_has_no_margins_and_no_bounded_answer() -> None:
    """Neither at the command nor at the motors; every gain is infinite."""
    loops, _, period_s = hovering("crazyflie", "mocap")
    roll, height = (
        dataclasses.replace(loop, transition=1.02 * loop.transition) for loop in (loops[0], loops[2])
    )
    axes = (measure_axis(roll, "roll", period_s, motors=True), measure_height(height, period_s))
    for one in axes:
        assert (one.stable, one.command, one.motors, one.loops) == (False, None, None, {})
        assert one.gust_to_place_s2 == math.inf
        assert {one.to_place for one in one.noise.values()} == {math.inf}
        assert {one.to_command for one in one.noise.values()} == {math.inf}
    assert (axes[0].gust_to_command_rad_s2_m, axes[0].sensed_variation_rad) == (math.inf, math.inf)
    assert (axes[1].gust_to_thrust, axes[1].sensed_variation_m_s2) == (math.inf, math.inf)


def test_a_subject_has_the_axes_of_its_loops() -> None:
    """None if its law is not linear."""
    drone = vehicle_toml.preset("mambo")
    _, found, _ = hovering("mambo", "true")
    assert axes_on(MarginSubject("mine", preset("mambo"), drone)) == list(found)
    assert axes_on(MarginSubject("mine", preset("mambo-1norm"), drone)) is None
