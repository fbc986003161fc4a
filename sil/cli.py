"""The commands that fly, `fly` and `table2`, joined with those that generate: the whole of `mambo-nmpc`."""

import json
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from codegen import cli as generating
from codegen import presets
from codegen.errors import echo
from codegen.reference import ReferenceController, Status
from codegen.settings import Settings
from sil import report
from sil.baseline import PdController
from sil.compiled import CompiledController
from sil.errors import FlightError, TrajectoryError
from sil.loop import Flight, PositionController, Start
from sil.loop import fly as simulate
from sil.metrics import TRANSIENT_S, measure
from sil.plant.vehicle import Vehicle
from sil.progress import progress_bar
from sil.results import result_folder, write_summary
from sil.table2 import CASES, PD, fly_table2
from sil.traces import Trace, write_csv, write_npz
from sil.trajectories import Bernoulli, Circle, Gerono, Hover, Lissajous, Step, Trajectory, Waypoints


class ControllerKind(Enum):
    """Which position controller flies."""

    NMPC = "nmpc"
    PD = "pd"
    REFERENCE = "reference"


CURVES = ("bernoulli", "gerono", "lissajous", "circle", "hover", "step")


def main() -> None:
    """Run the command line."""
    app = generating.root()
    generating.register(app)
    app.command(
        epilog=generating.examples(
            "mambo-nmpc fly",
            "mambo-nmpc fly controller.toml --trajectory circle --yaw-rad 0.8 -o circle",
            "mambo-nmpc fly --controller pd --wind 0.5,0 -o pd-in-wind",
            "mambo-nmpc fly --trajectory waypoints.csv --start take-off --duration-s 30",
        )
    )(fly)
    app.command(epilog=generating.examples("mambo-nmpc table2 -o table2"))(table2)
    app()


def fly(
    source: Annotated[str, typer.Argument(help="A preset or a controller.toml.")] = "mambo",
    *,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the results.")] = Path("flight"),
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
        str, typer.Option(help="Push of the wind along x (north), y (east), in m/s^2.", metavar="X,Y")
    ] = "0,0",
    motor_lag_s: Annotated[float, typer.Option(min=0, help="Time constant of the motors, in s.")] = 0.0,
    start: Annotated[Start, typer.Option(help="In the air, or 5 s earlier on the ground.")] = Start.HOVER,
    duration_s: Annotated[float, typer.Option(help="Time on the trajectory, in s.")] = 100.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Fly once on the model of the Mambo: trace, metrics and pictures."""
    settings = presets.load(source)
    flight = Flight(
        _trajectory(trajectory, size_m, rate_rad_s),
        duration_s=duration_s,
        start=start,
        yaw_rad=_finite(yaw_rad, "--yaw-rad"),
        vehicle=Vehicle(motor_lag_s=_finite(motor_lag_s, "--motor-lag-s"), wind_m_s2=_wind(wind)),
        update_period_s=settings.horizon.update_period_s,
    )
    flown_by = _controller(controller, settings)
    folder = result_folder(output)
    with progress_bar("flying") as progress:
        trace = simulate(flight, flown_by, progress)

    write_csv(trace, folder / "trace.csv")
    write_npz(trace, folder / "trace.npz")
    title = "PD" if controller is ControllerKind.PD else f"NMPC, {echo(source)}"
    pictures = _draw({title: trace}, folder / "flight")
    statuses = np.bincount(trace.status[:, 0], minlength=len(Status))
    summary: dict[str, Any] = {
        "controller": controller.value,
        "settings": None if controller is ControllerKind.PD else settings.digest,
        "trajectory": trajectory,
        "duration_s": duration_s,
        "lost": bool(trace.diverged[0]),
        "statuses": {status.name: int(statuses[status]) for status in Status if statuses[status]},
        "metrics": report.numbers(measure(trace)),
    }
    if duration_s > TRANSIENT_S:
        summary["metrics_without_transient"] = report.numbers(measure(trace, TRANSIENT_S))
    write_summary(folder, summary)

    typer.echo(json.dumps(summary, indent=2) if as_json else report.flight_text(summary))
    typer.echo(f"{echo(str(output))}: trace.csv, trace.npz, {pictures[0].name}, {pictures[1].name}", err=True)
    if summary["lost"]:
        raise typer.Exit(1)


def table2(
    *,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the results.")] = Path("table2"),
    as_json: Annotated[bool, typer.Option("--json", help="Print rows and verdicts as JSON.")] = False,
) -> None:
    """Fly Table II of the paper with PD and every preset, and judge its claims."""
    folder = result_folder(output)
    with progress_bar("flying Table II") as progress:
        result = fly_table2(progress)

    for name, trace in result.traces.items():
        write_npz(trace, folder / f"{name.lower()}.npz")
    compared = {PD: result.traces[PD], "NMPC, mambo": result.traces["mambo"]}
    pictures = _draw(compared, folder / "figure3")
    summary = {
        "cases": list(CASES),
        "rows": [asdict(row) for row in result.rows],
        "claims": [asdict(claim) for claim in result.claims],
    }
    write_summary(folder, summary)

    typer.echo(json.dumps(summary, indent=2) if as_json else report.table2_text(result))
    typer.echo(f"{echo(str(output))}: {pictures[0].name}, {pictures[1].name} and the traces", err=True)


def _draw(flights: dict[str, Trace], stem: Path) -> tuple[Path, Path]:
    """Draw, and only then load the plotting library: generating C does without it."""
    from sil.plots import draw_flights  # noqa: PLC0415 - loaded when drawing

    return draw_flights(flights, stem)


def _controller(kind: ControllerKind, settings: Settings) -> PositionController:
    match kind:
        case ControllerKind.PD:
            return PdController()
        case ControllerKind.REFERENCE:
            return ReferenceController(settings)
        case ControllerKind.NMPC:
            return CompiledController(settings)


def _trajectory(name: str, size_m: float, rate_rad_s: float) -> Trajectory:
    size_m, rate_rad_s = _finite(size_m, "--size-m"), _finite(rate_rad_s, "--rate-rad-s")
    curves: dict[str, Trajectory] = {
        "bernoulli": Bernoulli(size_m, rate_rad_s),
        "gerono": Gerono(size_m, rate_rad_s),
        "lissajous": Lissajous(size_m, rate_rad_s),
        "circle": Circle(size_m, rate_rad_s),
        "hover": Hover(),
        "step": Step(size_m, 0.0),
    }
    if name in curves:
        return curves[name]
    if not name.endswith(".csv"):
        raise TrajectoryError(
            f"--trajectory {echo(name)} must be {', '.join(curves)} or a file ending in .csv"
        )
    return Waypoints.read(Path(name))


def _wind(text: str) -> tuple[float, float]:
    try:
        x, y = (float(word) for word in text.split(","))
    except ValueError:
        raise FlightError(f"--wind {echo(text)} must be two numbers, as in 0.5,0") from None
    return _finite(x, "--wind"), _finite(y, "--wind")


def _finite(value: float, option: str) -> float:
    if not np.isfinite(value):
        raise FlightError(f"{option} = {value} must be a finite number")
    return value
