"""`pilot`: fly a real or simulated autopilot over MAVLink."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import typer

from mambo_sil.cli.command import JoinedCommand
from mambo_sil.cli.fly.fly_options import Course, CurveChoice, CurveRate, CurveSize
from mambo_sil.cli.options import AsJson, Drone, Results, Scalar, Source, load, load_drone, show_result
from mambo_sil.cli.progress import Bar, progress_bar
from mambo_sil.errors import PilotError
from mambo_sil.results.folders import new_results

if TYPE_CHECKING:
    from mambo_extensions.mavlink.links import UdpLink
    from mambo_extensions.mavlink.pilot import Pilot
    from mambo_sil.life.steering import Update

HEIGHT_M: Final = 1.5
DURATION_S: Final = 30.0


def pilot(
    source: Source,
    *,
    link: Annotated[
        str | None,
        typer.Option(help="Where the autopilot sends to on this machine.", metavar="udp:HOST:PORT"),
    ] = None,
    key: Annotated[
        Path | None,
        typer.Option(
            help="File with the key that signs the messages of --link: 64 hexadecimal digits, for you alone.",
            metavar="FILE",
        ),
    ] = None,
    simulate: Annotated[
        Literal["px4", "ardupilot"] | None,
        typer.Option(help="px4 or ardupilot: fly a simulated drone behind its messages.", metavar="NAME"),
    ] = None,
    vehicle: Drone = None,
    scalar: Scalar = None,
    trajectory: CurveChoice = "gerono",
    size_m: CurveSize = None,
    rate_rad_s: CurveRate = None,
    duration_s: Annotated[
        float | None,
        typer.Option(
            help=f"Time on the curve, in s; by default {DURATION_S:g}, or that of a plan, of a closed one "
            "two laps.",
            metavar="S",
        ),
    ] = None,
    height_m: Annotated[
        float | None,
        typer.Option(
            help="Height above the place of take-off, in m; by default 1.5, or that at which a curve with "
            "heights begins.",
            metavar="M",
        ),
    ] = None,
    farthest_m: Annotated[
        float,
        typer.Option(help="Land if the target is farther from the drone than this, in m.", metavar="M"),
    ] = 20.0,
    output: Results = Path("piloted"),
    as_json: AsJson = False,
) -> None:
    """Fly PX4 or ArduCopter over MAVLink: take off, fly a curve, land; exit 1 if it ends otherwise.

    On the computer beside a drone, or on the desk: its autopilot flies the angles of the controller.

    Ctrl-C lands, a second one stops the motors. It has flown in simulation only.
    """
    from mambo_extensions.mavlink.pilot import Pilot
    from mambo_extensions.mavlink.pilot_report import LOG, PICTURES, TRACE, PilotSummary, trace_of, write_log
    from mambo_sil.api.api_controller import Controller
    from mambo_sil.cli.fly.one_flight import curve_of, duration_of
    from mambo_sil.flight.traces import write_npz
    from mambo_sil.flight.trajectories import is_spatial, vertical_of

    settings = load(source, scalar)
    course = Course(trajectory, size_m, rate_rad_s, duration_s)
    curve, lasts_s = curve_of(course), duration_of(course, DURATION_S)
    if height_m is None:
        height_m = float(vertical_of(curve, 0.0)[0]) if is_spatial(curve) else HEIGHT_M
    open_link = _opener(source, link, simulate, vehicle, key)
    updates: list[Update] = []
    files = (LOG, TRACE, *PICTURES)
    with new_results(output, PilotSummary.command, files) as folder, progress_bar("connecting") as bar:
        flown = Pilot(Controller(settings), open_link, updates.append, _watch(bar), farthest_m=farthest_m)
        interrupted: KeyboardInterrupt | None = None
        try:
            with flown:
                flown.take_off(height_m)
                flown.fly(curve, lasts_s)
                flown.land()
        except PilotError:
            pass  # the summary says how it ended
        except KeyboardInterrupt as error:
            interrupted = error
        write_log(updates, folder / LOG)
        summary = PilotSummary.of(
            flown.life,
            updates,
            source=source,
            link=link or f"simulated {simulate}",
            simulated=simulate is not None,
            trajectory=trajectory,
        )
        if len(updates) > 1:
            bar.stage("drawing pictures")
            trace = trace_of(updates)
            write_npz(trace, folder / TRACE)
            summary.draw(trace, folder)
        summary.write(folder)
    show_result(summary, output, files if len(updates) > 1 else (LOG,), as_json=as_json)
    if interrupted is not None:
        raise interrupted
    if not summary.good:
        raise typer.Exit(1)


def _opener(
    source: str, link: str | None, simulate: str | None, vehicle: str | None, key: Path | None
) -> "Callable[[], UdpLink]":
    """Return what opens the link that the options describe; raises LinkError, BadParameter."""
    from mambo_extensions.mavlink.links import SimulatedLink, UdpLink
    from mambo_extensions.mavlink.signing import read_key
    from mambo_extensions.mavlink.sockets import parse_link
    from mambo_sil.life.records import STACKS

    if (link is None) == (simulate is None):
        raise typer.BadParameter(
            "name either this, such as udp:127.0.0.1:14540, or --simulate px4", param_hint="--link"
        )
    if link is not None:
        if vehicle is not None:
            raise typer.BadParameter("it is the drone of --simulate: leave it out", param_hint="--vehicle")
        address, secret = parse_link(link), None if key is None else read_key(key)
        return lambda: UdpLink(address, secret)
    if key is not None:
        raise typer.BadParameter("it signs the messages of --link: leave it out", param_hint="--key")
    stack, drone = STACKS[str(simulate)], load_drone(vehicle, source)
    return lambda: SimulatedLink(stack, drone)


def _watch(bar: Bar) -> "Callable[[Pilot], None]":
    """Return what shows the flight in a line."""

    def watch(flown: "Pilot") -> None:
        bar.stage(flown.words)

    return watch


COMMAND: Final = JoinedCommand(
    pilot,
    panel="Fly",
    after="fly",
    examples="""\
mambo-nmpc pilot controller.toml --link udp:127.0.0.1:14540 --trajectory circle --size-m 1
mambo-nmpc pilot controller.toml --simulate px4 -o piloted
""",
)
