"""The summary of a flight: record and result."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from pydantic import SerializerFunctionWrapHandler, model_serializer

from mambo_codegen.errors import echo
from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.animation import animate
from mambo_sil.flight.crashes import Crash, first_crash
from mambo_sil.flight.fences import measure_limits, nears_limit, walls_m
from mambo_sil.flight.flight_marks import NO_MARKS, FlightMarks
from mambo_sil.flight.metrics import HEIGHT_METRICS, TRANSIENT_S, Metrics, measure
from mambo_sil.flight.names import PD_TITLES, flies_settings
from mambo_sil.flight.own_curve import is_curve_file
from mambo_sil.flight.passing import PassedSummary, missed_words
from mambo_sil.flight.polynomials import Pieces
from mambo_sil.flight.scenario import Scenario
from mambo_sil.flight.traces import SensedTrace, Trace, read_npz
from mambo_sil.flight.trajectories import Trajectory
from mambo_sil.results.blocks import (
    Block,
    CommandResult,
    Facts,
    MovingPicture,
    Picture,
    ResultTable,
    Sentence,
)
from mambo_sil.results.metric_names import AS_ESTIMATED, named
from mambo_sil.results.number_format import digits, distance
from mambo_sil.results.summary import Number, ReportedSummary


class FlightSummary(ReportedSummary):
    """The results of any flight."""

    controller: str
    settings: str | None
    """Digest of the settings; None for a PD, which has none."""
    same_bits_as_host: bool | None
    lost: bool
    crash: Crash | None = None
    mostly_refused: bool
    """Whether more than half of the updates on the trajectory were refused."""
    statuses: dict[str, int]
    refusals: list[str]
    metrics: dict[str, Number]
    metrics_without_transient: dict[str, Number] | None = None
    metrics_as_seen: dict[str, Number] | None = None
    walls_m: tuple[Number, Number, Number, Number, Number, Number] | None = None
    """x_min, y_min, x_max, y_max, if there is a fence; None for no wall."""
    speed_limit_m_s: float | None = None
    """The speed limit, if the flight came near it."""
    passed: list[PassedSummary] | None = None
    """Of the points of a plan those whose time had come."""

    @property
    def columns(self) -> dict[str, dict[str, float]]:
        """The sets of metrics by the heading of their column."""
        columns = {
            "whole flight": self.metrics,
            "after 10 s": self.metrics_without_transient,
            "as estimated": self.metrics_as_seen,
        }
        return {heading: values for heading, values in columns.items() if values is not None}

    @property
    def good(self) -> bool:
        """Whether the drone stayed under control and passed all points, with the bits of the host."""
        controlled = not self.lost and self.crash is None and not self.mostly_refused
        missed = any(one.missed for one in self.passed or ())
        return controlled and not missed and self.same_bits_as_host is not False

    def _result(
        self, folder: Path, name: str, title: str, flown: "FlySummary | Scenario", facts: dict[str, str]
    ) -> CommandResult:
        """Return the result of a flight of the drone `name`; `facts` are for a page."""
        rows = []
        for key in self.metrics:
            words, unit = named(key)
            rows.append((words, *(digits(values.get(key)) for values in self.columns.values()), unit))
        blocks: list[Block] = [
            Facts(facts),
            *flight_pictures(
                folder,
                {name: "trace.npz"},
                "Path, horizontal error, commanded and actual angles.",
                self.marks,
            ),
            ResultTable(("", *self.columns, ""), rows, (0, -1)),
        ]
        if self.metrics_as_seen is not None:
            blocks.append(Sentence(AS_ESTIMATED))
        quiet = ("OK", "NOT_CALLED")
        refused = [f"{count} {name}" for name, count in self.statuses.items() if name not in quiet]
        if refused:
            blocks += map(Sentence, (f"refused inputs: {', '.join(refused)}", *self.refusals))
        subject = f"{self._source} on {echo(flown.vehicle.name)}"
        answer = self.answer(flown.duration_s)
        return CommandResult(title, None if self.good else False, answer, blocks, subject)

    def answer(self, duration_s: float) -> list[str]:
        """Return how close the drone stayed to its target, and what went wrong."""
        mean_m = self.metrics.get("iae_m_s", math.nan) / duration_s
        most_m = self.metrics.get("max_error_m", math.nan)
        return [f"{distance(mean_m)} in the mean, {distance(most_m)} at most", *self._remarks()]

    @property
    def marks(self) -> FlightMarks:
        """What a picture shows besides the flight."""
        crash_s = math.nan if self.crash is None else self.crash.time_s
        return FlightMarks(self.walls_m, self.speed_limit_m_s or 0.0, crash_s)

    @property
    def _source(self) -> str:
        """What flew, in the answer."""
        return self.controller

    def _remarks(self) -> Iterator[str]:
        """Yield what else answers the command: what went wrong, and whether the bits are those expected."""
        if self.crash is not None:
            yield f"CRASHED at {self.crash.time_s:.2f} s: {self.crash.how}"
        if self.lost:
            yield "LOST: the drone diverged before the end of the flight"
        elif self.mostly_refused:
            yield "NOT CONTROLLED: the controller refused more than half of its inputs"
        if self.passed:
            yield missed_words(self.passed)

    @model_serializer(mode="wrap")
    def _without_missing_columns(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        optional = ("metrics_without_transient", "metrics_as_seen", "walls_m", "speed_limit_m_s", "passed")
        return {key: value for key, value in dump(self).items() if value is not None or key not in optional}


class FlySummary(FlightSummary):
    """The results of `fly`; `trajectory_sha256` is the hash of a waypoint file."""

    command = "fly"

    board: str | None
    source: str | None
    vehicle: VehicleFile = NOMINAL
    update_period_s: float
    trajectory: str
    trajectory_sha256: str | None
    size_m: float | None
    """None for a trajectory without a size; so is the rate."""
    rate_rad_s: float | None
    yaw_rad: float
    push_m_s2: tuple[float, float]
    wind_speed_m_s: float
    wind_direction_rad: float = 0.0
    sensors: str
    altitude_loop: str = "stock"
    seed: int
    motor_lag_s: float
    start: str
    duration_s: float

    @property
    def about(self) -> str:
        """Say what flies, and where."""
        return about_flight(self._flier, self)

    @property
    def _flier(self) -> str:
        if flies_settings(self.controller):
            return f"NMPC, {echo(str(self.source))}"
        return PD_TITLES.get(self.controller, echo(self.controller))

    @property
    def _source(self) -> str:
        flies_source = flies_settings(self.controller) and self.source is not None
        return echo(str(self.source) if flies_source else self.controller)

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result of this flight; drawing raises TraceError."""
        facts = {
            **_course(self),
            "controller": _controller(self, f" of {self.source}"),
            "start": f"{self.start}, heading {self.yaw_rad:g} rad",
            "altitude loop": self.altitude_loop,
            "disturbances": "push {:g}, {:g} m/s^2".format(*self.push_m_s2)
            + f"; wind with gusts {self.wind_speed_m_s:g} m/s{self._direction}; "
            f"motor lag {self.motor_lag_s:g} s",
        }
        return self._result(folder, self._flier, f"Flight: {self._flier}, {self.trajectory}", self, facts)

    @property
    def _direction(self) -> str:
        """The heading of the wind, where it is not north."""
        return f" towards {self.wind_direction_rad:g} rad" if self.wind_direction_rad else ""

    def _remarks(self) -> Iterator[str]:
        yield from super()._remarks()
        if self.board is not None:
            same = "equals" if self.same_bits_as_host else "DIFFERS FROM"
            yield f"emulated core of {self.board}: the trace {same} that of this machine, bit for bit"


class RepeatSummary(FlightSummary):
    """The results of repeating a recorded flight."""

    command = "fly --repeat"

    repeat: str
    scenario: Scenario
    same_bits_as_recorded: bool | None

    @property
    def good(self) -> bool:
        """Whether the drone stayed under control, and the flight equals the recorded one in every bit."""
        return super().good and self.same_bits_as_recorded is not False

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result of this flight; drawing raises TraceError."""
        name = PD_TITLES.get(self.controller, "NMPC")
        facts = {
            "record": self.repeat,
            **_course(self.scenario),
            "controller": _controller(self),
            "seed": str(self.scenario.seed),
        }
        return self._result(folder, name, f"Repetition: {name}, {self.repeat}", self.scenario, facts)

    def _remarks(self) -> Iterator[str]:
        yield from super()._remarks()
        if self.same_bits_as_recorded is not None:
            same = "equals" if self.same_bits_as_recorded else "DIFFERS FROM"
            yield f"repetition: the trace {same} the recorded one, bit for bit"


def _controller(summary: FlightSummary, source: str = "") -> str:
    """Return the controller's name, with its settings if it has any: a PD has none."""
    name, settings = summary.controller, summary.settings
    return (
        name if settings is None or not flies_settings(name) else f"{name}, settings {settings[:16]}{source}"
    )


def about_flight(name: str, flown: FlySummary | Scenario) -> str:
    """Return what flies on which drone, curve, state and wind, for a picture."""
    wind = f"wind {flown.wind_speed_m_s:.3g} m/s" if flown.wind_speed_m_s else "no wind"
    course = _course(flown)
    where = f"{echo(course['trajectory'])}, state {course['state']}, {wind}"
    return f"{name} on {echo(flown.vehicle.name)}, one flight: {where}"


def _course(flown: FlySummary | Scenario) -> dict[str, str]:
    own = is_curve_file(flown.trajectory)
    shape = "" if own or flown.size_m is None else f", {flown.size_m:g} m"
    if not own and flown.rate_rad_s is not None:
        shape += f", {flown.rate_rad_s:g} rad/s"
    return {
        "vehicle": flown.vehicle.name,
        "trajectory": f"{Path(flown.trajectory).name}{shape}, {flown.duration_s:g} s",
        "state": "true" if flown.sensors == "true" else f"estimated, sensors {flown.sensors}",
    }


def numbers(metrics: Metrics, flight: int = 0, *, spatial: bool = False) -> dict[str, float]:
    """Return the metrics of the flight with index `flight` by name; of a level course those along it only."""
    names = (field.name for field in fields(metrics) if spatial or field.name not in HEIGHT_METRICS)
    return {name: float(getattr(metrics, name)[flight]) for name in names}


def refusals(trace: Trace, settings: Settings) -> list[str]:
    """Say how often the controller of the first flight refused an input, and which range it exceeded."""
    if isinstance(trace, SensedTrace):
        trace = trace.as_seen()
    status, ranges = trace.status[:, 0], settings.ranges
    sentences = []
    refused = (status == Status.BAD_STATE) & np.isfinite(trace.position_m[:, 0]).all(axis=-1)
    for words, unit, values, key, limit in (
        ("position", "m", trace.position_m[:, 0, :2], "position_m", ranges.position_m),
        ("speed", "m/s", trace.velocity_m_s[:, 0, :2], "velocity_m_s", ranges.velocity_m_s),
    ):
        largest = np.abs(values).max(axis=-1)
        beyond = refused & (largest > limit)
        if beyond.any():
            sentences.append(
                f"{beyond.sum()} steps: the drone's {words}, up to {largest[beyond].max():.4g} {unit}, "
                f"exceeds ranges.{key} = {limit:g}"
            )
    refused = status == Status.BAD_THRUST
    if refused.any():
        thrust = trace.thrust_acceleration_m_s2[refused, 0]
        during = " during lift-off" if (trace.time_s[refused] < 0.0).all() else ""
        sentences.append(
            f"{refused.sum()} steps{during}: thrust out of range, {thrust.min():.4g}..{thrust.max():.4g} "
            f"m/s^2, but ranges.thrust_acceleration_* = {ranges.thrust_acceleration_min_m_s2:g}.."
            f"{ranges.thrust_acceleration_max_m_s2:g}"
        )
    return [f"{sentence}; the drone kept the last command" for sentence in sentences]


def judge(
    trace: Trace,
    settings: Settings,
    drone: VehicleFile,
    limited: Scenario | None = None,
    course: Trajectory | None = None,
) -> dict[str, Any]:
    """Return the fields of a `FlightSummary` that follow from the trace.

    course:  what was flown; the points of a plan are judged.
    limited: has the fence set in flight; None for a controller that is a PD, which has no limits.
    """
    status = trace.status[:, 0]
    seen = trace.as_seen() if isinstance(trace, SensedTrace) else None
    names = {NOT_CALLED: "NOT_CALLED", **{int(each): each.name for each in Status}}
    counts = {name: int((status == value).sum()) for value, name in names.items()}
    refused = ~np.isin(status[trace.time_s >= 0.0], (Status.OK, NOT_CALLED))
    long = trace.time_s[-2] >= TRANSIENT_S
    shown = partial(numbers, spatial=trace.spatial)
    walls = speed_m_s = None
    if limited is not None and method_of(settings).limiting is not None:
        walls = walls_m(settings, limited.fence_m)
        speed_m_s = settings.limits.speed_m_s if nears_limit(trace, settings.limits.speed_m_s) else None
    keys = [key for key, limit in (("past_wall_m", walls), ("speed_excess", speed_m_s)) if limit]

    def kept(view: Trace) -> dict[str, float]:
        found = measure_limits(view, settings, [limited or Scenario()]) if keys else None
        return {key: float(getattr(found, key)[0]) for key in keys}

    return {
        "lost": bool(trace.diverged[0]),
        "crash": first_crash(trace, drone=drone),
        "mostly_refused": bool(np.mean(refused) > 0.5),
        "statuses": {name: count for name, count in counts.items() if count},
        "refusals": refusals(trace, settings),
        "metrics": shown(measure(trace)) | kept(trace),
        "metrics_without_transient": shown(measure(trace, TRANSIENT_S)) if long else None,
        "metrics_as_seen": shown(measure(seen)) | kept(seen) if seen is not None else None,
        "walls_m": walls,
        "speed_limit_m_s": speed_m_s,
        "passed": _passed(trace, course, level=limited is None or settings.height is None),
    }


def _passed(trace: Trace, course: Trajectory | None, *, level: bool) -> list[PassedSummary] | None:
    """Return how the first flight passed the points of a plan; None of a course without points.

    level: the height is not the controller's, and is not judged.
    """
    if not isinstance(course, Pieces) or not course.points:
        return None
    on_course = trace.time_s >= 0.0
    target_m = np.column_stack([trace.target[:, 0, :2], -trace.target_height_m[:, 0]])
    error_m = ((trace.position_m[:, 0] - target_m) * (1.0, -1.0, -1.0))[on_course]
    return course.passes(trace.time_s[on_course], error_m[:, :2] if level else error_m)


def flight_pictures(
    folder: Path,
    files: Mapping[str, str],
    caption: str,
    marks: FlightMarks = NO_MARKS,
) -> list[Picture]:
    """Return the animation and the pictures of the traces `files`, names in `folder` by title."""

    @cache
    def flights() -> dict[str, Trace]:
        return {title: read_npz(folder / name) for title, name in files.items() if (folder / name).is_file()}

    def animation() -> list[Markup]:
        from mambo_sil.results.html_page import render_page  # noqa: PLC0415 - loaded when drawing

        return [Markup(render_page("flight.html.j2", {"animation": animate(flights())}))]

    def columns() -> list[Markup]:
        from mambo_sil.flight.flight_plots import flight_columns  # noqa: PLC0415 - loaded when drawing

        return flight_columns(flights(), marks)

    paths = [folder / name for name in files.values()]
    return [MovingPicture(animation, "", paths), Picture(columns, caption, paths)]
