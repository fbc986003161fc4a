"""The engine computes and evaluates the bits of the NumPy simulation, whatever is flown, however compiled."""

import re
import subprocess
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mambo_codegen.methods import method_of
from mambo_codegen.methods.one_norm.controller import OneNormController
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.toolchain import Toolchain
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.link import Link
from mambo_sil.drone.vehicles.vehicle_toml import load as load_drone
from mambo_sil.flight import loop
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import AnyPd, PdController, pd_controller
from mambo_sil.flight.engine.engine_library import FLAGS, LANES, LIBRARIES, SOURCES, lanes_for, load, texts
from mambo_sil.flight.engine.evaluate import evaluate, evaluate_compiled, evaluate_numpy
from mambo_sil.flight.engine.simulate import fly, fly_compiled
from mambo_sil.flight.loop import Flight, Outcome, PositionController
from mambo_sil.flight.names import PD_NAMES, SENSORS_NAMES, AltitudeName
from mambo_sil.flight.scenario import Scenario, flight_of, has_sensors
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Bernoulli
from mambo_sil.results.shared_library import LIBRARY_FLAGS
from tests.support.engines import lanes_here
from tests.support.evaluations import LIMIT_RAD, any_trace, bits, edges, edges_in_space, traces
from tests.support.height_settings import height_settings
from tests.support.one_norm import ONE_NORM
from tests.support.scenarios import BATCHES, TRUTH, drones, scenarios
from tests.support.tools import require, toolchain

MAMBO = ONE_NORM
PERIOD_S = MAMBO.horizon.update_period_s
SCALARS = ("float32", "float64", "fixed")
BUILDS = [
    *(Toolchain((name,), level) for name in ("gcc", "clang") for level in ("-O0", "-O2", None)),
    Toolchain(("gcc", "-mavx2", "-mfma")),
    Toolchain(("clang", "-mavx2", "-mfma"), "-O2"),
]


DEFAULT_BUILDS = (Toolchain(("gcc",)), Toolchain(("clang",), "-O0"))


def controller(kind: str, flight: Flight) -> CompiledController | AnyPd:
    """Make controllers for a flight: a PD, or preset mambo in a scalar type."""
    for name in PD_NAMES:
        if kind == name:
            return pd_controller(name, flight)
    return CompiledController(with_option(MAMBO, "code.scalar", kind, "test"), flight.flights)


def assert_same_bits(flight: Flight, kind: str) -> None:
    """Fly in C, in every number of lanes, and in NumPy, and compare every array."""
    theirs = loop.fly(flight, controller(kind, flight))
    for lanes in lanes_here():
        ours = fly_compiled(load(toolchain("gcc"), lanes), flight, controller(kind, flight))
        assert type(ours) is type(theirs)
        for column in fields(theirs):
            found, expected = getattr(ours, column.name), getattr(theirs, column.name)
            assert found.tobytes() == expected.tobytes(), (lanes, column.name)


@pytest.mark.sampled(12)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("kind", [*PD_NAMES, *SCALARS])
@pytest.mark.parametrize("batch", BATCHES.values(), ids=BATCHES)
def test_a_batch_of_every_kind_has_the_bits_of_numpy(batch: tuple[Scenario, ...], kind: str) -> None:
    """Every array of the trace: every disturbance, sensor, gate, and flights that are lost."""
    assert_same_bits(flight_of(batch, PERIOD_S), kind)


@pytest.mark.parametrize("batch", ["truth", "late"])
def test_drones_that_are_seen_elsewhere_have_the_bits_of_numpy(batch: str) -> None:
    """Each at a place of its own beside the one that its controller was told."""
    flight = flight_of(BATCHES[batch], PERIOD_S)
    errors_m = np.random.default_rng(3).uniform(-0.1, 0.1, (3, flight.flights))
    vehicle = replace(flight.vehicle, lever_error_m=tuple(errors_m))
    assert_same_bits(replace(flight, vehicle=vehicle, duration_s=1.0), "pd")


@pytest.mark.long
@settings(max_examples=25)
@given(data=st.data())
def test_any_flight_has_the_bits_of_numpy(data: st.DataObject) -> None:
    """One to nine drawn flights of any drone, without sensors or through them."""
    drone = data.draw(drones())
    shared = {
        "duration_s": 0.5,
        "vehicle": drone,
        "sensors": data.draw(st.sampled_from([one for one in SENSORS_NAMES if has_sensors(drone, one)])),
        "start": "take-off" if data.draw(st.integers(0, 9)) == 0 else "hover",
        "altitude_loop": data.draw(st.sampled_from(get_args(AltitudeName))),
    }
    batch = data.draw(st.lists(scenarios(**shared), min_size=1, max_size=9))
    assert_same_bits(flight_of(batch, PERIOD_S), data.draw(st.sampled_from([*PD_NAMES, *SCALARS])))


def digests(engine: Any) -> list[str]:
    """Fly every batch in `engine`; return the digests of all flights, and evaluations of any traces."""
    found = [bits(evaluate_compiled(engine, trace, LIMIT_RAD, NOMINAL)) for trace in traces()]
    for batch in BATCHES.values():
        flight = flight_of(batch, PERIOD_S)
        for name in PD_NAMES:
            trace = fly_compiled(engine, flight, pd_controller(name, flight))
            found += [trace.digest(index) for index in range(len(batch))]
    return found


@pytest.fixture(scope="module")
def known() -> list[str]:
    """Return the digests of the engine as it is used for a single flight."""
    return digests(load(toolchain("gcc")))


@pytest.mark.sampled(6)
@pytest.mark.parametrize("lanes", LANES)
@pytest.mark.parametrize(
    "build",
    [
        pytest.param(
            build,
            id=" ".join((*build.command, build.optimisation or "-O3")),
            marks=[] if build in DEFAULT_BUILDS else [pytest.mark.long],
        )
        for build in BUILDS
    ],
)
def test_every_build_has_the_same_bits(build: Toolchain, lanes: int, known: list[str]) -> None:
    """Compilers, optimisations, numbers of lanes, and a processor with fused operations."""
    require(build.command[0], build.command[0])
    if lanes not in lanes_here():
        pytest.skip(f"the processor has no {lanes} lanes")
    engine = load(build, lanes)
    assert engine.engine_lanes() == lanes
    assert digests(engine) == known


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    "lanes", [pytest.param(lanes, marks=[pytest.mark.long] * (lanes != 4)) for lanes in LANES]
)
@pytest.mark.parametrize("compiler", ["gcc", pytest.param("clang", marks=pytest.mark.long)])
def test_no_operation_is_fused(compiler: str, lanes: int, tmp_path: Path) -> None:
    """Even where the compiler may use them, for they round once instead of twice."""
    path = require(compiler, compiler)
    for name, text in texts().items():
        (tmp_path / name).write_text(text, "utf-8")
    flags = ["-mavx2", "-mfma", "-mavx512vl", *FLAGS, *LANES[lanes], *LIBRARY_FLAGS]
    subprocess.run([path, *flags, *SOURCES, "-o", "engine.so", *LIBRARIES], cwd=tmp_path, check=True)
    code = subprocess.run(
        [require("objdump", "binutils"), "-d", "engine.so"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert re.search(r"\bvmulsd\b" if lanes == 1 else r"\bvmulpd\b", code)
    assert not re.search(r"\bvf(n?m)(add|sub)", code)


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    "lanes", [pytest.param(lanes, marks=[pytest.mark.long] * (lanes != 1)) for lanes in LANES]
)
@pytest.mark.parametrize("compiler", ["gcc", pytest.param("clang", marks=pytest.mark.long)])
def test_the_engine_compiles_without_a_warning(compiler: str, lanes: int, tmp_path: Path) -> None:
    """Of gcc and of clang, in every number of lanes."""
    for name, text in texts().items():
        (tmp_path / name).write_text(text, "utf-8")
    warnings = ["-pedantic", "-Wall", "-Wextra", "-Wshadow", "-Wundef", "-Wmissing-prototypes", "-Werror"]
    command = [require(compiler, compiler), "-std=c99", "-O2", *LANES[lanes], *warnings, "-c", *SOURCES]
    subprocess.run(command, cwd=tmp_path, check=True)


class InPython:
    """A controller whose step is no C function for the engine, and fails in a call if that is given."""

    def __init__(self, controller: PositionController, fails_at: int | None = None) -> None:
        self._controller, self._fails_at, self.calls = controller, fails_at, 0

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Outcome:
        """Count the call, and step."""
        self.calls += 1
        if self.calls == self._fails_at:
            raise ZeroDivisionError("in the controller")
        return self._controller.step(state, target, thrust_acceleration_m_s2)


@pytest.mark.sampled(6)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("batch", BATCHES.values(), ids=BATCHES)
def test_a_controller_in_python_flies_in_the_engine(batch: tuple[Scenario, ...]) -> None:
    """A single flight has the bits of NumPy, and reports each update."""
    flight, shares = flight_of(batch[:1], PERIOD_S), list[float]()
    ours, theirs = (InPython(pd_controller("pid-feedforward", flight)) for _ in range(2))
    trace = fly(flight, ours, shares.append)
    assert trace.same_bits(loop.fly(flight, theirs))
    assert (ours.calls, len(shares)) == (theirs.calls, theirs.calls + 1)
    assert shares == sorted(shares)
    assert shares[-2:] == [1.0, 1.0]


def test_a_reference_of_the_height_flies_in_the_engine() -> None:
    """Its states, targets and commands have more numbers."""
    flight, settings = flight_of(BATCHES["space"][:1], PERIOD_S), height_settings()
    trace = fly(flight, method_of(settings).reference_controller())
    assert trace.same_bits(fly(flight, CompiledController(settings)))


def test_what_a_controller_in_python_raises_ends_the_flight() -> None:
    """With its own traceback; it is not called again."""
    flight = Flight(Bernoulli(2.0, 0.5), duration_s=0.2)
    failing = InPython(PdController(), fails_at=7)
    with pytest.raises(ZeroDivisionError, match="in the controller") as caught:
        fly(flight, failing)
    assert caught.traceback[-1].name == "step"
    assert failing.calls == 7


def test_what_the_engine_cannot_fly_flies_in_numpy() -> None:
    """Several flights of a controller in Python, and a delay longer than the engine holds."""
    two = Flight(Bernoulli(2.0, 0.5), duration_s=0.2, flights=2)
    reference = fly(two, OneNormController(OneNorm(MAMBO), 2))
    assert reference.same_bits(fly(two, CompiledController(MAMBO, 2)))
    late = Flight(Bernoulli(2.0, 0.5), duration_s=0.2, link=Link(delay_ticks=201))
    assert fly(late, PdController()).same_bits(loop.fly(late, PdController()))


def test_without_a_compiler_the_flight_is_the_same_and_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A warning that names what is missing."""
    flight = Flight(Bernoulli(2.0, 0.5), duration_s=0.2)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.warns(UserWarning, match="no C compiler found.*the simulation runs in NumPy"):
        trace = fly(flight, PdController())
    assert trace.same_bits(loop.fly(flight, PdController()))


def test_progress_reaches_the_end() -> None:
    """One call for each group of flights."""
    shares: dict[int, list[float]] = {lanes: [] for lanes in lanes_here()}
    for lanes, found in shares.items():
        engine = load(toolchain("gcc"), lanes)
        fly_compiled(engine, flight_of(TRUTH, PERIOD_S), PdController(), found.append)
    expected = {1: [0.2, 0.4, 0.6, 0.8, 1.0], 2: [0.4, 0.8, 1.0], 4: [0.8, 1.0]}
    assert len(TRUTH) == 5
    assert shares == {lanes: expected[lanes] for lanes in shares}


def test_a_batch_flies_in_lanes_and_a_single_flight_does_not() -> None:
    """The processor's most lanes, or one."""
    assert lanes_for(1, toolchain("gcc")) == 1
    assert lanes_for(2, toolchain("gcc")) == max(lanes_here())


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
