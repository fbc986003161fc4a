"""Logs of the simulated Mambo: what is identified is what its stock loops are."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.drone.sensors.mocap import MotionCapture
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors
from mambo_sil.flight.controllers.pd import PdController
from mambo_sil.flight.controllers.thrust_controller import Applied
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, Outcome
from mambo_sil.flight.traces import write_csv
from mambo_sil.flight.trajectories import Waypoints
from mambo_sil.model.identify.columns import KNOWN, Column
from mambo_sil.model.identify.identify import identify, read_logs
from mambo_sil.model.identify.identify_record import IdentifySummary
from mambo_sil.model.identify.manoeuvre import DURATION_S, SINES_HZ, waypoints_csv
from mambo_sil.model.identify.motion import Motion, fit_motion
from mambo_sil.model.identify.response import FittedResponse
from mambo_sil.model.identify.segments import PERIOD_S, HeldCommand, Segment, cut
from mambo_sil.model.identify.signals import COMMANDS, START_THRUST, THRUST_COMMAND, FlightLog, Signal

Array = NDArray[np.float64]


@dataclass
class WithSines:
    """The PD controller with a sum of sines on its commands."""

    pd: PdController = field(default_factory=PdController)
    updates: int = 0

    def step(self, state: Array, target: Array, thrust_acceleration_m_s2: Array) -> Outcome:
        """Return the command of the PD, with the sines of this update added."""
        outcome = self.pd.step(state, target, thrust_acceleration_m_s2)
        phase = 2.0 * np.pi * 0.01 * self.updates * np.array(SINES_HZ)
        self.updates += 1
        sines = 0.01 * np.array([np.sin(phase + np.arange(6.0) ** 2).sum(), np.cos(phase).sum()])
        return Applied(np.asarray(outcome.command_rad, np.float64) + sines, outcome.status)


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fly the manoeuvre through noisy sensors, and write trace.csv."""
    folder = tmp_path_factory.mktemp("flight")
    (folder / "eight.csv").write_text(waypoints_csv(), "utf-8")
    flight = Flight(Waypoints.read(folder / "eight.csv"), duration_s=20.0, sensors=Sensors(derotated=True))
    write_csv(fly(flight, WithSines()), folder / "trace.csv")
    return folder / "trace.csv"


def motion_of(trace: Path, columns: Mapping[str, Column] = MappingProxyType({})) -> Motion:
    """Fit the motion of a trace alone, which takes a fifth of the time."""
    (log,), _ = read_logs([trace], columns)
    return fit_motion(cut(log))


def rise_s(summary: IdentifySummary, name: str, share: float) -> float:
    """Return when the identified response to a step first reaches a share of it."""
    fit = summary.axes[name].fitted
    assert fit is not None
    integral = 0.0 if fit.integral_1_s is None else fit.integral_1_s.value
    time_s = PERIOD_S * np.arange(400.0)
    step = HeldCommand.of(Signal(np.array([0.0, 1.0]), np.array([0.0, 1.0]), "step"))
    zero = np.zeros_like(time_s)
    segment = Segment("", time_s, (step, step), np.stack([zero, zero]), zero, None, None)
    response = FittedResponse(1.0, fit.lag_s.value, fit.delay_s.value, integral, (0.0,))
    risen = response.predict(segment, 0, 0.0)
    above = int(np.argmax(risen > share))
    return float(np.interp(share, risen[above - 1 : above + 1], time_s[above - 1 : above + 1])) - 1.0


@pytest.mark.long
def test_the_stock_loops_are_identified(trace: Path) -> None:
    """Through noise: gain 1, the integrator, and the rise times of docs/explanation/plant.md."""
    summary = identify(*read_logs([trace], {}))[0]
    loops = {"roll": (1.0, 0.245, 0.415), "pitch": (0.77, 0.155, 0.25)}
    for name, (integral_1_s, most_s, nearly_s) in loops.items():
        axis = summary.axes[name]
        assert axis.verdict == "good"
        assert axis.fitted is not None
        assert axis.fitted.integral_1_s is not None
        assert axis.other_error_rad > 2.0 * axis.held_out_error_rad
        assert abs(axis.fitted.gain.value - 1.0) < 0.02
        assert abs(axis.fitted.integral_1_s.value - integral_1_s) < 0.3
        assert abs(rise_s(summary, name, 0.63) - most_s) < 0.01
        assert abs(rise_s(summary, name, 0.9) - nearly_s) < 0.01
        assert f"{name}_integral_1_s" in summary.model


@pytest.mark.long
@pytest.mark.parametrize(("begin_s", "end_s"), [(0.0, 9.0), (8.0, 19.0), (9.0, 18.0), (10.0, 20.0)])
def test_a_short_log_does_not_lose_the_integrator(trace: Path, begin_s: float, end_s: float) -> None:
    """From the middle of a flight, too, where a larger gain without an integrator fits almost as well."""
    (log,), _ = read_logs([trace], {})
    signals = {}
    for name, signal in log.signals.items():
        kept = (signal.time_s >= begin_s) & (signal.time_s <= end_s)
        signals[name] = Signal(signal.time_s[kept], signal.value[kept], signal.column)
    summary = identify([FlightLog(log.name, signals)])[0]
    for axis in summary.axes.values():
        assert axis.verdict == "weak"
        assert axis.fitted is not None
        assert axis.fitted.integral_1_s is not None
        assert abs(axis.fitted.gain.value - 1.0) < axis.fitted.gain.within + 0.015
        assert axis.first_order is not None
        assert abs(axis.first_order.gain.value - 1.0) < axis.first_order.gain.within + 0.015


@pytest.mark.long
def test_the_drag_of_the_plant_is_identified(trace: Path) -> None:
    """From the true motion: 0.067 1/s, and g per radian."""
    missing = (*COMMANDS, THRUST_COMMAND, START_THRUST)
    motion = motion_of(trace, {name: Column(name) for name in KNOWN if name not in missing})
    assert abs(motion.acceleration_per_tilt.value - 1.0) < 0.001
    assert abs(motion.drag_1_s.value - 0.067) < 0.002


DRONE = """
[body]
mass_kg = 0.0328
drag_1_s = {drag_1_s}

[attitude]
kind = "first_order"
acceleration_per_tilt_g = {share_g}
roll = {{ gain = 0.922, lag_s = 0.048, dead_time_s = 0.027 }}
pitch = {{ gain = 0.922, lag_s = 0.048, dead_time_s = 0.027 }}
roll_trim_rad = {trim_rad}
pitch_trim_rad = {trim_rad}

[altitude]
p_n_m = 0.492
d_n_s_m = 0.23
thrust_max_n = 0.48
{thrust}
[sensors]
kind = "mocap"
position_noise_m = {noise_m}
position_delay_s = {delay_s}
velocity_filter_s = {filter_s}
attitude_noise_rad = {noise_rad}
"""


@dataclass(frozen=True)
class Captured:
    """A drone, its heading, and the motion capture that sees it."""

    drag_1_s: float = 0.456
    yaw_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    noise_m: float = 0.001
    noise_rad: float = 0.003
    delay_s: float = 0.01
    filter_s: float = 0.03
    share_g: float = 1.0
    trim_rad: float = 0.0
    thrust: str = ""
    size: float = 1.0
    """Factor on the manoeuvre, and so on its speeds."""


def capture(flown: Captured, seeds: int, folder: Path) -> list[Path]:
    """Fly the manoeuvre with PD and sines, and write the trace of each flight."""
    drone = vehicle_toml.parse(DRONE.format(**vars(flown)), "drone", "drone")
    assert isinstance(drone.sensors, MocapSensors)
    (folder / "eight.csv").write_text(waypoints_csv(), "utf-8")
    points = np.array(Waypoints.read(folder / "eight.csv").points) * [1.0, flown.size, flown.size]
    flight = Flight(
        Waypoints(tuple(map(tuple, points.tolist()))),
        duration_s=DURATION_S,
        yaw_rad=flown.yaw_rad,
        yaw_rate_rad_s=flown.yaw_rate_rad_s,
        vehicle=Vehicle.of(drone),
        sensors=MotionCapture(drone.sensors),
    )
    paths = [folder / f"trace{number}.csv" for number in range(seeds)]
    for number, path in enumerate(paths):
        write_csv(fly(replace(flight, seeds=(number,)), WithSines()), path)
    return paths


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize(
    "flown",
    [
        pytest.param(Captured(), id="as the Crazyflie"),
        pytest.param(Captured(yaw_rad=2.5, share_g=0.9, trim_rad=0.03), id="turned, with trims"),
        pytest.param(
            Captured(yaw_rate_rad_s=0.3, thrust="[thrust]\nlag_s = 0.149"), id="turning, slow rotors"
        ),
        pytest.param(Captured(drag_1_s=0.15, size=1.5, filter_s=0.06), id="little drag, slow filter"),
        pytest.param(Captured(noise_m=0.003, noise_rad=0.01), id="noise"),
        pytest.param(Captured(drag_1_s=1.0), id="much drag"),
        pytest.param(Captured(filter_s=0.0, delay_s=0.04), id="no filter, late"),
    ],
)
def test_drag_and_acceleration_are_found_through_motion_capture(flown: Captured, tmp_path: Path) -> None:
    """Within 1.5 % and 0.5 %, whatever noise, filter and heading; so are trims and lag of the velocity.

    The lag is that of the filter, which is one of samples, the delay, and half a period of the quotient.
    """
    keep = np.exp(-PERIOD_S / flown.filter_s) if flown.filter_s else 0.0
    lag_s = PERIOD_S * keep / (1.0 - keep) + flown.delay_s + 0.5 * PERIOD_S
    for path in capture(flown, 2, tmp_path):
        motion = motion_of(path)
        drag, share = motion.drag_1_s, motion.acceleration_per_tilt
        assert abs(drag.value - flown.drag_1_s) < 0.015 * flown.drag_1_s
        assert abs(share.value - flown.share_g) < 0.005 * flown.share_g
        assert abs(motion.velocity_lag_s.value - lag_s) < 0.003
        for trim in motion.trim_rad:
            assert abs(trim.value - flown.trim_rad) < 0.001
