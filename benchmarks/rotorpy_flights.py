"""Fly the generated C on RotorPy's Crazyflie, beside RotorPy's own SE3Control; takes minutes.

Plant, rotors, attitude loop and integrator are RotorPy's (`Multirotor`, steps of 10 ms, its default), so
nothing of the simulation is ours. SE3Control (Lee, Leok and McClamroch 2010) gets position, velocity and
acceleration of the target, and commands motor speeds. Ours gets position and velocity, and commands roll and
pitch through `cmd_ctatt`, RotorPy's loop with the attitude gains of SE3Control; a PD holds its height.

Through noise both see the same estimates: positions of motion capture with noise and 10 ms late, velocities
by a filter, noisy angles, as vehicle `crazyflie` has them; body rates are true.
"""

import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor
from scipy.spatial.transform import Rotation

from benchmarks.markdown import table
from mambo_codegen.settings import controller_toml, presets
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.frames import attitude_of_quaternion, command_in_frame
from mambo_sil.api.states import DroneState, TargetState
from mambo_sil.drone.plant import loops
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.sensors.mocap import MocapSuite, MotionCapture
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors
from mambo_sil.drone.vehicles.vehicle_toml import read
from mambo_sil.flight.names import CurveName
from mambo_sil.flight.trajectories import CURVES
from mambo_sil.model.derive.derived_settings import controller_text

STEP_S: Final = 0.01
SEEDS: Final = (0, 1, 2, 3, 4)
HEIGHT_M: Final = 1.1
SETTLED_M: Final = 0.05

FLOWN: Final[dict[str, tuple[CurveName, float, float, float]]] = {
    "eight, 2 m, 0.5 rad/s": ("bernoulli", 2.0, 0.5, 60.0),
    "circle, 1 m, 1.5 rad/s": ("circle", 1.0, 1.5, 60.0),
    "step, 1 m": ("step", 1.0, 0.0, 10.0),
}
"""Curve, size in m, rate in rad/s and duration in s, by title."""

DRONE: Final = read(Path(__file__).with_name("rotorpy_crazyflie.toml"))

Control = dict[str, Any]
Pilot = Callable[[Seen, FloatArray, FloatArray], Control]
"""From the state seen, [x, y, vx, vy] and [ax, ay] of the target, in NWU, to a control of RotorPy."""


@dataclass(frozen=True)
class Contender:
    """A controller: how RotorPy's vehicle takes its control, and what makes a pilot for one flight."""

    abstraction: str
    pilot: Callable[[], Pilot]


def se3() -> Pilot:
    """Return RotorPy's own controller."""
    controller = SE3Control(quad_params)

    def steer(seen: Seen, target: FloatArray, acceleration: FloatArray) -> Control:
        state = {
            "x": seen.position_m[:, 0],
            "v": seen.velocity_m_s[:, 0],
            "q": Rotation.from_euler("xyz", seen.euler_rad[:, 0]).as_quat(),
            "w": seen.rates_rad_s[:, 0],
        }
        flat: Control = {
            "x": np.array([*target[:2], HEIGHT_M]),
            "x_dot": np.array([*target[2:], 0.0]),
            "x_ddot": np.array([*acceleration, 0.0]),
            "yaw": 0.0,
            "yaw_dot": 0.0,
        }
        control: Control = controller.update(0.0, state, flat)
        return control

    return steer


def ours(controller: Controller, drone: VehicleFile) -> Pilot:
    """Return the generated C, whose heights are held by the altitude loop of `drone`."""
    controller.reset()

    def steer(seen: Seen, target: FloatArray, acceleration: FloatArray) -> Control:  # noqa: ARG001 - not told
        z_m, vz_m_s = -seen.position_m[2], -seen.velocity_m_s[2]
        thrust_n = loops.altitude_thrust(drone, -HEIGHT_M, z_m, vz_m_s)
        outcome = controller.step(
            DroneState.in_frame("NWU", seen.position_m.T, seen.velocity_m_s.T, seen.euler_rad.T),
            TargetState.in_frame("NWU", target[:2], target[2:]),
            thrust_n / drone.body.mass_kg,
        )
        roll, pitch = command_in_frame("NWU", outcome.command_rad[0])
        return {
            "cmd_thrust": float(thrust_n[0]),
            "cmd_q": Rotation.from_euler("xyz", [roll, pitch, 0.0]).as_quat(),
        }

    return steer


def fly(contender: Contender, title: str, seed: int | None) -> FloatArray:
    """Return the horizontal error in m (k,) at every step of a flight; without seed the state is true."""
    curve, size_m, rate_rad_s, duration_s = FLOWN[title]
    time_s = STEP_S * np.arange(round(duration_s / STEP_S) + 1)
    trajectory = CURVES[curve](size_m, rate_rad_s)
    targets, accelerations = trajectory.target(time_s), trajectory.acceleration(time_s)
    hover_rad_s = float(np.sqrt(quad_params["mass"] * 9.81 / (4.0 * quad_params["k_eta"])))
    vehicle = Multirotor(quad_params, control_abstraction=contender.abstraction)
    state = {
        "x": np.array([*targets[0, :2], HEIGHT_M]),
        "v": np.zeros(3),
        "q": np.array([0.0, 0.0, 0.0, 1.0]),
        "w": np.zeros(3),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(4, hover_rad_s),
    }
    sensors = DRONE.sensors
    assert isinstance(sensors, MocapSensors)
    suite = None if seed is None else MocapSuite(MotionCapture(sensors), (seed,), _true(state), STEP_S)
    pilot = contender.pilot()
    errors = np.empty(len(time_s))
    for step in range(len(time_s)):
        errors[step] = np.linalg.norm(state["x"][:2] - targets[step, :2])
        true = _true(state)
        seen = true if suite is None else suite.estimate(true)
        state = vehicle.step(state, pilot(seen, targets[step], accelerations[step]), STEP_S)
    return errors


def _true(state: dict[str, FloatArray]) -> Seen:
    """Return RotorPy's state of one drone as sensors take it, in NWU."""
    euler_rad = attitude_of_quaternion(state["q"])
    return Seen(*(values[:, np.newaxis] for values in (state["x"], state["v"], euler_rad, state["w"])))


def iae_m_s(errors: FloatArray) -> float:
    """Return the integral of the error, by the trapezoidal rule."""
    return float(STEP_S * (errors[1:] + errors[:-1]).sum() / 2.0)


def settled_s(errors: FloatArray) -> float:
    """Return the time from a step, at 1 s, until the error stays within 5 cm; infinity if it never does."""
    outside = np.flatnonzero(errors > SETTLED_M)
    return float("inf") if outside[-1] == len(errors) - 1 else STEP_S * (int(outside[-1]) + 1) - 1.0


def contenders() -> dict[str, Contender]:
    """Return the controllers by title."""
    preset = Controller(presets.preset("crazyflie"))
    settings = controller_toml.parse(controller_text(DRONE, DRONE.name), DRONE.name)
    derived = Controller(settings.model_copy(update={"height": None}))  # the PD holds it, as with the preset
    return {
        "RotorPy, SE3Control": Contender("cmd_motor_speeds", se3),
        "ours, preset `crazyflie`": Contender("cmd_ctatt", lambda: ours(preset, DRONE)),
        "ours, by `design`": Contender("cmd_ctatt", lambda: ours(derived, DRONE)),
    }


def row(title: str, contender: Contender) -> dict[str, str]:
    """Return the cells of one controller: seeing the truth, and through noise the median and the spread."""
    cells = {"controller": title}
    for name, (curve, *_) in FLOWN.items():
        score, unit = (settled_s, " s") if curve == "step" else (iae_m_s, "")
        cells[f"{name}: truth"] = f"{score(fly(contender, name, None)):.2f}{unit}"
        noisy = sorted(score(fly(contender, name, seed)) for seed in SEEDS)
        cells[f"{name}: noise"] = f"{statistics.median(noisy):.2f}{unit} ({noisy[0]:.2f} to {noisy[-1]:.2f})"
    return cells


def main() -> None:
    """Fly all and print a table."""
    print("IAE in m s over 60 s, of a step the time to within 5 cm; noise: median of 5 seeds, range\n")
    print(table([row(title, contender) for title, contender in contenders().items()]))


if __name__ == "__main__":
    main()
