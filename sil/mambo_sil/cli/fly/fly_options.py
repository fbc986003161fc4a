"""The options of `fly`, in records: functions take those they need."""

import inspect
from collections.abc import Callable, Container
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from mambo_codegen import extensions
from mambo_codegen.errors import echo
from mambo_sil.cli.options import (
    AsJson,
    Baud,
    Drone,
    PortName,
    Results,
    Scalar,
    complete_boards,
    complete_presets,
    sensors_option,
)
from mambo_sil.errors import FlightError
from mambo_sil.flight.names import (
    CONTROLLER_NAMES,
    CURVE_FORMS,
    SENSORS_NAMES,
    AltitudeName,
    SensorsName,
    Start,
)

SIZE_M: Final = 2.0
RATE_RAD_S: Final = 0.5
"""Of the Table II case."""
CurveChoice = Annotated[
    str,
    typer.Option(
        help=f"{CURVE_FORMS}.",
        metavar="CURVE",
    ),
]
CurveSize = Annotated[
    float | None,
    typer.Option(
        help=f"Half-width, radius, step or height of the curve, in m; by default {SIZE_M:g}.", metavar="M"
    ),
]
CurveRate = Annotated[
    float | None,
    typer.Option(help=f"Rate of the curve, in rad/s; by default {RATE_RAD_S:g}.", metavar="RATE"),
]
DURATION_S: Final = 100.0
CurveTime = Annotated[
    float | None,
    typer.Option(
        help=f"Time on the curve, in s; by default {DURATION_S:g}, of a plan its own or two laps.",
        metavar="S",
    ),
]


def _known_controller(value: str) -> str:
    """Return the name of a controller, or of a law's file and class; refuses others."""
    if value in CONTROLLER_NAMES or ".py:" in value:
        return value
    raise typer.BadParameter(f"{echo(value)} is none of {', '.join(CONTROLLER_NAMES)}, FILE.py:CLASS")


def _known_app(value: str | None) -> str | None:
    """Return the name of an app that an extension flies; refuses others."""
    known = extensions.names("apps")
    if value is None or value in known:
        return value
    others = f"is none of {', '.join(known)}" if known else "is not there, since no extension flies an app"
    raise typer.BadParameter(f"{echo(value)} {others}")


@dataclass(frozen=True)
class Course:
    """What is to be followed, from where, and for how long."""

    trajectory: CurveChoice = "bernoulli"
    size_m: CurveSize = None
    rate_rad_s: CurveRate = None
    duration_s: CurveTime = None
    start: Annotated[
        Start,
        typer.Option(help="hover, or take-off: 5 s earlier on the ground.", metavar="START"),
    ] = "hover"
    yaw_rad: Annotated[float, typer.Option(help="Constant yaw, in rad.", metavar="RAD")] = 0.0


@dataclass(frozen=True)
class Conditions:
    """The drone, its sensors, and what disturbs it."""

    vehicle: Drone = None
    motor_lag_s: Annotated[
        float | None,
        typer.Option(help="Time constant of the motors, in s; by default the vehicle's.", metavar="S"),
    ] = None
    sensors: Annotated[
        SensorsName,
        sensors_option(
            SENSORS_NAMES,
            "What measures the state",
        ),
    ] = "true"
    altitude_loop: Annotated[
        AltitudeName,
        typer.Option(
            help="What holds the height: stock, the vehicle's loop; feedforward or pid, which know the "
            "target's motion.",
            metavar="NAME",
        ),
    ] = "stock"
    push: Annotated[
        str,
        typer.Option(help="Push north, east, in m/s^2.", metavar="X,Y"),
    ] = "0,0"
    wind: Annotated[
        str,
        typer.Option(help="Mean wind 6 m high in m/s, with its gusts; gusts: 7.7.", metavar="WIND"),
    ] = "none"
    wind_direction_rad: Annotated[
        float,
        typer.Option(help="Where it blows; 1.57 is east.", metavar="RAD"),
    ] = 0.0
    seed: Annotated[int, typer.Option(help="Seed of gusts and noise.", metavar="N")] = 0


@dataclass(frozen=True)
class Runner:
    """The controller, and where it runs."""

    source: Annotated[
        str | None,
        typer.Argument(
            help="A preset or a controller.toml; by default mambo.", autocompletion=complete_presets
        ),
    ] = None
    controller: Annotated[
        str,
        typer.Option(
            help="nmpc, the generated C; reference, it in Python; pd, the paper's; pd-feedforward or "
            "pid-feedforward, with the target's motion; FILE.py:CLASS, your own.",
            metavar="NAME",
            callback=_known_controller,
            autocompletion=lambda: CONTROLLER_NAMES,
        ),
    ] = "nmpc"
    scalar: Scalar = None
    on: Annotated[
        str | None,
        typer.Option(
            help="Board on whose emulated core the C runs, with this machine's bits.",
            metavar="BOARD",
            autocompletion=complete_boards,
        ),
    ] = None
    port: PortName = None
    baud: Baud = None
    real_time: Annotated[
        bool,
        typer.Option(
            "--real-time",
            help="With --port: the board's own clock calls the step; count late inputs, lost replies and "
            "missed periods.",
        ),
    ] = False


@dataclass(frozen=True)
class Output:
    """What is written and printed."""

    output: Results = Path("flight")
    no_pictures: Annotated[
        bool,
        typer.Option("--no-pictures", help="Draw nothing, which is quicker."),
    ] = False
    as_json: AsJson = False


@dataclass(frozen=True)
class OtherFlight:
    """A recorded flight again, or an app's on the desk; `context` knows which options were given."""

    context: typer.Context
    repeat: Annotated[
        Path | None,
        typer.Option(help="Repeat a recorded flight; also write the optimizer's iterations.", metavar="FILE"),
    ] = None
    app: Annotated[
        str | None,
        typer.Option(
            help="crazyflie: fly the app that --for writes, unchanged, with estimator, loops and mixer as in "
            "its firmware.",
            metavar="TARGET",
            callback=_known_app,
            autocompletion=lambda: extensions.names("apps"),
        ),
    ] = None
    events: Annotated[
        str | None,
        typer.Option(help="With --app: what happens, a shipped events file or your own.", metavar="NAME"),
    ] = None

    def refuse(self, allowed: Container[str], reason: str) -> None:
        """Raise FlightError for an option that was given and is not among the allowed ones."""
        for name in self.context.params:
            given = self.context.get_parameter_source(name)
            if name not in allowed and given is not None and given.name == "COMMANDLINE":
                option = "the settings" if name == "source" else f"--{name.replace('_', '-')}"
                raise FlightError(f"{reason}: leave out {option}")


def command_of(run: Callable[..., None], *records: type[Any]) -> Callable[..., None]:
    """Return a command that calls `run` with dataclasses; its parameters are the fields of `records`."""
    parameters = [one for record in records for one in inspect.signature(record).parameters.values()]

    def command(**given: Any) -> None:
        run(*(record(**{field.name: given[field.name] for field in fields(record)}) for record in records))

    keywords = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in parameters]
    command.__signature__ = inspect.Signature(keywords)  # type: ignore[attr-defined] # where typer reads them
    command.__doc__ = run.__doc__
    return command
