"""What commands share: option types, a command from a record of options, and printing of results."""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeVar

import typer

from mambo_codegen.settings.toml_file import BOARDS
from mambo_sil.cli.command import AsJson, Scalar, Source, load, output_option
from mambo_sil.drone.vehicles import VEHICLES
from mambo_sil.flight.names import CURVE_NAMES, ControllerName, SensorsName, Start

if TYPE_CHECKING:
    from mambo_codegen.boards import Board
    from mambo_sil.results.summary import Summary

__all__ = ["AsJson", "Scalar", "Source", "load", "output_option"]

_OUTPUT: Final = output_option("Folder for the results; earlier results there are overwritten.")
Results = Annotated[Path, _OUTPUT]
OptionalResults = Annotated[Path | None, _OUTPUT]
Workers = Annotated[
    int | None,
    typer.Option(help="Processes on this machine; by default one for each processor.", min=1, max=1024),
]

BOARD_NAMES: Final = BOARDS.names()
VEHICLE_NAMES: Final = VEHICLES.names()


def complete_boards(incomplete: str) -> list[str]:
    """Return the boards that begin with `incomplete`, for the shell."""
    return [name for name in BOARD_NAMES if name.startswith(incomplete)]


def complete_vehicles(incomplete: str) -> list[str]:
    """Return the shipped vehicles that begin with `incomplete`, for the shell."""
    return [name for name in VEHICLE_NAMES if name.startswith(incomplete)]


def _vehicle_option(about: str) -> Any:
    """Return the option --vehicle; `about` ends its help."""
    return typer.Option(
        "--vehicle",
        help=f"The drone: {', '.join(VEHICLE_NAMES)}, or a vehicle.toml{about}.",
        metavar="NAME|FILE",
        autocompletion=complete_vehicles,
    )


Drone = Annotated[str, _vehicle_option("")]
OtherDrone = Annotated[str | None, _vehicle_option("; by default that of the file, or mambo")]

PortName = Annotated[
    str | None,
    typer.Option(
        "--port",
        help="Serial port of a board with the firmware of `generate --for pil`; the C on it must have the "
        "bits of that on this machine.",
        metavar="DEVICE|socket://HOST:PORT",
    ),
]
Baud = Annotated[int, typer.Option(help="Rate of the serial port.", min=1)]
BAUD: Final = 500000
"""The rate of the shipped boards."""

Options = TypeVar("Options")


@dataclass(frozen=True)
class FlyOptions:
    """The parameters of `fly`; `context` tells which of them the user gave."""

    context: typer.Context
    source: Source = "mambo"
    output: Results = Path("flight")
    vehicle: Drone = "mambo"
    controller: Annotated[
        ControllerName,
        typer.Option(
            help="The generated C (nmpc), the paper's PD, a PD with feed-forward of the target's velocity "
            "and acceleration, a PID with more of it and a low-pass, or the reference in Python."
        ),
    ] = "nmpc"
    trajectory: Annotated[
        str,
        typer.Option(help=f"{', '.join(CURVE_NAMES)}, or a CSV file with the columns time_s, x_m, y_m."),
    ] = "bernoulli"
    size_m: Annotated[float, typer.Option(help="Half-width, radius or step of the curve, in m.")] = 2.0
    rate_rad_s: Annotated[float, typer.Option(help="Angular rate of the curve, in rad/s.")] = 0.5
    yaw_rad: Annotated[float, typer.Option(help="Constant yaw, in rad.")] = 0.0
    push: Annotated[
        str,
        typer.Option(help="Steady acceleration along x (north), y (east), in m/s^2.", metavar="X,Y"),
    ] = "0,0"
    wind: Annotated[
        str,
        typer.Option(help="`gusts`: a mean wind towards north with light turbulence.", metavar="none|gusts"),
    ] = "none"
    sensors: Annotated[
        SensorsName,
        typer.Option(
            help="State that controller and inner loops get: the true one, or that of the vehicle's sensors, "
            "which are the Mambo's, without or with compensation of the rotation in the optical flow, or "
            "motion capture."
        ),
    ] = "none"
    seed: Annotated[int, typer.Option(help="Seed of gusts and sensor noise, 0 or more.")] = 0
    motor_lag_s: Annotated[
        float | None, typer.Option(help="Time constant of the motors, in s; by default the vehicle's.")
    ] = None
    start: Annotated[Start, typer.Option(help="Start hovering in the air, or 5 s earlier on the ground.")] = (
        "hover"
    )
    duration_s: Annotated[float, typer.Option(help="Time on the trajectory, in s.")] = 100.0
    scalar: Scalar = None
    on: Annotated[
        str | None,
        typer.Option(
            help="Board on whose emulated core the C runs; a flight on this machine must have the same bits.",
            autocompletion=complete_boards,
        ),
    ] = None
    port: PortName = None
    baud: Baud = BAUD
    real_time: Annotated[
        bool,
        typer.Option(
            "--real-time",
            help="With --port: the board's own clock calls the step, and the drone flies by it; count late "
            "inputs, lost replies and periods without a step.",
        ),
    ] = False
    repeat: Annotated[
        Path | None,
        typer.Option(
            help="Record of a flight to repeat; also writes the optimizer's iterations.", metavar="FILE"
        ),
    ] = None
    pictures: Annotated[bool, typer.Option(help="Draw the flight, which takes most of the time.")] = True
    as_json: AsJson = False


def command_of(options: type[Options], run: Callable[[Options], None]) -> Callable[..., None]:
    """Return a command that calls `run`; its parameters are the fields of the dataclass `options`."""

    def command(**given: Any) -> None:
        run(options(**given))

    command.__signature__ = inspect.signature(options)  # type: ignore[attr-defined] # where typer reads them
    command.__doc__ = run.__doc__
    return command


def load_boards(name: str) -> "Sequence[Board]":
    """Return the board called `name`, or every board for `all`."""
    from mambo_codegen import boards

    return [boards.load(one) for one in (boards.names() if name == "all" else (name,))]


def show(summary: "Summary", text: str, *, as_json: bool) -> None:
    """Print `summary` as JSON, or `text`."""
    typer.echo(summary.text() if as_json else text, nl=not as_json)
