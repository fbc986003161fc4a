"""A comparison of two controllers: record and result."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ConfigDict

from mambo_codegen.errors import echo
from mambo_codegen.methods import method_of
from mambo_codegen.settings.controller_keys import KEYS
from mambo_codegen.settings.key import spell
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.compare.compared_flights import (
    EIGHT_S,
    SETTLED_SHARE,
    STEP_M,
    Answers,
    EightAnswer,
    StepAnswer,
)
from mambo_sil.experiment.compare.control_terms import AXES, AxisLaw, ObserverGains, axis_laws, observer_gains
from mambo_sil.experiment.margins.axis_margins import Margins
from mambo_sil.experiment.margins.margins_run import MarginSubject, axes_on
from mambo_sil.results.blocks import CommandResult, ResultTable
from mambo_sil.results.number_format import distance, three_digits
from mambo_sil.results.summary import ReportedSummary

PICTURES: Final = ("step.png", "step.svg")
_DASH = "\N{EN DASH}"
Row = tuple[str, float | None, str]
"""Name, value and unit of a figure."""


class SettingDifference(BaseModel):
    """A setting with two values; None where the controller does not use it."""

    model_config = ConfigDict(frozen=True)

    key: str
    a: float | int | str | None
    b: float | int | str | None
    meaning: str


class ControllerFigures(BaseModel):
    """One controller; what is by axis has roll and pitch, margins also the height.

    A 1-norm has no law, no observer, no margins.
    """

    model_config = ConfigDict(frozen=True)

    instance_bytes: int
    law: tuple[AxisLaw, AxisLaw] | None
    observer: ObserverGains | None
    margins: list[Margins] | None
    """With the true state; None if no linear margin applies."""
    step: tuple[StepAnswer, StepAnswer]
    eight: EightAnswer


def differences(a: Settings, b: Settings) -> list[SettingDifference]:
    """Return the settings that differ, in the order of the file."""
    left, right = _values(a), _values(b)
    return [
        SettingDifference(key=key, a=left.get(key), b=right.get(key), meaning=KEYS[key].description)
        for key in KEYS
        if left.get(key) != right.get(key)
    ]


def figures(settings: Settings, drone: VehicleFile, flown: Answers) -> ControllerFigures:
    """Return the figures of one controller on a drone."""
    return ControllerFigures(
        instance_bytes=method_of(settings).instance_bytes,
        law=axis_laws(settings),
        observer=observer_gains(settings),
        margins=axes_on(MarginSubject("", settings, drone)),
        step=flown.step,
        eight=flown.eight,
    )


def _values(settings: Settings) -> dict[str, Any]:
    return {
        f"{section}.{name}": value
        for section, values in settings.used_values.items()
        for name, value in values.items()
    }


class DiffSummary(ReportedSummary):
    """Two controllers compared; without figures if they are the same."""

    command = "diff"

    a: str
    b: str
    settings_a: str
    settings_b: str
    vehicle: VehicleFile
    differences: list[SettingDifference]
    figures_a: ControllerFigures | None = None
    figures_b: ControllerFigures | None = None

    @property
    def same(self) -> bool:
        """Whether the C is the same."""
        return self.settings_a == self.settings_b

    def result(self, _folder: Path, /) -> CommandResult:
        """Return the result: what differs in the settings, and figures of both, unless they are the same."""
        title = f"{self.a} and {self.b} compared, vehicle {self.vehicle.name}"
        a, b = echo(self.a), echo(self.b)
        if self.same:
            both = f"{a} and {b} are the same controller: settings {self.settings_a[:16]}"
            return CommandResult(title, None, [both])
        answer = [
            f"A: {a}, settings {self.settings_a[:16]}{_answer(self.figures_a)}",
            f"B: {b}, settings {self.settings_b[:16]}{_answer(self.figures_b)}",
        ]
        heads = ("setting", "A", "B", "meaning")
        tables = [ResultTable(heads, list(map(_setting, self.differences)), (0, 3))]
        if self.figures_a is not None and self.figures_b is not None:
            heads = (f"on vehicle {echo(self.vehicle.name)}", "A", "B", "")
            tables.append(ResultTable(heads, list(_figures(self.figures_a, self.figures_b)), (0, 3)))
        return CommandResult(title, None, answer, tables)


def _answer(figures: ControllerFigures | None) -> str:
    """Return how closely a controller flies the eight, and how much more delay it tolerates."""
    if figures is None:
        return ""
    eight = figures.eight
    if eight.crashed:
        return "; CRASHED on the eight"
    answer = f"; {distance(eight.iae_m_s / EIGHT_S)} in the mean"
    commands = [axis.command for axis in figures.margins or ()]
    delays_s = [0.0 if command is None else command.delay_s for command in commands]
    return f"{answer}, tolerates {1e3 * min(delays_s):.0f} ms more delay" if delays_s else answer


def _setting(one: SettingDifference) -> tuple[str, ...]:
    a, b = (_DASH if value is None else spell(value) for value in (one.a, one.b))
    return one.key, a, b, re.split(r"[.:;] |\.$", one.meaning)[0]


def _figures(a: ControllerFigures, b: ControllerFigures) -> Iterator[tuple[str, ...]]:
    """Yield a row for each figure that one of them has."""
    left, right = ({name: (value, unit) for name, value, unit in figure_rows(one)} for one in (a, b))
    for name, (_, unit) in (left | right).items():
        old, new = (three_digits(side.get(name, (None, ""))[0]) for side in (left, right))
        yield name, old, new, unit


def figure_rows(one: ControllerFigures) -> Iterator[Row]:
    """Yield the figures of a controller, the law's first."""
    for axis, law in zip(AXES, one.law or (), strict=False):
        yield f"{axis}: gain of position", law.position_gain_rad_m, "rad/m"
        yield f"{axis}: gain of velocity", law.velocity_gain_rad_s_m, "rad s/m"
        yield f"{axis}: gain of disturbance", law.disturbance_gain_rad_s2_m, "rad s^2/m"
        yield f"{axis}: dominant pole", law.dominant_rad_s, "rad/s"
        yield f"{axis}: its damping", law.dominant_damping, ""
    if one.observer is not None:
        gains = one.observer
        for name, pair, units in (
            ("position", gains.position, ("", "s")),
            ("velocity", gains.velocity_1_s, ("1/s", "")),
            ("disturbance", gains.disturbance_1_s2, ("1/s^2", "1/s")),
        ):
            for source, gain, unit in zip(("position", "velocity"), pair, units, strict=True):
                yield f"observer: {name} by {source}", gain, unit
    for margins in one.margins or ():
        yield from _margin_rows(margins)
    for axis, step in zip(AXES, one.step, strict=True):
        yield f"{axis}: {STEP_M:g} m step settles to {100 * SETTLED_SHARE:g} %", step.settling_s, "s"
        yield f"{axis}: overshoot", 100.0 * step.overshoot, "%"
        yield f"{axis}: IAE of the step", step.iae_m_s, "m s"
    yield "eight: IAE", one.eight.iae_m_s, "m s"
    yield "eight: largest error", one.eight.max_error_m, "m"
    yield "eight: command variation", one.eight.command_variation_rad, "rad"
    yield "size of nmpc_t", one.instance_bytes, "bytes"


def _margin_rows(axis: Margins) -> Iterator[Row]:
    """Yield the margins of an axis, broken at the command and, if it has motors, at their torque."""
    for place, loop in axis.loops.items():
        where = "" if place == "command" else " at the motors"
        yield f"{axis.axis}: gain margin{where}", loop.gain_up, "times"
        yield f"{axis.axis}: phase margin{where}", loop.phase_deg, "degrees"
        yield f"{axis.axis}: delay margin{where}", 1e3 * loop.delay_s, "ms"
        yield f"{axis.axis}: sensitivity{where}", loop.sensitivity, ""
