"""Fly a Crazyflie without flashing it: the controller of this folder sends its angles by radio.

    python offboard.py radio://0/80/2M/E7E7E7E7E7

It flies a circle of 0.5 m around the place of take-off with stock firmware, whose Kalman filter must have a
position. Set the drone down with its nose along x. The controller runs on this computer, compiled. The
script sends roll, pitch and height 100 times a second, nothing while the state is older than 0.1 s. Without
set-points the firmware levels out after 0.5 s and stops the motors after 2 s. Ctrl-C descends, a second one
stops the motors. If the battery is low or anything fails in flight, the firmware lands the drone. Needs
cflib 0.1.34 or newer, mambo-nmpc and a C compiler.
"""

import math
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from crazyflie_flight.calls import Crazyflie
from crazyflie_flight.checks import end, require_armed, require_position, require_ready, watch
from crazyflie_flight.ends import LinkLostError, RefusedError, TroubleError
from crazyflie_flight.radio import Radio, connect

if TYPE_CHECKING:
    from mambo_nmpc import Controller, TargetState

RADIUS_M, RATE_RAD_S, HEIGHT_M, FLIGHT_S, CLIMB_S = 0.5, 0.8, 0.8, 20.0, 2.0
OLDEST_S, GIVE_UP_S = 0.1, 2.0
NAMES = ("x", "y", "z", "vx", "vy", "roll", "pitch", "yaw")
SMALL_TILT_RAD = 0.35
"""Largest tilt of settings whose tilt is exact only together with a height."""
Newest = Callable[[], tuple[Sequence[float], float]]
"""Returns the latest state, NAMES in m, m/s and degrees, and when it came."""


def state_of_radio(cf: Crazyflie) -> Newest:
    """Return a function that returns the latest state of the log."""
    from cflib.crazyflie.log import LogConfig

    latest: deque[tuple[list[float], float]] = deque([([], -math.inf)], maxlen=1)
    block = LogConfig(name="state", period_in_ms=10)
    for name in NAMES:
        block.add_variable(f"stateEstimate.{name}", "float" if name in ("x", "y", "vx", "vy") else "FP16")
    cf.log.add_config(block)
    block.data_received_cb.add_callback(
        lambda _, values, __: latest.append((list(values.values()), time.monotonic()))
    )
    block.start()
    return lambda: latest[-1]


def position(time_s: float, place: Sequence[float]) -> list[float]:
    """Return x and y of a circle around `place` that grows for 5 s, from CLIMB_S on."""
    share, phase = min(max((time_s - CLIMB_S) / 5.0, 0.0), 1.0), RATE_RAD_S * time_s
    size_m = RADIUS_M * share * share * (3.0 - 2.0 * share)
    return [place[0] + size_m * math.cos(phase), place[1] + size_m * math.sin(phase)]


def target(time_s: float, stop_s: float, place: Sequence[float]) -> "TargetState":
    """Return where the drone shall be; it stays from `stop_s` on."""
    from mambo_nmpc import TargetState

    before, now, after = (position(min(time_s, stop_s) + step, place) for step in (-0.01, 0.0, 0.01))
    moves = time_s < stop_s
    velocity = [moves * (b - a) / 0.02 for a, b in zip(before, after, strict=True)]
    acceleration = [moves * (a - 2.0 * n + b) / 1e-4 for a, n, b in zip(before, now, after, strict=True)]
    return TargetState.in_frame("NWU", now, velocity, acceleration)


def fly(radio: Radio, controller: "Controller", newest: Newest) -> str:
    """Take off, fly the circle and descend; return how it ended. A second Ctrl-C raises KeyboardInterrupt."""
    from mambo_nmpc import DroneState

    place, floor = newest()[0][:2], newest()[0][2]
    begun, step, stop_s, is_paused, is_interrupted = time.monotonic(), 0, CLIMB_S + FLIGHT_S, False, False
    while True:
        try:
            if (time_s := time.monotonic() - begun) >= stop_s + CLIMB_S + 0.5:
                return "landed"
            watch(radio)
            (x, y, _, vx, vy, *angles), came = newest()
            age_s, (roll, pitch, yaw) = begun + time_s - came, map(math.radians, angles)
            if age_s > GIVE_UP_S:
                return "no state for 2 s: the firmware has stopped the motors"
            if age_s <= OLDEST_S:
                if is_paused:
                    controller.reset((roll, pitch))
                state = DroneState((x, -y), (vx, -vy), (roll, pitch, -yaw))
                out_roll, out_pitch = controller.step(state, target(time_s, stop_s, place)).command_rad
                share = min(1.0, time_s / CLIMB_S, max(0.0, (stop_s - time_s) / CLIMB_S + 1.0))
                radio.cf.commander.send_zdistance_setpoint(
                    math.degrees(out_roll), math.degrees(out_pitch), 0.0, floor + HEIGHT_M * share
                )
            is_paused, step = age_s > OLDEST_S, step + 1
            time.sleep(max(0.0, begun + step * controller.update_period_s - time.monotonic()))
        except KeyboardInterrupt:
            if is_interrupted:
                raise
            is_interrupted, stop_s = True, min(stop_s, time.monotonic() - begun)


def controller_of_folder() -> "Controller":
    """Return the controller of this folder, whose height the stock firmware flies."""
    try:
        from mambo_codegen.settings.controller_toml import with_option, without
        from mambo_nmpc import Controller, MamboNmpcError
    except ImportError as error:
        cure = "in the folder of its source, pip install ."
        raise RefusedError(f"mambo-nmpc is missing ({error}): {cure}") from error
    try:
        settings = Controller.from_file(Path(__file__).parent / "controller.toml").settings
        if settings.model.tilt == "exact":
            settings = with_option(settings, "limits.braking_m_s2", 0.0)
            settings = with_option(settings, "limits.tilt_rad", min(SMALL_TILT_RAD, settings.limits.tilt_rad))
        return Controller(settings if settings.height is None else without(settings, "height"))
    except MamboNmpcError as error:
        raise RefusedError(str(error)) from error


def fly_by_radio(uri: str) -> str:
    """Connect, check, and fly; return how it ended. The motors stop at the end, whatever happens."""
    controller, link = controller_of_folder(), connect(uri)
    radio = Radio(link.cf)
    try:
        radio.start(uri)
        newest = state_of_radio(link.cf)
        require_ready(radio)
        require_position(radio)
        if not newest()[0]:
            raise RefusedError("the drone sends no state: go nearer to it")
        require_armed(radio)
        floor = newest()[0][2]
        try:
            return fly(radio, controller, newest)
        except KeyboardInterrupt:
            return "stopped by Ctrl-C"
        except Exception as error:  # it flies, so that it must land, whatever this is
            end(radio, error, floor, CLIMB_S)
            raise
        finally:
            link.cf.commander.send_stop_setpoint()
            link.cf.commander.send_notify_setpoint_stop()
    finally:
        link.close_link()


def main() -> None:
    """Fly, and say how it ended."""
    if len(sys.argv) != 2 or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__)
    try:
        print(fly_by_radio(sys.argv[1]))
    except RefusedError as reason:
        sys.exit(f"No flight: {reason}.")
    except TroubleError:
        sys.exit(1)  # told when it happened
    except LinkLostError:
        sys.exit("The link is lost: without set-points the firmware stops the motors after 2 s.")


if __name__ == "__main__":
    main()
