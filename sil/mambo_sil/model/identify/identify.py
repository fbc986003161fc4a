"""From logs to a model: read, check, cut, fit, judge."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.errors import echo
from mambo_sil.errors import LogError
from mambo_sil.model.identify.axis import AxisFit, fit_axis, judge_axis
from mambo_sil.model.identify.checks import EXCITED_RAD, NAMES, Checked, check_log, check_units
from mambo_sil.model.identify.columns import Column
from mambo_sil.model.identify.csv_log import LONGEST_RARE_PERIOD_S, read_csv
from mambo_sil.model.identify.curves import Curves
from mambo_sil.model.identify.dataflash import read_dataflash
from mambo_sil.model.identify.estimator import estimator_errors
from mambo_sil.model.identify.identify_record import AxisResult, IdentifySummary, LogResult, Noise
from mambo_sil.model.identify.motion import Motion, explained, fit_motion
from mambo_sil.model.identify.segments import SHORTEST_S, Segment, cut, duration_s, is_rare, tumbled
from mambo_sil.model.identify.signals import POSITION, TILTS, VELOCITY, FlightLog
from mambo_sil.model.identify.thrust import fit_thrust
from mambo_sil.model.identify.ulog import read_ulog

SHARES: Final = (0.4, 1.5)
"""Bounds on a plausible acceleration per tilt."""

LARGEST_TRIM_RAD: Final = 0.2
"""Bound on a plausible trim: the bound of the settings."""

LEAST_EXPLAINED, GOOD_EXPLAINED = 0.8, 0.9
"""Share of the motion that tilt must explain. In hover tilt mostly answers gusts, which biases the fit."""


READERS: Final[dict[str, Callable[[Path, float], FlightLog]]] = {".ulg": read_ulog, ".bin": read_dataflash}
"""What reads the logs of autopilots, by ending: ULog of PX4, DataFlash of ArduPilot."""


def read_logs(paths: Sequence[Path], columns: Mapping[str, Column]) -> tuple[list[FlightLog], list[str]]:
    """Read CSV files and, by their ending, logs of autopilots; return the logs, and the faults of others.

    Raises LogError with all faults if there is no log at all, or a path names no file, or a file twice.
    """
    logs: list[FlightLog] = []
    faults: list[str] = []
    mistaken = False
    readers = [READERS.get(path.suffix.lower()) for path in paths]
    if columns and all(readers):
        mistaken = True
        faults.append("--columns is for CSV files; the log of an autopilot needs none")
    for path, read in zip(paths, readers, strict=True):
        if sum(path.resolve() == other.resolve() for other in paths) > 1:
            mistaken = True
            faults.append(f"{echo(str(path))}: is named twice; a log counts once")
            continue
        try:
            logs.append(
                read_csv(path, columns, longest_period_s=LONGEST_RARE_PERIOD_S)
                if read is None
                else read(path, LONGEST_RARE_PERIOD_S)
            )
        except LogError as error:
            mistaken |= not path.is_file()
            faults += error.faults
    if mistaken or not logs:
        raise LogError(tuple(dict.fromkeys(faults)))
    return logs, faults


def identify(logs: Sequence[FlightLog], left_out: Sequence[str] = ()) -> tuple[IdentifySummary, Curves]:
    """Fit both axes and the motion on all logs without a fault; `left_out` has the faults of other files.

    Raises LogError with all faults of units, signs and clocks if every log has one.
    """
    logs, pieces, remarks, shared_clock = _check(logs, left_out)
    segments = [segment for piece in pieces for segment in piece]
    longest = max(segments, key=lambda each: len(each.time_s))
    fits = [fit_axis(segments, axis) for axis in range(2)]
    results = [
        judge_axis(pieces, axis, fits[axis], _white_noise(logs, TILTS[axis : axis + 1])) for axis in range(2)
    ]
    motion, why = _fit_motion(segments, shared_clock=shared_clock)
    remarks += [why] if why else []
    model = {} if any(each.verdict == "refused" for each in results) else model_keys(results, motion)
    summary = IdentifySummary(
        logs=[
            LogResult(log.name, duration_s(piece), {name: each.column for name, each in log.signals.items()})
            for log, piece in zip(logs, pieces, strict=True)
        ],
        duration_s=duration_s(segments),
        split_s=float(longest.time_s[longest.first_half][-1] - longest.time_s[0]),
        roll=results[0],
        pitch=results[1],
        motion=motion,
        thrust=fit_thrust(segments),
        noise=Noise(_white_noise(logs, POSITION), _white_noise(logs, VELOCITY)),
        estimator=estimator_errors(
            logs, [[(one.time_s[0], one.time_s[-1]) for one in piece] for piece in pieces]
        ),
        model=model,
        remarks=remarks,
    )
    return summary, _curves(longest, segments.index(longest), fits)


def model_keys(axes: Sequence[AxisResult], motion: Motion | None) -> dict[str, float]:
    """Return the keys of section [model], rounded to four digits; both axes must be fitted."""
    keys: dict[str, float] = {}
    for name, axis in zip(NAMES, axes, strict=True):
        if (fit := axis.fitted) is None:
            raise ValueError(f"{name} has no fit")
        keys |= {f"{name}_gain": fit.gain.value, f"{name}_lag_s": fit.lag_s.value}
        keys |= {f"{name}_delay_s": fit.delay_s.value}
        keys |= {f"{name}_integral_1_s": fit.integral_1_s.value} if fit.integral_1_s else {}
    if motion is not None:
        if motion.trim_is_known:
            trims = zip(NAMES, motion.trim_rad, strict=True)
            keys |= {f"{name}_trim_rad": trim.value for name, trim in trims}
        keys |= {"acceleration_per_tilt": motion.acceleration_per_tilt.value}
        keys |= {"drag_1_s": max(motion.drag_1_s.value, 0.0)}
    return {key: float(f"{value:.4g}") for key, value in keys.items()}


def _check(
    logs: Sequence[FlightLog], left_out: Sequence[str]
) -> tuple[list[FlightLog], list[list[Segment]], list[str], bool]:
    """Return the logs without a fault, their stretches, remarks, and whether tilt and velocity share a clock.

    The remarks name what the pool leaves out. Raises LogError if nothing is left.
    """
    faults = list(left_out)
    remarks: list[str] = []
    sound, pieces, shared_clock = [], [], True
    for log in logs:
        checked, segments = _check_one(log)
        if checked.faults:
            faults += checked.faults
            continue
        sound.append(log)
        pieces.append(segments)
        remarks += [*log.remarks, *checked.remarks]
        shared_clock &= checked.one_clock
    if not sound:
        raise LogError(tuple(faults))
    return sound, pieces, [*(f"left out: {fault}" for fault in faults), *remarks], shared_clock


def _check_one(log: FlightLog) -> tuple[Checked, list[Segment]]:
    """Return the faults or remarks of a log, and its stretches."""
    if units := check_units(log):
        return Checked(units, ()), []
    segments = cut(log)
    if not segments:
        why = (
            f"{log.name}: has no stretch of {SHORTEST_S:g} s in the air without a gap of 0.2 s or a tilt "
            "beyond 45 degrees; fly longer, or log more reliably"
        )
        return Checked((why,), ()), []
    checked = check_log(log, segments)
    if share := tumbled(log):
        words = f"{log.name}: a tumble beyond 45 degrees is cut out, {share:.0%} of the samples"
        checked = replace(checked, remarks=(words, *checked.remarks))
    return checked, segments


def _fit_motion(segments: Sequence[Segment], *, shared_clock: bool) -> tuple[Motion | None, str]:
    """Return the motion, or None; and what a reader must know of it."""
    moved = [each for each in segments if each.velocity_m_s is not None]
    why = "tilt and velocity do not share a clock" if not shared_clock else _why_no_motion(moved)
    motion = None if why else fit_motion(moved)
    if motion is not None:
        share = motion.acceleration_per_tilt.value
        trim_rad = max(abs(trim.value) for trim in motion.trim_rad)
        if SHARES[0] <= share <= SHARES[1] and trim_rad <= LARGEST_TRIM_RAD:
            biased = f"tilt explains only {motion.r2:.2f} of the motion: acceleration and drag may be biased"
            return motion, biased if motion.r2 < GOOD_EXPLAINED else ""
        why = (
            f"{share:.2f} g per radian and a trim of {trim_rad:.2f} rad; plausible are "
            f"{SHARES[0]}..{SHARES[1]}, and at most {LARGEST_TRIM_RAD}"
        )
    return None, f"acceleration per tilt, drag and trim are not fitted: {why}"


def _why_no_motion(moved: Sequence[Segment]) -> str:
    """Return why stretches that have velocities do not show the motion, or nothing."""
    if not moved:
        return "no log has velocity or position"
    tilt = np.concatenate([each.tilt_rad for each in moved], axis=1)
    if (tilt.std(axis=1) < EXCITED_RAD).any():
        return "roll or pitch moves by less than 1 degree"
    if (share := explained(moved)) < LEAST_EXPLAINED:
        return f"tilt explains only {share:.2f} of the motion; {LEAST_EXPLAINED} is needed"
    return ""


def _white_noise(logs: Sequence[FlightLog], names: Sequence[str]) -> float:
    """Return the rms of the white noise of signals, from third differences of samples.

    NaN if they are absent, or so rare that they move between two samples.
    """
    parts = [
        np.diff(log.signals[name].value, 3) / math.sqrt(20.0)
        for log in logs
        for name in names
        if name in log.signals and not is_rare(log.signals[name])
    ]
    return float(np.sqrt(np.median(np.concatenate(parts) ** 2) / 0.455)) if parts else math.nan


def _curves(segment: Segment, number: int, fits: Sequence[AxisFit | None]) -> Curves:
    """Return the curves of a stretch."""
    model = [
        np.full_like(segment.time_s, np.nan)
        if fit is None
        else fit.half.predict(segment, axis, fit.half.offset_rad[number])
        for axis, fit in enumerate(fits)
    ]
    command = np.stack([segment.command_means(axis) for axis in range(2)])
    return Curves(segment.time_s - segment.time_s[0], command, segment.tilt_rad, np.stack(model))
