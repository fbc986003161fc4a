"""Send a file of `mambo-nmpc plan` to PX4's flight mode MPC, from a computer with ROS 2 beside the drone.

$ python fly_px4.py lap.csv

Take off and select MPC first. It sends the first point for 10 s, to which the mode glides, then the lap, then
its last point until Ctrl-C; from then on the sticks move the target. The plan's x is north, its y west, z up
from the place where PX4 started.
"""

import argparse
import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from px4_msgs.msg import TrajectorySetpoint
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data

from mambo_nmpc.curves import PiecesInSpace

PERIOD_S = 0.02
WAIT_S = 10.0
"""At the first point, before the lap begins."""
LOWEST_M = 0.3
"""A lap that is lower is refused: the mode would land there."""


def lowest_m(lap: PiecesInSpace) -> float:
    """Return the least height of a lap; a level one, whose heights are all 0, has none."""
    return float(lap.vertical(np.arange(0.0, lap.flown_s, PERIOD_S))[:, 0].min())


def set_point(lap: PiecesInSpace, time_s: float) -> Any:
    """Return what PX4 shall follow at a time of the lap: north, east, down."""
    x, y, vx, vy = lap.target(time_s).tolist()
    ax, ay = lap.acceleration(time_s).tolist()
    height, climb, upwards = lap.vertical(time_s).tolist()
    message = TrajectorySetpoint()
    message.timestamp = 0
    message.position = [x, y, -height]
    message.velocity = [vx, vy, -climb]
    message.acceleration = [ax, ay, -upwards]
    message.jerk = [float("nan")] * 3
    message.yaw = message.yawspeed = float("nan")
    return message


class Companion(Node):
    """Publishes set-points as long as it spins."""

    def __init__(self, lap: PiecesInSpace) -> None:
        super().__init__("fly_px4")
        self.lap, self.begins_s = lap, self.now_s() + WAIT_S
        name = "/fmu/in/trajectory_setpoint"
        self.publisher = self.create_publisher(TrajectorySetpoint, name, qos_profile_sensor_data)
        self.create_timer(PERIOD_S, self.send)

    def now_s(self) -> float:
        """Return the time in s."""
        return self.get_clock().now().nanoseconds * 1e-9

    def send(self) -> None:
        """Send the set-point that is due; before the lap the drone rests at the first point."""
        self.publisher.publish(set_point(self.lap, self.now_s() - self.begins_s))


def main() -> None:
    """Read the lap, and send it until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("lap", type=Path, help="file of `mambo-nmpc plan`")
    lap = PiecesInSpace.read(parser.parse_args().lap)
    if lowest_m(lap) < LOWEST_M:
        parser.error(f"the lap comes down to {lowest_m(lap):.2f} m: give its points z of {LOWEST_M} or more")
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(Companion(lap))


if __name__ == "__main__":
    main()
