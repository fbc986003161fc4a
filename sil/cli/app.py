"""The commands that fly, `fly` and `table2`, joined with those that generate: the whole of `mambo-nmpc`."""

import hashlib
import math
import os
import tempfile
from collections.abc import Mapping
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from mambo_nmpc.codegen import boards
from mambo_nmpc.codegen import cli as generating
from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.codegen.reference import ReferenceController
from mambo_nmpc.codegen.representation import TARGET
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.cli import boards as cli_boards
from mambo_nmpc.sil.cli import campaign, faults, tune, verify
from mambo_nmpc.sil.cli import report as cli_report
from mambo_nmpc.sil.cli.progress import progress_bar
from mambo_nmpc.sil.cli.replay import fly_again
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.controllers.emulated import EmulatedController, build_guest
from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.errors import FlightError, TrajectoryError
from mambo_nmpc.sil.files.folders import SUMMARY, new_results, summary_text
from mambo_nmpc.sil.firmware.build import builder
from mambo_nmpc.sil.flight import report
from mambo_nmpc.sil.flight.loop import Flight, PositionController, Start
from mambo_nmpc.sil.flight.loop import fly as simulate
from mambo_nmpc.sil.flight.traces import Trace, write_csv, write_npz
from mambo_nmpc.sil.flight.trajectories import CURVES, Trajectory, Waypoints
from mambo_nmpc.sil.paper import sensed
from mambo_nmpc.sil.paper.sensed import fly_sensed
from mambo_nmpc.sil.paper.table2 import CASES, PD, fly_table2
from mambo_nmpc.sil.plant.disturbances import Disturbances
from mambo_nmpc.sil.plant.gusts import LIGHT_M_S
from mambo_nmpc.sil.plant.vehicle import Vehicle
from mambo_nmpc.sil.sensors.instruments import Sensors


class SensorsKind(Enum):
    """What the controllers see the state through."""

    NONE = "none"
    MAMBO = "mambo"
    DEROTATED = "mambo-derotated"

    def of_one_flight(self) -> Sensors | None:
        """Return the sensors; None for the truth."""
        return None if self is SensorsKind.NONE else Sensors(derotated=self is SensorsKind.DEROTATED)


class ControllerKind(Enum):
    """Which position controller flies."""

    NMPC = "nmpc"
    PD = "pd"
    REFERENCE = "reference"


GUSTS = "gusts"
LONGEST_FLIGHT_S = 3600.0
LARGEST_SEED = 2**63 - 1
FLIGHT_FILES = ("trace.csv", "trace.npz", "flight.png", "flight.svg")
TABLE2_PICTURES = ("figure3.png", "figure3.svg")
SENSED_TABLE = "sensors.md"


def main() -> None:
    """Run the command line."""
    os.environ["MPLBACKEND"] = "agg"  # pictures go to files; the library stops at a backend it does not know
    app = generating.root()
    generating.register(app)
    register(app)
    cli_boards.register(app)
    faults.register(app)
    verify.register(app)
    campaign.register(app)
    tune.register(app)
    cli_report.register(app)
    app()


def register(app: typer.Typer) -> None:
    """Add the commands of this module to `app`."""
    app.command(
        epilog=generating.examples(
            "mambo-nmpc fly",
            "mambo-nmpc fly controller.toml --trajectory circle --yaw-rad 0.8 -o circle",
            "mambo-nmpc fly --controller pd --wind 0.5,0 -o pd-in-wind",
            "mambo-nmpc fly --on crazyflie -o on-crazyflie",
            "mambo-nmpc fly --trajectory waypoints.csv --start take-off --duration-s 30",
            "mambo-nmpc fly --sensors mambo --wind gusts --seed 7 -o as-on-the-mambo",
            "mambo-nmpc fly --replay worst.json -o again",
        )
    )(fly)
    app.command(
        epilog=generating.examples(
            "mambo-nmpc table2 -o table2",
            "mambo-nmpc table2 --scalar fixed -o fixed",
            "mambo-nmpc table2 --sensors -o seen",
        )
    )(table2)


def fly(
    context: typer.Context,
    source: Annotated[str, typer.Argument(help="A preset or a controller.toml.")] = "mambo",
    *,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for the results; earlier ones there are overwritten."),
    ] = Path("flight"),
    controller: Annotated[
        ControllerKind,
        typer.Option(help="The generated C (nmpc), the stock PD, or the reference in Python."),
    ] = ControllerKind.NMPC,
    trajectory: Annotated[
        str,
        typer.Option(help=f"{', '.join(CURVES)}, or a CSV file with the columns time_s, x_m, y_m."),
    ] = "bernoulli",
    size_m: Annotated[float, typer.Option(help="Half-width, radius or step of the curve, in m.")] = 2.0,
    rate_rad_s: Annotated[float, typer.Option(help="Angular rate of the curve, in rad/s.")] = 0.5,
    yaw_rad: Annotated[float, typer.Option(help="Heading, in rad, held throughout.")] = 0.0,
    wind: Annotated[
        str,
        typer.Option(
            help="Steady push of the wind along x (north), y (east), in m/s^2; or `gusts`: moving air, "
            "light turbulence towards north.",
            metavar="X,Y|gusts",
        ),
    ] = "0,0",
    sensors: Annotated[
        SensorsKind,
        typer.Option(
            help="What controller and stock loops see the state through: the truth, or the Mambo's sensors "
            "and estimators, without or with the rotation taken out of the optical flow."
        ),
    ] = SensorsKind.NONE,
    seed: Annotated[int, typer.Option(help="Of gusts and sensor noise, 0 or more.")] = 0,
    motor_lag_s: Annotated[float, typer.Option(help="Time constant of the motors, in s.")] = 0.0,
    start: Annotated[Start, typer.Option(help="In the air, or 5 s earlier on the ground.")] = Start.HOVER,
    duration_s: Annotated[float, typer.Option(help="Time on the trajectory, in s.")] = 100.0,
    scalar: generating.Scalar = None,
    on: Annotated[
        str | None,
        typer.Option(
            help="Board on whose emulated core the C runs; the same flight on this machine follows."
        ),
    ] = None,
    replay: Annotated[
        Path | None,
        typer.Option(
            help="Record of a flight to fly again, with the optimizer's inner steps.", metavar="FILE"
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.", metavar="")] = False,
) -> None:
    """Fly once on the model of the Mambo: trace, metrics and pictures."""
    if replay is not None:
        fly_again(context, replay, output, as_json=as_json)
        return
    settings = generating.load(source, scalar)
    name, period_s = echo(source), settings.horizon.update_period_s
    curve = _trajectory(trajectory, size_m, rate_rad_s)
    wind_m_s2 = (0.0, 0.0) if wind == GUSTS else _wind(wind)
    wind_speed_m_s = LIGHT_M_S if wind == GUSTS else 0.0
    _within("--yaw-rad", yaw_rad, -1000.0, 1000.0)
    _within("--motor-lag-s", motor_lag_s, 0.0, 1.0)
    _within("--duration-s", duration_s, period_s, LONGEST_FLIGHT_S)
    _within("--seed", seed, 0, LARGEST_SEED)
    try:
        flight = Flight(
            curve,
            duration_s=duration_s,
            start=start,
            yaw_rad=yaw_rad,
            vehicle=Vehicle(motor_lag_s=motor_lag_s, wind_m_s2=wind_m_s2),
            update_period_s=period_s,
            seeds=(seed,),
            disturbances=Disturbances(wind_speed_m_s=wind_speed_m_s),
            sensors=sensors.of_one_flight(),
        )
    except FlightError as error:
        raise FlightError(
            f"{name}: horizon.{error}; only the simulation, whose stock loops run at 200 Hz, asks for this"
        ) from error
    if controller is not ControllerKind.PD:
        _check_ranges(flight, settings, trajectory)
    with new_results(output, "fly", FLIGHT_FILES) as folder:
        flown_by = _controller(controller, settings) if on is None else _on_board(controller, settings, on)
        with progress_bar("flying") as progress:
            trace = simulate(flight, flown_by, progress)
        same_bits = (
            None if on is None else trace.same_bits(simulate(flight, _controller(controller, settings)))
        )
        write_csv(trace, folder / "trace.csv")
        write_npz(trace, folder / "trace.npz")
        _draw({"PD" if controller is ControllerKind.PD else f"NMPC, {name}": trace}, folder / "flight")
        summary = {
            "controller": controller.value,
            "board": on,
            "same_bits_as_host": same_bits,
            "source": source,
            "settings": settings.digest,
            "update_period_s": period_s,
            "trajectory": trajectory,
            "trajectory_sha256": _digest(trajectory) if isinstance(curve, Waypoints) else None,
            "size_m": size_m,
            "rate_rad_s": rate_rad_s,
            "yaw_rad": yaw_rad,
            "wind_m_s2": wind_m_s2,
            "wind_speed_m_s": wind_speed_m_s,
            "sensors": sensors.value,
            "seed": seed,
            "motor_lag_s": motor_lag_s,
            "start": start.value,
            "duration_s": duration_s,
            **report.found(trace, settings),
        }
        text = summary_text("fly", summary)
        (folder / SUMMARY).write_text(text, "utf-8")

    typer.echo(text if as_json else report.flight_text(summary), nl=not as_json)
    typer.echo(f"{echo(str(output))}: {', '.join(FLIGHT_FILES)}", err=True)
    if summary["lost"] or summary["mostly_refused"] or same_bits is False:
        raise typer.Exit(1)


def table2(
    *,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for the results; earlier ones there are overwritten."),
    ] = Path("table2"),
    sensors: Annotated[
        bool,
        typer.Option(
            "--sensors", help="Fly the Table II case through the Mambo's sensors and estimators instead."
        ),
    ] = False,
    scalar: generating.Scalar = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print rows and verdicts as JSON.", metavar="")
    ] = False,
) -> None:
    """Fly Table II of the paper with PD and every preset, and judge its claims."""
    if sensors:
        _table2_sensed(output, scalar, as_json=as_json)
        return
    settings = {name: generating.load(name, scalar) for name in presets.names()}
    traces = {name: f"{name.lower()}.npz" for name in (PD, *settings)}
    with new_results(output, "table2", (*traces.values(), *TABLE2_PICTURES)) as folder:
        with progress_bar("flying Table II") as progress:
            result = fly_table2(settings, progress)
        for name, trace in result.traces.items():
            write_npz(trace, folder / traces[name])
        _draw({PD: result.traces[PD], "NMPC, mambo": result.traces["mambo"]}, folder / "figure3")
        summary = {
            "scalar": scalar,
            "cases": list(CASES),
            "rows": [asdict(row) for row in result.rows],
            "claims": [asdict(claim) for claim in result.claims],
        }
        text = summary_text("table2", summary)
        (folder / SUMMARY).write_text(text, "utf-8")

    typer.echo(text if as_json else report.table2_text(result), nl=not as_json)
    typer.echo(f"{echo(str(output))}: {', '.join(TABLE2_PICTURES)} and the traces", err=True)


def _table2_sensed(output: Path, scalar: str | None, *, as_json: bool) -> None:
    settings = {name: generating.load(name, scalar) for name in sensed.PRESETS}
    with new_results(output, "table2 --sensors", (SENSED_TABLE,)) as folder:
        with progress_bar("flying Table II with sensors") as progress:
            rows = fly_sensed(settings, progress)
        table = sensed.text(rows)
        (folder / SENSED_TABLE).write_text(table + "\n", "utf-8")
        text = summary_text("table2 --sensors", {"scalar": scalar, "rows": [asdict(row) for row in rows]})
        (folder / SUMMARY).write_text(text, "utf-8")
    typer.echo(text if as_json else table, nl=not as_json)
    typer.echo(f"{echo(str(output))}: {SENSED_TABLE}", err=True)


def _draw(flights: Mapping[str, Trace], stem: Path) -> None:
    """Draw, and only then load the plotting library: generating C does without it."""
    from mambo_nmpc.sil.show.plots import draw_flights  # noqa: PLC0415 - loaded when drawing

    draw_flights(flights, stem)


def _controller(kind: ControllerKind, settings: Settings) -> PositionController:
    match kind:
        case ControllerKind.PD:
            return PdController()
        case ControllerKind.REFERENCE:
            return ReferenceController(Design(settings))
        case ControllerKind.NMPC:
            return CompiledController(settings)


def _on_board(kind: ControllerKind, settings: Settings, board: str) -> EmulatedController:
    """Build the C for a board and put it on the board's emulated core."""
    if kind is not ControllerKind.NMPC:
        raise FlightError(f"--on {echo(board)} runs the C: it goes with --controller nmpc alone")
    chosen = boards.load(board)
    core = chosen.emulated_core.value
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as work:
        return EmulatedController(settings, build_guest(settings, builder(chosen), Path(work)), core)


def _trajectory(name: str, size_m: float, rate_rad_s: float) -> Trajectory:
    _within("--size-m", size_m, -1000.0, 1000.0)
    _within("--rate-rad-s", rate_rad_s, -100.0, 100.0)
    if name in CURVES:
        return CURVES[name](size_m, rate_rad_s)
    if not name.lower().endswith(".csv"):
        raise TrajectoryError(
            f"--trajectory {echo(name)} must be {', '.join(CURVES)} or a file ending in .csv"
        )
    return Waypoints.read(Path(name))


def _check_ranges(flight: Flight, settings: Settings, trajectory: str) -> None:
    """Raise FlightError if the controller would refuse a target, compared in its own scalar type."""
    design, ranges = Design(settings), settings.ranges
    numbers, limits = design.numbers, design.limits
    given = np.abs(flight.targets()[:, :1]).max(axis=0)
    x, y, vx, vy = numbers.quantize(given, TARGET)[0]
    for what, refused, largest, unit, key, limit in (
        ("position", max(x, y) > limits.position, given[0, :2].max(), "m", "position_m", ranges.position_m),
        (
            "speed",
            max(vx, vy) > limits.velocity,
            given[0, 2:].max(),
            "m/s",
            "velocity_m_s",
            ranges.velocity_m_s,
        ),
    ):
        if refused:
            raise FlightError(
                f"--trajectory {echo(trajectory)}: the target's {what} along an axis, up to {largest:g} "
                f"{unit}, exceeds ranges.{key} = {limit:g}; the controller would refuse it"
            )


def _wind(text: str) -> tuple[float, float]:
    try:
        x, y = (float(word) for word in text.split(","))
    except ValueError:
        raise FlightError(f"--wind {echo(text)} must be two numbers, as in 0.5,0, or {GUSTS}") from None
    _within("--wind", x, -100.0, 100.0)
    _within("--wind", y, -100.0, 100.0)
    return x, y


def _within(option: str, value: float, low: float, high: float) -> None:
    """Raise FlightError unless the value of an option is a number from `low` to `high`."""
    if not math.isfinite(value):
        raise FlightError(f"{option} = {value} must be a finite number; it must lie in {low:g}..{high:g}")
    if not low <= value <= high:
        raise FlightError(f"{option} = {value} must lie in {low:g}..{high:g}")


def _digest(file: str) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()
