"""The record of a comparison: settings that differ, and figures of both controllers."""

from typing import Any, Final

from pydantic import BaseModel, ConfigDict

from mambo_codegen.methods import method_of
from mambo_codegen.settings.controller_keys import KEYS
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.compare.compared_flights import Answers, EightAnswer, StepAnswer
from mambo_sil.experiment.compare.control_terms import AxisLaw, ObserverGains, axis_laws, observer_gains
from mambo_sil.experiment.margins.axis_margins import Margins
from mambo_sil.experiment.margins.margins_run import MarginSubject, axes_on

PICTURES: Final = ("step.png", "step.svg")


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
