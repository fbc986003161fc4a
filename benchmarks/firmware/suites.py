"""All flights: who flies what, at which offsets of the clocks, and what is measured."""

import functools
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from benchmarks.firmware import events
from benchmarks.firmware.contenders import FirmwareController, app_settings, clocks, contenders
from benchmarks.firmware.events import Event, Happened
from benchmarks.firmware.flight_log import write_log
from benchmarks.firmware.laboratory import ControllerNumber, LaboratoryConditions
from benchmarks.firmware.one_process import each_in_a_process
from benchmarks.firmware.stream import OFFSETS, Job, Stream, StreamedFlight, fly
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.trajectories import Bernoulli, Circle, Hover, PositionStep
from mambo_sil.model.replay.log_replay import replay_log
from mambo_sil.model.replay.replay_report import summarise

EIGHT: Final = Stream(Bernoulli(2.0, 0.5))
CIRCLE: Final = Stream(Circle(1.0, 1.5))
STANDARD: Final = LaboratoryConditions()

CURVES: Final = {
    "eight": EIGHT,
    "circle": CIRCLE,
    "small circle": Stream(Circle(0.6, 2.2)),
    "fast eight": Stream(Bernoulli(2.0, 0.8)),
    "step": Stream(PositionStep(1.0, 0.0), duration_s=10.0),
}
"""StreamedFlight by every controller."""

SET_POINTS: Final = {
    "every 150 ms": replace(CIRCLE, period_ms=150),
    "every 200 ms": replace(CIRCLE, period_ms=200),
    "every 400 ms": replace(CIRCLE, period_ms=400),
    "every 100 +- 60 ms": replace(CIRCLE, period_ms=100, jitter_ms=60),
    "every 10 ms, 80 % lost": replace(CIRCLE, lost_packets=0.8),
    "every 100 ms, without acceleration": replace(CIRCLE, period_ms=100, acceleration=False),
    "every 200 ms, without acceleration": replace(CIRCLE, period_ms=200, acceleration=False),
}
"""The circle by a slow or lossy radio."""

CONDITIONS: Final = {
    "10 % of the ticks lost": replace(STANDARD, lost_ticks=0.1),
    "camera that measures attitudes": replace(STANDARD, camera_sees_attitude=True),
    "camera at 30 Hz": replace(STANDARD, camera_period_ms=33),
    "20 % heavier": replace(STANDARD, mass_kg=0.036),
    "rotor lag 0.1 s": replace(STANDARD, rotor_lag_s=0.1),
    "wind of 2 m/s": replace(STANDARD, wind_m_s=(2.0, 0.0)),
}
"""The circle under other conditions."""

EVENTS: Final[dict[str, tuple[Event, LaboratoryConditions]]] = {
    **{f"wall {speed}": (events.through_wall(speed), STANDARD) for speed in (1.0, 2.0, 3.0)},
    "fence switched on": (events.fence_switched_on(2.0), STANDARD),
    "far": (events.far_set_point, STANDARD),
    "far, braking 3": (events.far_set_point, STANDARD),
    "camera": (events.lost_camera, STANDARD),
    "radio": (events.lost_radio, STANDARD),
    "aside": (events.set_point_aside, STANDARD),
    "not a number": (events.not_a_number, STANDARD),
    "go to": (events.go_to, STANDARD),
    "turns": (events.turns, STANDARD),
    "heights": (events.heights, replace(STANDARD, mass_kg=0.036)),
}
_ONLY_APP: Final = {"far, braking 3": {"nmpc.braking": 3.0}}
"""Events that only the app flies, with parameters of its own."""

RIVALS: Final = ("mellinger", "lee")
PILOTED: Final = ("mellinger", "lee", "pid")
"""Controllers of the firmware that fly set-points, and those that fly events."""
MEASURES: Final = ("iae_m_s", "largest_m", "past_m", "settled_s", "busy", "height_m")

Figures = dict[str, Any]
Paths = dict[tuple[str, str], FloatArray]
"""Paths of the first offset, by flight and controller."""
Say = Callable[[str], None]


def _is_app(contender: FirmwareController) -> bool:
    return contender.number is ControllerNumber.APP


def fly_streams(
    streams: Mapping[str, tuple[Stream, LaboratoryConditions]],
    flown_by: Iterable[FirmwareController],
    say: Say,
) -> tuple[Figures, Paths]:
    """Return the measures at each offset, by stream and controller, and the paths."""
    figures: Figures = {}
    paths: Paths = {}
    for title, (stream, conditions) in streams.items():
        say(title)
        figures[title] = {}
        for contender in flown_by:
            jobs = [Job(contender.image, contender.number, stream, conditions, offset) for offset in OFFSETS]
            flights: list[StreamedFlight] = each_in_a_process(fly, jobs)
            figures[title][contender.name] = {
                "crashed": sum(flight.crashed for flight in flights),
                **{name: [float(getattr(flight, name)) for flight in flights] for name in MEASURES},
            }
            paths[title, contender.name] = flights[0].path
    return figures, paths


def _happen(title: str, job: Job) -> Happened:
    return EVENTS[title][0](job)


def fly_events(flown_by: Iterable[FirmwareController], say: Say) -> tuple[Figures, Paths]:
    """Return the measures of each event at each offset, by event, controller and measure, and the paths."""
    figures: Figures = {}
    paths: Paths = {}
    for title, (_, conditions) in EVENTS.items():
        say(title)
        figures[title] = {}
        parameters = _ONLY_APP.get(title, {})
        for contender in flown_by:
            if parameters and not _is_app(contender):
                continue
            asked = replace(conditions, parameters=parameters)
            jobs = [
                Job(contender.image, contender.number, Stream(Hover()), asked, offset) for offset in OFFSETS
            ]
            flights = each_in_a_process(functools.partial(_happen, title), jobs)
            names = flights[0].figures
            figures[title][contender.name] = {
                name: [flight.figures[name] for flight in flights] for name in names
            }
            paths[title, contender.name] = flights[0].path
    return figures, paths


def replay_all(apps: Iterable[FirmwareController]) -> Figures:
    """Return by settings how many commands of a log a replay repeats in every bit, and how many there are."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for app in apps:
            path = Path(folder) / f"{app.name}.csv"
            job = Job(app.image, app.number, EIGHT, STANDARD, OFFSETS[4])
            each_in_a_process(functools.partial(write_log, job), [path])
            settings = app_settings()[app.name]
            replayed = summarise(replay_log(path, {}, settings), path.name, app.name, settings.digest)
            found[app.name] = {"equal": replayed.equal_steps, "steps": replayed.steps}
    return found


def fly_everything(firmware: Path, say: Say) -> tuple[Figures, Paths]:
    """Fly all suites; raises as `build`."""
    every = contenders(firmware)
    apps = [one for one in every if _is_app(one)]
    rivals = [*apps, *(one for one in every if one.name in RIVALS)]
    piloted = [*apps, *(one for one in every if one.name in PILOTED)]
    curves, paths = fly_streams({name: (one, STANDARD) for name, one in CURVES.items()}, every, say)
    slow, _ = fly_streams({name: (one, STANDARD) for name, one in SET_POINTS.items()}, rivals, say)
    other, _ = fly_streams({name: (CIRCLE, one) for name, one in CONDITIONS.items()}, rivals, say)
    say("clocks")
    timed, _ = fly_streams(
        {"eight": (EIGHT, STANDARD), "circle": (CIRCLE, STANDARD)}, clocks(firmware), lambda _: None
    )
    met, event_paths = fly_events(piloted, say)
    say("replay")
    figures = {
        "firmware": _commit(firmware),
        "offsets": len(OFFSETS),
        "curves": curves,
        "set_points": slow,
        "conditions": other,
        "clocks": timed,
        "events": met,
        "replay": replay_all(apps),
    }
    return figures, paths | event_paths


def _commit(firmware: Path) -> str:
    ran = subprocess.run(
        ["git", "-C", str(firmware), "describe", "--always", "--dirty", "--exclude=*", "--abbrev=12"],
        capture_output=True,
        text=True,
        check=False,
    )
    return ran.stdout.strip() or "unknown"
