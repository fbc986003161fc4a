"""The options of `fly`, in records: functions take those they need."""

import inspect
from collections.abc import Callable, Container
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import typer

from mambo_sil.cli.command import AsJson, Scalar, complete_presets
from mambo_sil.cli.options import Baud, Drone, PortName, Results, complete_boards
from mambo_sil.errors import FlightError
from mambo_sil.flight.names import CURVE_NAMES, AltitudeName, ControllerName, SensorsName, Start

SIZE_M: Final = 2.0
RATE_RAD_S: Final = 0.5
"""Of the Table II case."""
CURVE_HELP: Final = f"{', '.join(CURVE_NAMES)}, or a CSV file with the columns time_s, x_m, y_m."
SIZE_HELP: Final = f"Half-width, radius, step or height of the curve, in m; by default {SIZE_M:g}."
RATE_HELP: Final = f"Angular rate of the curve, in rad/s; by default {RATE_RAD_S:g}."


@dataclass(frozen=True)
class Course:
    """What is to be followed, from where, and for how long."""

    trajectory: Annotated[str, typer.Option(help=CURVE_HELP)] = "bernoulli"
    size_m: Annotated[float | None, typer.Option(help=SIZE_HELP)] = None
    rate_rad_s: Annotated[float | None, typer.Option(help=RATE_HELP)] = None
    duration_s: Annotated[float, typer.Option(help="Time on the trajectory, in s.")] = 100.0
    start: Annotated[Start, typer.Option(help="Start hovering in the air, or 5 s earlier on the ground.")] = (
        "hover"
    )
    yaw_rad: Annotated[float, typer.Option(help="Constant yaw, in rad.")] = 0.0


@dataclass(frozen=True)
class Conditions:
    """The drone, its sensors, and what disturbs it."""

    vehicle: Drone = "mambo"
    motor_lag_s: Annotated[
        float | None, typer.Option(help="Time constant of the motors, in s; by default the vehicle's.")
    ] = None
    sensors: Annotated[
        SensorsName,
        typer.Option(
            help="State that controller and inner loops get: the true one, or that of the vehicle's sensors, "
            "which are the Mambo's, without or with compensation of the rotation in the optical flow, or "
            "motion capture; with --app motion capture or a flow deck."
        ),
    ] = "none"
    altitude_loop: Annotated[
        AltitudeName,
        typer.Option(
            help="What holds the height: the vehicle's loop, that with feed-forward of the target's motion, "
            "or a PID with it."
        ),
    ] = "stock"
    push: Annotated[
        str,
        typer.Option(help="Steady acceleration along x (north), y (east), in m/s^2.", metavar="X,Y"),
    ] = "0,0"
    wind: Annotated[
        str,
        typer.Option(help="`gusts`: a mean wind towards north with light turbulence.", metavar="none|gusts"),
    ] = "none"
    seed: Annotated[int, typer.Option(help="Seed of gusts and sensor noise, 0 or more.")] = 0


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
        ControllerName,
        typer.Option(
            help="The generated C (nmpc), the paper's PD, a PD with feed-forward of the target's velocity "
            "and acceleration, a PID with more of it and a low-pass, or the reference in Python."
        ),
    ] = "nmpc"
    scalar: Scalar = None
    on: Annotated[
        str | None,
        typer.Option(
            help="Board on whose emulated core the C runs; its flight must equal this machine's bit for bit.",
            autocompletion=complete_boards,
        ),
    ] = None
    port: PortName = None
    baud: Baud = None
    real_time: Annotated[
        bool,
        typer.Option(
            "--real-time",
            help="With --port: the board's own clock calls the step, and the drone flies by it; count late "
            "inputs, lost replies and periods without a step.",
        ),
    ] = False


@dataclass(frozen=True)
class Output:
    """What is written and printed."""

    output: Results = Path("flight")
    pictures: Annotated[bool, typer.Option(help="Draw the flight, which takes most of the time.")] = True
    as_json: AsJson = False


@dataclass(frozen=True)
class OtherFlight:
    """A recorded flight again, or that of an app on the desk; `context` knows which options were given."""

    context: typer.Context
    repeat: Annotated[
        Path | None,
        typer.Option(
            help="Record of a flight to repeat; also writes the optimizer's iterations.", metavar="FILE"
        ),
    ] = None
    app: Annotated[
        Literal["crazyflie"] | None,
        typer.Option(
            help="Fly the app that --for writes, unchanged, on the desk: with set-points, estimator, loops "
            "and mixer as in its firmware."
        ),
    ] = None
    events: Annotated[
        str | None,
        typer.Option(
            help="With --app: what happens, a shipped events file or one of your own.", metavar="NAME|FILE"
        ),
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
