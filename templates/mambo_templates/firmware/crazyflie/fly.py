"""Fly a figure on a Crazyflie with the controller of this folder, and log it.

Set the drone down with its nose along x of the positions, or say by --start-heading where it points. It
takes off to 0.3 m and hops 0.15 m along x; if it does not move where it tilts to, its heading is wrong, and
it lands. Then hover stays for 10 s; goto flies SIZE along x and back; eight and circle grow for a lap, are
flown LAPS times at full size, and shrink for a lap. The high-level commander of the firmware flies them,
hover, eight and circle as polynomials that the script uploads on the ground. A lap is a file of `mambo-nmpc
plan` that begins and ends at rest, and is uploaded too. A figure that is too quick for the thrust is slowed
down: its pieces that are still to come are then written by radio in flight. With --stream the script sends
full-state set-points.

    python fly.py eight --simulate
    python fly.py hover --uri radio://0/80/2M/E7E7E7E7E7
    python fly.py eight --size 0.7 --height 1 --heading 90
    python fly.py lap.csv

Ctrl-C lands; a second one stops the motors at once. The script lands if the battery is low, no position is
measured or the controller refuses its inputs, and stops the motors if the drone has tumbled. If the link is
lost, an uploaded figure goes on and descends at its end; the script tries to connect again, and lands. The
log of each flight gets a file of its own.

Needs cflib 0.1.34 or newer (pip install cflib), and a position: lighthouse, flow deck or motion capture.
Carry the drone by hand first: stateEstimate.x and .y must follow, in m, which this script cannot check.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from crazyflie_flight.calls import Crazyflie, Link
from crazyflie_flight.checks import (
    choose_app,
    land,
    require_app,
    require_armed,
    require_position,
    require_ready,
)
from crazyflie_flight.ends import LinkLostError, RefusedError, TroubleError
from crazyflie_flight.figures import Figure, climb_s, heights_m, read_lap
from crazyflie_flight.flying import Flight, fly
from crazyflie_flight.log_file import save
from crazyflie_flight.possible import HIGHEST_M, LOWEST_M, require_folder, require_possible
from crazyflie_flight.radio import LOGGED, PLACE, Radio, connect
from crazyflie_flight.simulated_drone import SimulatedDrone

URI = "radio://0/80/2M/E7E7E7E7E7"
FIGURES = ("hover", "goto", "eight", "circle")
DEFAULTS = {"size": 1.0, "height": 0.8, "rate": 0.8, "laps": 2}  # of a figure; a lap has its own


def start_positions(cf: Crazyflie) -> None:
    """Send the positions of a motion capture; with lighthouse or flow deck there is nothing to do.

    Yours could start a thread that calls cf.extpos.send_extpos(x, y, z) 100 times a second.
    """


def fly_by_radio(uri: str, log: Path, flight: Flight, start_heading_rad: float) -> bool:
    """Connect, check, fly and log; return whether the flight went to its end."""
    link = connect(uri)
    radio, floor = Radio(link.cf, LOGGED), 0.0
    try:
        require_app(link.cf)
        start_positions(link.cf)
        radio.start(uri)
        require_ready(radio)
        choose_app(link.cf)
        require_position(radio, start_heading_rad)
        require_armed(radio)
        x, y, floor, yaw = (radio.latest[name] for name in PLACE)
        fly(radio, flight, (x, y, floor, math.radians(yaw)))
        return True
    except TroubleError:
        pass  # told when it happened
    except LinkLostError:
        if radio.is_flying():
            rescue(link, radio, flight, floor)
        else:
            print("The link was lost on the ground.", file=sys.stderr)
    except KeyboardInterrupt:
        print("Stopped by Ctrl-C.", file=sys.stderr)
    finally:
        if radio.rows:
            save(log, radio.rows)
        link.close_link()
    return False


def rescue(link: Link, radio: Radio, flight: Flight, floor: float) -> None:
    """Connect again and land."""
    goes_on = "goes on; a figure that was uploaded ends on the floor"
    doing = "levels out and stops its motors after 2 s" if flight.is_streamed else goes_on
    print(f"The link is lost: the drone {doing}. Connecting again to land it.", file=sys.stderr)
    for _ in range(10):
        try:
            link.open_link()
        except Exception:  # cflib raises no class of its own
            time.sleep(1.0)
            continue
        radio.is_lost = False
        land(radio, floor, climb_s(heights_m(flight.figure)[1]))
        print("The link came back, and the drone has landed.", file=sys.stderr)
        return
    print("The link did not come back: wait until the drone is down, and switch it off.", file=sys.stderr)


def between(least: float, most: float) -> Callable[[str], float]:
    """Return a function that reads a number of an argument."""

    def number(text: str) -> float:
        value = float(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{text} must lie in {least:g}..{most:g}")
        return value

    return number


def figure_name(text: str) -> str:
    """Return the name of a figure, or of a file of a lap."""
    if text not in FIGURES:
        try:
            read_lap(text)
        except OSError as error:
            what = f"{', '.join(FIGURES)}, or a file: {error.strerror}"
            raise argparse.ArgumentTypeError(f"{text} must be {what}") from None
        except ValueError as error:
            raise argparse.ArgumentTypeError(f"{text}: {error}") from None
    return text


def parser() -> argparse.ArgumentParser:
    """Return what reads the command line."""
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add, degrees = made.add_argument, between(-180.0, 180.0)
    add("figure", type=figure_name, help=f"{', '.join(FIGURES)}, or a file of `mambo-nmpc plan`")
    size = f"m: half-width of the eight, radius, way of goto ({DEFAULTS['size']})"
    add("--size", type=between(0.05, 5.0), help=size)
    add("--height", type=between(LOWEST_M, HIGHEST_M), help=f"m above the floor ({DEFAULTS['height']})")
    heading = "of the nose in the figure, in degrees to the left of x (as it stands)"
    add("--heading", type=degrees, help=heading)
    add("--start-heading", type=degrees, default=0.0, help="of the nose on the floor, likewise (%(default)s)")
    rate = f"rad/s; the top speed of goto is SIZE times RATE ({DEFAULTS['rate']})"
    add("--rate", type=between(0.05, 5.0), help=rate)
    add("--laps", type=int, choices=range(1, 5), help=f"at full size ({DEFAULTS['laps']})")
    add("--stream", action="store_true", help="send full-state set-points, 50 a second")
    add("--uri", default=URI, help="of the drone (%(default)s)")
    add("--log", default="flight.csv", help="file; if there is one, a number is added (%(default)s)")
    simulated = "no drone: the same calls to one of mambo-nmpc (%(const)s), or to a vehicle.toml"
    add("--simulate", nargs="?", const="crazyflie", metavar="VEHICLE", help=simulated)
    sensors = "of --simulate: true, mocap, flow-deck ... (those of the vehicle's file)"
    add("--sensors", metavar="NAME", help=sensors)
    return made


def figure_of(options: argparse.Namespace, reader: argparse.ArgumentParser) -> Figure:
    """Return the figure of the command line."""
    lap = read_lap(options.figure) if options.figure not in FIGURES else ()
    numbers: dict[str, Any] = {name: getattr(options, name) for name in DEFAULTS}
    if lap and (given := [name for name, value in numbers.items() if value is not None]):
        reader.error(f"--{given[0]} is for {', '.join(FIGURES)}; {options.figure} has its own")
    numbers = {name: DEFAULTS[name] if value is None else value for name, value in numbers.items()}
    if lap:
        numbers["height"] = lap[0].z[0]
    return Figure(options.figure, lap=lap, **numbers)


def main() -> int:
    """Fly what the command line says."""
    reader = parser()
    options = reader.parse_args()
    heading_rad = None if options.heading is None else math.radians(options.heading)
    flight = Flight(figure_of(options, reader), heading_rad, is_streamed=options.stream)
    log = Path(options.log)
    try:
        require_folder(log)
        require_possible(flight.figure, is_streamed=flight.is_streamed)
        if options.simulate is None:
            return 0 if fly_by_radio(options.uri, log, flight, math.radians(options.start_heading)) else 1
        start_rad = heading_rad or 0.0
        drone = SimulatedDrone(Path(__file__).parent, options.simulate, options.sensors)
        fly(drone, flight, (0.0, 0.0, 0.0, start_rad))
        save(log, drone.fly(start_rad))
    except RefusedError as reason:
        print(f"No flight: {reason}.", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
