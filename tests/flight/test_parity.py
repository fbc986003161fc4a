"""Whole flights: the compiled C gives the reference's trace, and tracks better than the paper claims."""

from dataclasses import replace

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.experiment.table2.table2 import PRINTED_IMPROVEMENT, PRINTED_PD
from mambo_sil.flight import loop
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import build_library
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Bernoulli
from tests.support.cases import SCALARS
from tests.support.tools import toolchain

CASE = Bernoulli(2.0, 0.5)
CONDITIONS = {
    "hover start": Flight(CASE, duration_s=10.0),
    "take-off, turned, pushed": Flight(
        CASE, duration_s=5.0, start="take-off", yaw_rad=0.8, disturbances=Disturbances(push_m_s2=(0.5, -0.3))
    ),
}


def demand_reference(flight: Flight, trace: Trace, reference: PositionController) -> None:
    """Demand that the reference answers every update of `flight` with the commands and statuses of a trace.

    So the flight with the reference is this one: its first input is the same, and as long as the commands
    are, so are the next inputs, since the plant is the same (tests/flight/engine compares them).
    """
    inputs = np.concatenate(
        [trace.position_m[..., :2], trace.velocity_m_s[..., :2], trace.euler_rad], axis=-1
    )
    for update, target in enumerate(flight.given_targets):
        step = reference.step(inputs[update], target, trace.thrust_acceleration_m_s2[update])
        command_rad = np.asarray(step.command_rad, np.float64)
        assert command_rad.tobytes() == trace.command_rad[update].tobytes(), update
        assert (step.status == trace.status[update]).all(), update


def test_a_command_of_other_bits_is_found() -> None:
    """In the last bit of one update; the comparison above could miss it otherwise."""
    settings, flight = presets.load("mambo"), Flight(CASE, duration_s=0.2)
    trace = fly(flight, CompiledController(settings))
    demand_reference(flight, trace, method_of(settings).reference_controller())
    trace.command_rad[17, 0, 1] = np.nextafter(trace.command_rad[17, 0, 1], 1.0)
    with pytest.raises(AssertionError, match="17"):
        demand_reference(flight, trace, method_of(settings).reference_controller())


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("preset", ["mambo", pytest.param("table1", marks=pytest.mark.long)])
@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_flight_with_the_c_is_the_reference_flight(condition: str, preset: str, scalar: str) -> None:
    """All commands are equal bit for bit; the closed loop would amplify any difference."""
    settings = with_option(presets.load(preset), "code.scalar", scalar)
    flight = CONDITIONS[condition]
    library = build_library(settings, toolchain("gcc"))
    flown = fly(flight, CompiledController(settings, library=library))
    demand_reference(flight, flown, method_of(settings).reference_controller())


@pytest.mark.first_is_quick
@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_flight_in_numpy_with_the_reference_is_the_flight_with_the_c(condition: str) -> None:
    """Nothing of C in one of them: all arrays of both traces are equal bit for bit."""
    settings = presets.load("mambo")
    flight = replace(CONDITIONS[condition], duration_s=2.0)
    ours = loop.fly(flight, method_of(settings).reference_controller())
    assert fly(flight, CompiledController(settings)).same_bits(ours)


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("preset", presets.names())
def test_the_hundred_seconds_of_table_2_are_the_reference_flight(preset: str) -> None:
    """Over Table II's 100 s, compilers and optimization levels give the same bits.

    The reference answers along: with preset mambo all the way, with the others two figures of the eight.
    """
    settings = presets.load(preset)
    flight = Flight(CASE)
    first, *others = (
        fly(flight, CompiledController(settings, library=build_library(settings, toolchain(*compiler))))
        for compiler in (("gcc", "-O0"), ("gcc", "-O3"), ("clang", "-O2"))
    )
    assert all(first.same_bits(other) for other in others)
    followed = flight if preset == "mambo" else replace(flight, duration_s=25.2)
    demand_reference(followed, first, method_of(settings).reference_controller())


def indices(preset: str, scalar: str, flight: Flight) -> np.ndarray:
    """Return the indices of Table II (4, n) of flights with the compiled C."""
    settings = with_option(presets.load(preset), "code.scalar", scalar)
    return measure(fly(flight, CompiledController(settings, flight.flights))).table2


@pytest.mark.long
def test_preset_table1_improves_on_the_pd_by_more_than_the_paper_prints() -> None:
    """The PD flies its printed row within 2 % (`test_loop`), so that row is the reference."""
    assert np.all(PRINTED_PD / indices("table1", "float32", Flight(CASE))[:, 0] >= PRINTED_IMPROVEMENT)


def test_mambo_improves_on_the_pd_and_tracks_with_yaw_push_and_motor_lag() -> None:
    """By at least 20; the IAE is below 5 m s at yaw 0.8 rad, pushed along x or y, and with motor lag."""
    push = Disturbances(push_m_s2=(np.array([0, 0, 0.5, 0, 0]), np.array([0, 0, 0, 0.5, 0])))
    vehicle = Vehicle(motor_lag_s=np.array([0, 0, 0, 0, 0.03]))
    yaw_rad = np.array([0, 0.8, 0, 0, 0])
    flight = Flight(CASE, flights=5, yaw_rad=yaw_rad, vehicle=vehicle, disturbances=push)
    found = indices("mambo", "float32", flight)
    assert np.all(PRINTED_PD / found[:, 0] >= (20, 300, 300, 20))
    assert np.all(found[0] < 5)


def test_other_scalars_fly_like_float64() -> None:
    """The indices of Table II differ from those of float64 by at most a tenth."""
    found = {scalar: indices("mambo", scalar, Flight(CASE, duration_s=30.0)) for scalar in SCALARS}
    for scalar in ("float32", "fixed"):
        np.testing.assert_allclose(found[scalar], found["float64"], rtol=0.1, err_msg=scalar)
