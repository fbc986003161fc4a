"""Blocks of the engine have the bits of NumPy on any numbers, also on those that no flight brings."""

from pathlib import Path

import numpy as np
import pytest

from mambo_sil.drone.plant import elementary
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.drone.plant.randomness import Purpose, generators
from mambo_sil.drone.plant.vehicle import Moment, Seen, Vehicle, VehicleState, truth
from mambo_sil.drone.sensors.estimators import Suite
from mambo_sil.drone.sensors.instruments import NOISES, Sensors
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.faults.injection import FaultyController
from mambo_sil.flight.altitude_loops import AltitudeLaw, AltitudeLoop, Vertical
from mambo_sil.flight.controllers.thrust_controller import Applied
from mambo_sil.flight.engine.engine_library import LANES, texts
from mambo_sil.flight.loop import HEIGHT_REFERENCE_M, Flight
from mambo_sil.flight.names import AltitudeName
from mambo_sil.flight.trajectories import Hover
from tests.support.engines import (
    NUMBERS,
    TICKS,
    any_states,
    build,
    estimates,
    injected,
    lanes_here,
    tabulate,
    ticked,
    truths,
)
from tests.support.faults import SHOWN, any_inputs
from tests.support.scenarios import LAGGING, LATE, LIMITED, changed


@pytest.fixture(
    scope="module",
    params=[pytest.param(lanes, marks=[] if lanes != 2 else pytest.mark.long) for lanes in LANES],
)
def engine(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the engine with access to its blocks."""
    if request.param not in lanes_here():
        pytest.skip(f"the processor has no {request.param} lanes")
    return build(texts(), tmp_path_factory.mktemp("engine"), lanes=request.param)


def unified(values: FloatArray) -> bytes:
    """Return the bits of an array in which every NaN is the same."""
    return np.where(np.isnan(values), np.nan, values).tobytes()


@pytest.mark.first_is_quick
def test_elementary_functions(engine: Path) -> None:
    """Sine, cosine, arc tangent and arc sine of 50,000 numbers, corners among them."""
    with np.errstate(all="ignore"):
        arcs = [elementary.arc_tangent(NUMBERS), elementary.arc_sine(NUMBERS)]
        expected = np.stack([*elementary.sine_cosine(NUMBERS), *arcs], axis=-1)
    assert unified(tabulate(engine)) == unified(expected)


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("derotated", [False, True])
@pytest.mark.parametrize("noise_scale", [0.0, 1.0])
def test_sensors_and_estimators(engine: Path, noise_scale: float, derotated: bool) -> None:
    """True states that jump, spin and fall as no flight does."""
    sensors = Sensors(noise_scale, (0.1, -0.2, 0.3), (0.01, -0.02, 0.03), derotated)
    given = truths()
    rows = np.moveaxis(given.reshape(4, TICKS, 4, 3), 0, -1)
    with np.errstate(all="ignore"):
        suite = Suite(sensors, (5, 5, 5, 5), Seen(*rows[0]))
        seen = [suite.estimate(Seen(*row)) for row in rows]
    expected = np.array([[one.position_m, one.velocity_m_s, one.euler_rad, one.rates_rad_s] for one in seen])
    draws = generators((5,), Purpose.SENSORS)[0].standard_normal((TICKS, NOISES))
    found = estimates(engine, Flight(Hover(), duration_s=1.0, sensors=sensors), given, draws)
    assert unified(found) == unified(np.moveaxis(expected, -1, 0).reshape(4, TICKS, 12))


LOWERING, YAW_LAST = (changed(LIMITED, rotors={"mixer": mixer}) for mixer in ("lower", "yaw-last"))


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("drone", "law"),
    [
        (NOMINAL, "stock"),
        (LIMITED, "feedforward"),
        (LATE, "pid"),
        (LAGGING, "stock"),
        (LOWERING, "pid"),
        (YAW_LAST, "stock"),
    ],
    ids=["mambo", "cascade", "first_order", "lagging", "lower", "yaw-last"],
)
def test_a_tick_of_the_vehicle(engine: Path, drone: VehicleFile, law: AltitudeName) -> None:
    """Inner loops, mixer, rotors, rigid body and integrator from states that no flight has."""
    rows = any_states()
    body, rotors, memory, command, thrust_n, heading, payload, air, share = np.split(
        rows.T, [12, 16, 25, 27, 28, 29, 30, 32]
    )
    vehicle, push_m_s2, lift_m_s2 = Vehicle.of(drone), (0.5, -0.2), 0.7
    known, thrusts = memory[: vehicle.loop.rows], 0
    if isinstance(vehicle.loop, FirstOrderDrone):
        decay = vehicle.loop.thrust_decay
        thrusts = 0 if decay is None else decay.late_ticks + 3
        known = np.resize(memory[:2], (vehicle.loop.rows, TICKS))
        if thrusts:
            known[-thrusts:] = memory[3]
            known[-thrusts] = memory[2]
    before = VehicleState(body, rotors, known)
    with np.errstate(all="ignore"):
        seen = truth(before)
        moment = Moment(share[0], payload[0], (air[0], air[1]), push_m_s2, lift_m_s2)
        after, _ = vehicle.advance(before, command, thrust_n[0], heading[0], seen=seen, moment=moment)
        altitude = AltitudeLoop(AltitudeLaw(law), drone, TICKS)
        altitude.integral_n = payload[0]
        demanded_n = altitude.thrust_n(Vertical(HEIGHT_REFERENCE_M, command[1], heading[0]), seen)
    kept = memory.copy()
    if not isinstance(vehicle.loop, FirstOrderDrone):
        kept[: vehicle.loop.rows] = after.memory
    elif thrusts:
        kept[2] = after.memory[-thrusts]
    expected = np.concatenate(
        [
            *(after.body, after.rotor_speed_rad_s, kept, demanded_n[np.newaxis], seen.velocity_m_s),
            altitude.integral_n[np.newaxis],
        ]
    )
    disturbances = Disturbances(wind_speed_m_s=1.0, push_m_s2=push_m_s2, vertical_gust_m_s2=lift_m_s2)
    flight = Flight(
        Hover(), duration_s=1.0, vehicle=vehicle, disturbances=disturbances, altitude=AltitudeLaw(law)
    )
    assert unified(ticked(engine, flight, rows)) == unified(expected.T)


class Probe:
    """The controller `record` of the blocks in Python, with the memory (1, 8) of its calls."""

    def __init__(self) -> None:
        self.memory = np.zeros((1, 8), np.uint8)
        self.inputs: list[FloatArray] = []

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Record the inputs and count the call."""
        calls = self.memory.view(np.int64)[0]
        calls += 1
        self.inputs.append(np.concatenate([state[0], target[0], thrust_acceleration_m_s2]))
        return Applied(np.array([[1.0, -2.0]]) * calls, np.where(calls % 3 == 0, 1, 0))


@pytest.mark.parametrize("number", range(len(SHOWN)))
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_faults(engine: Path, number: int) -> None:
    """What the controller receives, the command that reaches the drone, and the status."""
    probe, inputs = Probe(), any_inputs()
    faulty = FaultyController(probe, [SHOWN[number]], probe.memory)
    applied = [faulty.step(row[:, :7], row[:, 7:13], row[:, 13]) for row in inputs[:, np.newaxis]]
    outputs = [np.concatenate([one.command_rad[0], one.status]) for one in applied]
    expected = np.concatenate([np.array(probe.inputs), np.array(outputs)], axis=1)
    assert unified(injected(engine, SHOWN[number], inputs)) == unified(expected)
