"""What commands share: option types, and printing of results."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from mambo_codegen.errors import echo
from mambo_codegen.settings.toml_file import BOARDS
from mambo_sil.cli.command import AsJson, Scalar, Source, load, output_option
from mambo_sil.drone.vehicles import VEHICLES
from mambo_sil.flight.names import present_sensors

if TYPE_CHECKING:
    from mambo_codegen.boards import Board
    from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
    from mambo_sil.results.summary import ReportedSummary, Summary

__all__ = ["AsJson", "Scalar", "Source", "load", "output_option"]

_OUTPUT: Final = output_option("Folder for the results; overwrites earlier ones.")
Results = Annotated[Path, _OUTPUT]
OptionalResults = Annotated[Path | None, _OUTPUT]
Workers = Annotated[
    int | None,
    typer.Option(help="Processes on this machine; by default one for each processor.", min=1, max=1024),
]

BOARD_NAMES: Final = BOARDS.names()
VEHICLE_NAMES: Final = VEHICLES.names()


def sensors_option(names: Sequence[str], about: str) -> Any:
    """Return the option that chooses sensors by name, of which older ones are read."""

    def read(text: str) -> str:
        name = present_sensors(text)
        if name not in names:
            raise typer.BadParameter(f"{text!r} is not one of {', '.join(map(repr, names))}.")
        return str(name)

    def complete(incomplete: str) -> list[str]:
        return [name for name in names if name.startswith(incomplete)]

    return typer.Option(help=about, parser=read, metavar="NAME", autocompletion=complete)


def complete_boards(incomplete: str) -> list[str]:
    """Return the boards that begin with `incomplete`, for the shell."""
    return [name for name in BOARD_NAMES if name.startswith(incomplete)]


def complete_vehicles(incomplete: str) -> list[str]:
    """Return the shipped vehicles that begin with `incomplete`, for the shell."""
    return [name for name in VEHICLE_NAMES if name.startswith(incomplete)]


Boards = Annotated[
    list[str] | None,
    typer.Option(
        "--board",
        help=f"{', '.join(BOARD_NAMES)}, or a board's TOML file; again for another; by default all.",
        metavar="NAME",
        autocompletion=complete_boards,
    ),
]


def _vehicle_option(about: str) -> Any:
    """Return the option --vehicle; `about` ends its help."""
    return typer.Option(
        "--vehicle",
        help=f"The drone: {', '.join(VEHICLE_NAMES)}, or a vehicle.toml{about}.",
        metavar="NAME",
        autocompletion=complete_vehicles,
    )


Drone = Annotated[str | None, _vehicle_option("; by default that of the file, or mambo")]

PortName = Annotated[
    str | None,
    typer.Option(
        "--port",
        help="Serial port of a board with the firmware of `generate --for pil`, or socket://HOST:PORT; its C "
        "must have this machine's bits.",
        metavar="DEVICE",
    ),
]
BAUD: Final = 500000
"""The rate of the shipped boards."""
Baud = Annotated[
    int | None,
    typer.Option(help=f"Rate of the serial port; by default {BAUD}.", min=1, metavar="N"),
]


def load_drone(vehicle: str | None, *sources: str) -> "VehicleFile":
    """Load the drone of --vehicle, else that which the settings of `sources` are for, else the Mambo.

    Raises InvalidSettingsError for settings of several drones, and what `vehicle_toml` raises.
    """
    from mambo_codegen.errors import InvalidSettingsError, echo
    from mambo_sil.drone.vehicles import vehicle_toml

    if vehicle is not None:
        return vehicle_toml.load(vehicle)
    named = list(dict.fromkeys(filter(None, map(vehicle_toml.of_settings, sources))))
    if len(named) > 1:
        several = " and ".join(map(echo, named))
        raise InvalidSettingsError((f"the settings are for {several}; choose one with --vehicle",))
    return vehicle_toml.load(named[0] if named else vehicle_toml.DEFAULT)


def load_boards(names: "Sequence[str] | None") -> "Sequence[Board]":
    """Return the boards called `names`, each once, or every board for None."""
    from mambo_codegen import boards

    return [boards.load(name) for name in dict.fromkeys(names or boards.names())]


def demand_port(port: str | None, baud: int | None) -> None:
    """Raise BadParameter for a rate without a port."""
    if port is None and baud is not None:
        raise typer.BadParameter("it needs --port: name one, or leave it out", param_hint="--baud")


def show(summary: "Summary", text: str, *, as_json: bool) -> None:
    """Print `summary` as JSON, or `text`."""
    typer.echo(summary.text() if as_json else text, nl=not as_json)


def show_result(
    summary: "ReportedSummary", folder: Path | None, files: Sequence[str] = (), *, as_json: bool
) -> None:
    """Print `summary` as JSON, or its result as text, and the `files` written into `folder`, if any."""
    from mambo_sil.results.terminal import result_text

    show(summary, result_text(summary.result(folder or Path())), as_json=as_json)
    if folder is not None and files:
        typer.echo(f"{echo(str(folder))}: {', '.join(files)}", err=True)
