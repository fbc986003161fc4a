"""What commands share: options, loading what they name, and printing of results."""

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from mambo_codegen.atomic import put
from mambo_codegen.errors import FileExistsRefusedError, InvalidSettingsError, UnwritableError, echo
from mambo_codegen.plain_file import find_obstacle
from mambo_codegen.settings.toml_file import BOARDS, PRESETS
from mambo_sil.drone.vehicles import VEHICLES
from mambo_sil.flight.names import SENSORS_NAMES, SensorsName
from mambo_sil.results.terminal import result_text

if TYPE_CHECKING:
    from mambo_codegen.boards import Board
    from mambo_codegen.settings.model import Settings
    from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
    from mambo_sil.results.summary import ReportedSummary, Summary


BOARD_NAMES: Final = BOARDS.names()
VEHICLE_NAMES: Final = VEHICLES.names()


def _completing(names: Sequence[str]) -> Callable[[str], list[str]]:
    """Return what completes one of `names` for the shell, which completes files itself."""

    def complete(incomplete: str) -> list[str]:
        return [name for name in names if name.startswith(incomplete)]

    return complete


complete_presets, complete_boards, complete_vehicles = map(
    _completing, (PRESETS.names(), BOARD_NAMES, VEHICLE_NAMES)
)

Source = Annotated[
    str, typer.Argument(help="A preset or a controller.toml.", autocompletion=complete_presets)
]
OptionalSource = Annotated[
    str | None,
    typer.Argument(
        help="A preset or a controller.toml; by default mambo, with --for the preset of the target.",
        autocompletion=complete_presets,
    ),
]
Scalar = Annotated[
    str | None, typer.Option(help="Scalar type of the C: float32, float64 or fixed.", metavar="TYPE")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


def output_option(about: str) -> Any:
    """Return the option -o, a path; `about` is its help."""
    return typer.Option("--output", "-o", help=about, metavar="PATH")


OutputFile = Annotated[Path, output_option("File to write, - for stdout.")]
Overwrite = Annotated[bool, typer.Option("--force", help="Overwrite the file.")]

_OUTPUT: Final = output_option("Folder for the results; overwrites earlier ones.")
Results = Annotated[Path, _OUTPUT]
OptionalResults = Annotated[Path | None, _OUTPUT]
Workers = Annotated[
    int | None,
    typer.Option(
        help="Processes on this machine; by default one for each processor.", metavar="N", min=1, max=1024
    ),
]


def sensors_option(names: Sequence[str], about: str) -> Any:
    """Return the option that chooses sensors by name; its help is `about`, and the names."""

    def read(text: str) -> str:
        if text not in names:
            raise typer.BadParameter(f"{text!r} is not one of {', '.join(map(repr, names))}.")
        return text

    about = f"{about}: {', '.join(names)}."
    return typer.Option(help=about, parser=read, metavar="NAME", autocompletion=_completing(names))


OptionalSensors = Annotated[
    SensorsName | None,
    sensors_option(SENSORS_NAMES, "What measures, in place of the sensors of file or drone"),
]


Boards = Annotated[
    list[str] | None,
    typer.Option(
        "--board",
        help=f"{', '.join(BOARD_NAMES)}, or a board's TOML file; again for another; by default all.",
        metavar="NAME",
        autocompletion=complete_boards,
    ),
]
Drone = Annotated[
    str | None,
    typer.Option(
        "--vehicle",
        help=f"The drone: {', '.join(VEHICLE_NAMES)}, or a vehicle.toml; "
        "by default that of the file, or mambo.",
        metavar="NAME",
        autocompletion=complete_vehicles,
    ),
]
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


def write_file(text: str, output: Path, *, force: bool) -> bool:
    """Write `text` to a file, whole or not at all, or print it for `-`; return whether it is a file.

    Raises FileExistsRefusedError unless `force`, UnwritableError.
    """
    require_free(output, force=force)
    if str(output) == "-":
        typer.echo(text, nl=False)
        return False
    try:
        put(Path(os.path.realpath(output)), text.encode())
    except OSError as error:
        raise UnwritableError(f"{echo(str(output))}: cannot be written: {error.strerror}") from error
    return True


def require_free(output: Path, *, force: bool) -> None:
    """Raise what `write_file` would for what is there already; called before long work."""
    if str(output) == "-":
        return
    name = echo(str(output))
    if obstacle := find_obstacle(output):
        raise UnwritableError(f"{name}: is {obstacle}, not a file; name one, or print to stdout with -o -")
    if os.path.lexists(output) and not force:
        raise FileExistsRefusedError(
            f"{name}: already exists; name another with -o, or overwrite it with --force"
        )


def load(source: str, scalar: str | None) -> "Settings":
    """Load a preset or a controller.toml; replace its scalar type unless `scalar` is None."""
    from mambo_codegen.settings import controller_toml, presets

    settings = presets.load(source)
    if scalar is None:
        return settings
    return controller_toml.with_option(settings, "code.scalar", scalar, "--scalar")


def load_drone(vehicle: str | None, *sources: str) -> "VehicleFile":
    """Load the drone of --vehicle, else that which the settings of `sources` are for, else the Mambo.

    Say so if a preset has the name of another drone.
    Raises InvalidSettingsError for settings of several drones, and what `vehicle_toml` raises.
    """
    from mambo_sil.drone.vehicles import vehicle_toml

    if vehicle is not None:
        return vehicle_toml.load(vehicle)
    named = list(dict.fromkeys(filter(None, map(vehicle_toml.of_settings, sources))))
    if len(named) > 1:
        several = " and ".join(map(echo, named))
        raise InvalidSettingsError((f"the settings are for {several}; choose one with --vehicle",))
    if not named:
        for source in sorted({*sources} & {*vehicle_toml.names()} - {vehicle_toml.DEFAULT}):
            typer.echo(
                f"the drone is vehicle {vehicle_toml.DEFAULT}, the default; for that of the preset add "
                f"--vehicle {source}",
                err=True,
            )
    return vehicle_toml.load(named[0] if named else vehicle_toml.DEFAULT)


def load_boards(names: Sequence[str] | None) -> "Sequence[Board]":
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
    show(summary, result_text(summary.result(folder or Path())), as_json=as_json)
    if folder is not None and files:
        typer.echo(f"{echo(str(folder))}: {', '.join(files)}", err=True)


@contextlib.contextmanager
def continued_later(folder: Path, finished: Callable[[], int], total: int, things: str) -> Iterator[None]:
    """If the block is interrupted, say how many of `total` things are finished."""
    try:
        yield
    except KeyboardInterrupt:
        with contextlib.suppress(OSError):
            typer.echo(
                f"{echo(str(folder))}: stopped with {finished()} of {total} {things} finished; "
                "the same command continues from there",
                err=True,
            )
        raise
