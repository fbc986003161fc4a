"""The record of an identification: what the command prints, and the summary in its folder."""

from dataclasses import dataclass
from typing import Final, Literal

from mambo_sil.model.identify.motion import Motion
from mambo_sil.model.identify.response import AxisParameters, FirstOrder
from mambo_sil.results.summary import Number, Summary

Verdict = Literal["good", "weak", "refused"]

MODEL: Final = "model.toml"
VEHICLE: Final = "vehicle.toml"
CURVES: Final = "fit.csv"
PICTURES: Final = ("fit.png", "fit.svg")


@dataclass(frozen=True)
class AxisResult:
    """One axis; without `fitted` if the commands do not excite it."""

    verdict: Verdict
    reasons: list[str]
    """Why the verdict is not "good"."""
    command_rad: Number
    """Standard deviation of the command."""
    held_out_r2: Number
    held_out_error_rad: Number
    """Rms error of the model that is fitted to the first half of each stretch, in the second half."""
    other_error_rad: Number
    """The same with an integrator if `fitted` has none, and without if it has one."""
    fitted: AxisParameters | None
    first_order: FirstOrder | None
    """The model without an integrator, whether or not `fitted` has one."""
    offset_rad: Number
    """Mean measured tilt at no command."""
    tilt_noise_rad: Number
    """White noise of the measured tilt."""


@dataclass(frozen=True)
class LogResult:
    """One log: time in usable stretches, and the column of each signal, with sign and factor."""

    name: str
    duration_s: float
    columns: dict[str, str]


@dataclass(frozen=True)
class Noise:
    """White noise of position and velocity, NaN where they are not logged."""

    position_m: Number
    velocity_m_s: Number


class IdentifySummary(Summary):
    """An identification."""

    command = "identify"

    logs: list[LogResult]
    duration_s: float
    split_s: float
    """Time in `fit.csv` up to which its model was fitted."""
    roll: AxisResult
    pitch: AxisResult
    motion: Motion | None
    noise: Noise
    model: dict[str, float]
    """The keys of section [model] that follow; empty if an axis is refused."""
    remarks: list[str]

    @property
    def axes(self) -> dict[str, AxisResult]:
        """The axes by name."""
        return {"roll": self.roll, "pitch": self.pitch}

    @property
    def good(self) -> bool:
        """Whether there is a model of both axes."""
        return bool(self.model)
