"""`fly --app`: fly a generated app on the desk, with what surrounds it in its firmware."""

from typing import Any, Final, get_args

import numpy as np
import typer
from pydantic import ValidationError

from mambo_codegen.errors import echo
from mambo_codegen.toolchain import host_toolchain
from mambo_extensions.crazyflie.desk import desk_library, events_file
from mambo_extensions.crazyflie.desk.desk_events import broken, fly_events, measure, passed
from mambo_extensions.crazyflie.desk.desk_report import DESK_FILES, DeskSummary, draw_flight, write_trace
from mambo_extensions.crazyflie.desk.events_file import EventsFile, SensorsSection
from mambo_sil.cli.fly.fly_options import RATE_RAD_S, SIZE_M, Conditions, Course, OtherFlight, Output, Runner
from mambo_sil.cli.fly.one_flight import duration_of
from mambo_sil.cli.options import load, show_result
from mambo_sil.errors import FlightError
from mambo_sil.flight.names import CURVE_FORMS, CurveName
from mambo_sil.flight.own_curve import check_curve, is_curve_file, load_curve
from mambo_sil.flight.trajectories import known_of, vertical_of
from mambo_sil.results.folders import new_results

OF_AN_APP: Final = frozenset(
    {"app", "events", "source", "scalar", "sensors", "seed", "output", "no_pictures", "as_json"}
)
"""Options allowed with --app and an events file, which says all else."""
OF_A_COURSE: Final = frozenset({"trajectory", "size_m", "rate_rad_s", "duration_s"})
"""Options allowed besides where there is no events file."""


def fly_app(
    course: Course, conditions: Conditions, runner: Runner, output: Output, other: OtherFlight
) -> None:
    """Fly once on the desk, write the results; exit 1 if a bound of the events file is broken.

    Raises FlightError, and the errors of loading settings and events and of building the C.
    """
    name, events = other.app or desk_library.TARGET, other.events
    other.refuse(
        OF_AN_APP if events is not None else OF_AN_APP | OF_A_COURSE,
        "what a flight with --app is, an events file says",
    )
    source = runner.source or name
    settings = load(source, runner.scalar)
    file = _course(course) if events is None else events_file.load(events)
    given = other.context.get_parameter_source("sensors")
    if given is not None and given.name == "COMMANDLINE":
        file = _with_sensors(file, conditions.sensors)
    with new_results(output.output, DeskSummary.command, DESK_FILES) as folder:
        library = desk_library.build(settings, host_toolchain())
        trace = fly_events(library, file, conditions.seed)
        measures = measure(trace, file)
        write_trace(trace, folder / "trace.csv")
        if not output.no_pictures:
            draw_flight(folder / "trace.csv", file, events or course.trajectory)
        summary = DeskSummary(
            app=name,
            source=source,
            settings=settings.digest,
            events=events,
            flight=file,
            seed=conditions.seed,
            measures=measures,
            broken=broken(measures, file),
            passed=passed(trace, file),
            console=trace.console,
        )
        summary.write(folder)
    written = DESK_FILES[:1] if output.no_pictures else DESK_FILES
    show_result(summary, output.output, written, as_json=output.as_json)
    if not summary.good:
        raise typer.Exit(1)


def _course(course: Course) -> EventsFile:
    """Return the flight of a curve, without events; raises FlightError, TrajectoryError."""
    names: tuple[CurveName, ...] = get_args(CurveName)
    for name in names:
        if course.trajectory == name:
            return _without_events(
                trajectory=name,
                size_m=SIZE_M if course.size_m is None else course.size_m,
                rate_rad_s=RATE_RAD_S if course.rate_rad_s is None else course.rate_rad_s,
                duration_s=duration_of(course),
            )
    if not is_curve_file(course.trajectory):
        raise FlightError(f"--trajectory {echo(course.trajectory)} must be {CURVE_FORMS}")
    flown, _ = load_curve(course.trajectory)
    check_curve(echo(course.trajectory), flown, duration_of(course))
    height_m = float(vertical_of(flown, np.zeros(1))[0, 0])
    if not events_file.LEAST_HEIGHT_M <= height_m <= events_file.MOST_HEIGHT_M:
        raise FlightError(
            f"--trajectory {echo(course.trajectory)}: its height at 0 s, {height_m:g} m, must lie in "
            f"{events_file.LEAST_HEIGHT_M:g}..{events_file.MOST_HEIGHT_M:g} m with --app"
        )
    return _without_events(
        trajectory=course.trajectory,
        height_m=height_m,
        duration_s=duration_of(course),
        set_points={"acceleration": bool(known_of(flown))},
    )


def _without_events(**keys: Any) -> EventsFile:
    """Return a flight without events; raises FlightError, which names the option."""
    try:
        return EventsFile(**keys)
    except ValidationError as error:
        fault = error.errors()[0]
        option = str(fault["loc"][0]).replace("_", "-")
        rule = fault["msg"].replace("Input should", "must")
        raise FlightError(f"--{option} = {fault['input']} {rule} with --app") from None


def _with_sensors(file: EventsFile, name: str) -> EventsFile:
    """Return an events file with other sensors; raises FlightError."""
    if name not in events_file.SENSORS:
        *others, last = events_file.SENSORS
        raise FlightError(f"--sensors {echo(name)} must be {', '.join(others)} or {last} with --app")
    sensors = SensorsSection.model_validate(file.sensors.model_dump() | {"kind": name})
    return file.model_copy(update={"sensors": sensors})
