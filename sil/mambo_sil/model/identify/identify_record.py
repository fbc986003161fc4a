"""The record of an identification: its summary and its result."""

import math
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Final, Literal

from markupsafe import Markup

from mambo_sil.model.identify.estimator import VelocityErrors
from mambo_sil.model.identify.motion import Motion
from mambo_sil.model.identify.response import AxisParameters, Interval
from mambo_sil.model.identify.signals import DEGREE
from mambo_sil.results.blocks import CommandResult, Note, Picture, ResultTable, Sentence
from mambo_sil.results.number_format import three_digits
from mambo_sil.results.summary import Number, ReportedSummary

Verdict = Literal["good", "weak", "refused"]

MODEL: Final = "model.toml"
VEHICLE: Final = "vehicle.toml"
CURVES: Final = "fit.csv"
PICTURES: Final = ("fit.png", "fit.svg")
AXIS_ROWS: Final = (
    *("gain", "lag + dead time, ms", "lag, ms", "dead time, ms", "integrator, 1/s"),
    *("without it, vehicle.toml", "held-out R2", "verdict"),
)
ADVICE: Final = (
    "what to fly: mambo-nmpc identify --manoeuvre eight.py writes a script that flies and logs a figure of "
    "eight on a Crazyflie; --manoeuvre eight.csv writes its waypoints for another drone"
)
FIT_CAPTION: Final = (
    "Twelve seconds of the longest stretch. The model is driven by the command alone; it was fitted to the "
    "first half of each stretch, and predicts the second, shaded half."
)


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
    first_order: AxisParameters | None
    """The model without an integrator, whether or not `fitted` has one: the model in `vehicle.toml`."""
    offset_rad: Number
    """Mean measured tilt at no command."""
    tilt_noise_rad: Number
    """White noise of the measured tilt; NaN where that is rarely logged."""


@dataclass(frozen=True)
class ThrustResult:
    """The response of the thrust; without `gain` if the logs do not show it."""

    verdict: Verdict
    reasons: list[str]
    """Why the verdict is not "good"."""
    command_change: Number
    """Rms change of the lagged command over its mean, in windows, where it is largest."""
    held_out_r2: Number
    gain: Interval | None
    """Thrust over mass in m/s^2 per unit of the command at hover, in the middle of the logs."""
    lag_s: Interval | None
    """Lag with dead time and the age of the measured height."""
    hover_command: Number
    """Command that carries the weight, in the middle of the logs."""
    battery_sag_1_s: Interval | None
    """Share of the thrust in the middle that is lost per second."""
    weight_g: Number
    """Effect of a change of the command over that which hover tells: 1 if they are in proportion."""
    drag_1_s: Number
    """Drag of the climb, as deceleration over speed."""
    scaled: bool
    """Whether the command is thrust over mass in m/s^2; else it has a unit of its own."""


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


class IdentifySummary(ReportedSummary):
    """An identification."""

    command = "identify"

    logs: list[LogResult]
    duration_s: float
    split_s: float
    """Time in `fit.csv` up to which its model was fitted."""
    roll: AxisResult
    pitch: AxisResult
    motion: Motion | None
    thrust: ThrustResult | None = None
    """None where no log has both height and thrust."""
    noise: Noise
    estimator: VelocityErrors | None = None
    """None where no log has what the autopilot's camera measured."""
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

    @property
    def verdicts(self) -> dict[str, str]:
        """The verdict on each axis by name."""
        return {name: axis.verdict for name, axis in self.axes.items()}

    @property
    def answer(self) -> list[str]:
        """The model of each axis in a line."""
        found = {name: axis_cells(axis) for name, axis in self.axes.items()}
        return [
            f"{name}: {one[-1]}; gain {one[0]}, lag + dead time {one[1]} ms" for name, one in found.items()
        ]

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result: the model with its 95 % intervals, then what the logs showed."""

        def picture() -> list[Markup]:
            from mambo_sil.model.identify.identify_plots import fit_panel  # noqa: PLC0415 - loaded when drawing

            return [fit_panel(folder / CURVES, self.split_s, self.verdicts)]

        cells = {name: axis_cells(axis) for name, axis in self.axes.items()}
        parts: dict[str, AxisResult | ThrustResult] = {**self.axes}
        parts |= {} if self.thrust is None else {"thrust": self.thrust}
        said = [f"{name} is {one.verdict}: {reason}" for name, one in parts.items() for reason in one.reasons]
        said += [
            f"{name}: only the sum of lag and dead time is known, not how it splits"
            for name, axis in self.axes.items()
            if axis.fitted is not None and not axis.fitted.split_is_known
        ]
        advice = [] if all(axis.verdict == "good" for axis in self.axes.values()) else [ADVICE]
        return CommandResult(
            f"Identification from {', '.join(log.name for log in self.logs)}",
            self.good,
            self.answer,
            [
                *map(Sentence, said),
                Picture(picture, FIT_CAPTION, [folder / CURVES]),
                ResultTable(("", *self.axes), list(zip(AXIS_ROWS, *cells.values(), strict=True)), (0, 1, 2)),
                Note("With 95 % intervals. Lag plus dead time is known better than either."),
                ResultTable((), [*motion_rows(self), *thrust_rows(self), *noise_rows(self)]),
                *(Sentence(_log(log)) for log in self.logs),
                *map(Sentence, [*self.remarks, *advice]),
            ],
        )


def _log(log: LogResult) -> str:
    """Return how much of a log was used, and its columns with another name than their signal."""
    renamed = [f"{signal} = {column}" for signal, column in log.columns.items() if column != signal]
    used = f"{log.name}: {log.duration_s:.1f} s used"
    return f"{used}; {', '.join(renamed)}" if renamed else used


def axis_cells(axis: AxisResult) -> list[str]:
    """Return the values of `AXIS_ROWS` of an axis in words."""
    fit = axis.fitted
    r2 = "-" if axis.held_out_r2 != axis.held_out_r2 else f"{axis.held_out_r2:.3f}"
    if fit is None or axis.first_order is None:
        return ["-"] * 6 + [r2, axis.verdict]
    times = [_plus_minus(each, 1e3, 0) for each in (fit.sum_s, fit.lag_s, fit.delay_s)]
    if not fit.split_is_known:
        times[1:] = ["not known"] * 2
    integral = "-" if fit.integral_1_s is None else _plus_minus(fit.integral_1_s, 1.0, 2)
    plain = axis.first_order
    flown = f"{plain.gain.value:.3f}, {1e3 * plain.lag_s.value:.0f} + {1e3 * plain.delay_s.value:.0f} ms"
    written = "as above" if fit.integral_1_s is None else flown
    return [_plus_minus(fit.gain, 1.0, 3), *times, integral, written, r2, axis.verdict]


def motion_rows(summary: IdentifySummary) -> list[tuple[str, str]]:
    """Return name and value of each parameter of the motion."""
    motion = summary.motion
    if motion is None:
        return []
    trim = ", ".join(_plus_minus(each, 1.0 / DEGREE, 2) for each in motion.trim_rad) + " degrees"
    return [
        ("acceleration per tilt", f"{_plus_minus(motion.acceleration_per_tilt, 1.0, 3)} g per radian"),
        ("drag", f"{_plus_minus(motion.drag_1_s, 1.0, 3)} 1/s"),
        ("trim of roll, pitch", trim if motion.trim_is_known else "not known: turn the heading, both ways"),
        ("lag of the velocity", f"{_plus_minus(motion.velocity_lag_s, 1e3, 0)} ms"),
        ("motion explained", f"R2 {motion.r2:.3f}; rms left {motion.disturbance_m_s2:.3f} m/s^2"),
    ]


def thrust_rows(summary: IdentifySummary) -> list[tuple[str, str]]:
    """Return name and value of each parameter of the thrust."""
    thrust = summary.thrust
    if thrust is None or thrust.gain is None or thrust.lag_s is None or thrust.battery_sag_1_s is None:
        return []
    gain, lag, sag = thrust.gain, thrust.lag_s, thrust.battery_sag_1_s
    return [
        ("thrust per command", f"{three_digits(gain.value)} +- {three_digits(gain.within)} m/s^2"),
        ("lag of the thrust", f"{_plus_minus(lag, 1e3, 0)} ms"),
        ("thrust command of hover", three_digits(thrust.hover_command)),
        ("sag of the battery", f"{_plus_minus(sag, 100.0, 3)} % of the thrust per second"),
        ("drag of the climb", f"{thrust.drag_1_s:.2f} 1/s"),
        ("height explained", f"R2 {thrust.held_out_r2:.3f}; changes {thrust.weight_g:.2f} of hover's gain"),
    ]


def noise_rows(summary: IdentifySummary) -> list[tuple[str, str]]:
    """Return name and value of the measured tilts' offset, of each noise and of the estimator's error."""
    tilts = ", ".join(f"{axis.tilt_noise_rad / DEGREE:.2f}" for axis in summary.axes.values())
    offsets = ", ".join(f"{axis.offset_rad / DEGREE:.2f}" for axis in summary.axes.values())
    rows = [("roll, pitch at no command", f"{offsets} degrees")]
    if not any(math.isnan(axis.tilt_noise_rad) for axis in summary.axes.values()):
        rows.append(("white noise of roll, pitch", f"{tilts} degrees"))
    for words, value, unit in (
        ("white noise of position", summary.noise.position_m, "m"),
        ("white noise of velocity", summary.noise.velocity_m_s, "m/s"),
    ):
        rows += [(words, f"{three_digits(value)} {unit}")] if value == value else []  # noqa: PLR0124 - NaN
    if summary.estimator is not None:
        error, lasts = (three_digits(one) for one in astuple(summary.estimator))
        words = f"{error} m/s, correlated for {lasts} s"
        rows.append(("error of the estimated velocity", words))
    return rows


def _plus_minus(estimate: Interval, factor: float, decimals: int) -> str:
    return f"{factor * estimate.value:.{decimals}f} +- {factor * estimate.within:.{decimals}f}"
