"""The engine evaluates flights with the bits of NumPy, whatever they are."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles.vehicle_toml import load as load_drone
from mambo_sil.flight.engine.engine_library import load
from mambo_sil.flight.engine.evaluate import evaluate, evaluate_compiled, evaluate_numpy
from mambo_sil.flight.traces import Trace
from tests.support.engines import lanes_here
from tests.support.evaluations import LIMIT_RAD, any_trace, bits, edges, edges_in_space, traces
from tests.support.tools import toolchain


def expected(trace: Trace) -> str:
    """Evaluate in NumPy."""
    return bits(evaluate_numpy(trace, LIMIT_RAD, NOMINAL))


@settings(max_examples=60)
@given(
    seed=st.integers(0, 2**32),
    samples=st.integers(2, 300),
    flights=st.integers(1, 9),
    lifting=st.integers(0, 298),
    sensed=st.booleans(),
    spatial=st.booleans(),
)
def test_any_trace_has_the_results_of_numpy(
    seed: int, samples: int, flights: int, lifting: int, *, sensed: bool, spatial: bool
) -> None:
    """In every number of lanes; crashes, NaN, infinity and take-off among them."""
    lifting = min(lifting, samples - 2)
    trace = any_trace(seed, samples, flights, sensed=sensed, lifting=lifting, spatial=spatial)
    for lanes in lanes_here():
        found = evaluate_compiled(load(toolchain("gcc"), lanes), trace, LIMIT_RAD, NOMINAL)
        assert bits(found) == expected(trace), lanes


def test_edges_and_long_flights_have_the_results_of_numpy() -> None:
    """The traces that every build and every faulty engine evaluates."""
    for trace in traces():
        assert bits(evaluate(trace, LIMIT_RAD, NOMINAL)) == expected(trace)


def test_a_crash_begins_at_its_edge() -> None:
    """A drone crashes when its thrust no longer carries the weight, and on the ground; not a bit earlier."""
    assert evaluate(edges(), LIMIT_RAD, NOMINAL).crashed.tolist() == [False, True, False, True, True]
    landed = evaluate(edges_in_space(), LIMIT_RAD, NOMINAL).crashed
    assert landed.tolist() == [False, True, False, False, True]


def test_the_drone_and_the_limit_count() -> None:
    """Another drone bears another tilt; a lower limit is reached more often."""
    trace = any_trace(3, 200, 6, sensed=False)
    trace.euler_rad[...] = 0.0
    trace.euler_rad[50, :, 0] = 0.95
    for name in ("mambo", "crazyflie"):
        drone = load_drone(name)
        found = evaluate(trace, 0.1, drone)
        assert bits(found) == bits(evaluate_numpy(trace, 0.1, drone))
        assert (found.saturated_share > evaluate(trace, LIMIT_RAD, drone).saturated_share).all()


def test_arrays_of_any_layout_are_evaluated() -> None:
    """A trace that NumPy or a file holds with the flights side by side has the same results."""
    trace = any_trace(5, 100, 5, sensed=True)
    arrays = {name: np.ascontiguousarray(array) for name, array in vars(trace).items()}
    assert bits(evaluate(type(trace)(**arrays), LIMIT_RAD, NOMINAL)) == expected(trace)


def test_without_a_compiler_the_results_are_the_same(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The flight before has already warned."""
    trace = any_trace(1, 50, 3, sensed=True)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert bits(evaluate(trace, LIMIT_RAD, NOMINAL)) == expected(trace)
