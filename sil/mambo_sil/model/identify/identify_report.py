"""An identification as section [model] of a controller.toml, and as vehicle.toml."""

from typing import Final

from mambo_sil.model.identify.identify_record import IdentifySummary
from mambo_sil.model.identify.response import AxisParameters, Interval
from mambo_sil.results.number_format import three_digits

UNKNOWN_MASS: Final = (
    "# mass_kg =  # with battery: no log shows it; write it here, or identify with --mass-kg"
)
UNKNOWN_TRIM: Final = (
    "# roll_trim_rad, pitch_trim_rad are not known: the heading did not turn enough to tell them from wind"
)


def model_text(summary: IdentifySummary) -> str:
    """Return a controller.toml with section [model] and the cost that uses all its keys."""
    within = _half_widths(summary)
    lines = [
        *_heading(summary),
        '# A controller.toml; or copy section [model] into one that has controller.method = "quadratic".',
        "",
        "[controller]",
        'method = "quadratic"',
        "",
        "[model]",
    ]
    for key, value in summary.model.items():
        lines.append(f"{key} = {value!r}" + (f"  # +- {within[key]:.2g}" if key in within else ""))
        fit = {f"{name}_delay_s": axis.fitted for name, axis in summary.axes.items()}.get(key)
        lines += [] if fit is None else [each.strip() for each in (_of_split(fit),) if each]
    return "\n".join(lines) + "\n"


def vehicle_text(summary: IdentifySummary, mass_kg: float | None) -> str:
    """Return a vehicle.toml of kind first_order, with a mass if it is known; both axes must have a model."""
    motion = summary.motion
    share, drag = "1.0  # not identified", "0.0  # not identified"
    trims: list[str] = []
    within: dict[str, Interval] = {}
    if motion is not None:
        share = _round(motion.acceleration_per_tilt.value)
        drag = _round(max(motion.drag_1_s.value, 0.0))
        within = {"drag_1_s": motion.drag_1_s, "acceleration_per_tilt_g": motion.acceleration_per_tilt}
        if motion.trim_is_known:
            known = dict(zip((f"{name}_trim_rad" for name in summary.axes), motion.trim_rad, strict=True))
            trims = [f"{key} = {_round(trim.value)}" for key, trim in known.items()]
            within |= known
        else:
            trims = [UNKNOWN_TRIM]
    responses = []
    for name, axis in summary.axes.items():
        if (fit := axis.first_order) is None:
            raise ValueError(f"{name} has no model")
        found = {"gain": fit.gain, "lag_s": fit.lag_s, "dead_time_s": fit.delay_s}
        values = ", ".join(f"{key} = {_round(each.value)}" for key, each in found.items())
        responses.append(f"{name} = {{ {values} }}{_of_split(fit)}")
        if not fit.split_is_known:
            found = {"gain": fit.gain, "split_s": Interval(0.0, fit.split_s), "dead_time_s": fit.sum_s}
        within |= {f"{name}_{key}": each for key, each in found.items()}
    thrust, vertical = _thrust_lines(summary)
    within |= vertical
    lines = [
        *_heading(summary),
        "",
        "[body]",
        UNKNOWN_MASS if mass_kg is None else f"mass_kg = {mass_kg!r}  # as told to identify",
        f"drag_1_s = {drag}",
        "",
        "[attitude]",
        'kind = "first_order"',
        f"acceleration_per_tilt_g = {share}",
        *trims,
        *responses,
        *thrust,
        *_sensors_lines(summary),
        "",
        "[uncertainty]  # half-widths of the 95 % intervals; no flight reads them",
        *(f"{key} = {float(f'{each.within:.2g}')!r}" for key, each in within.items()),
    ]
    return "\n".join(lines) + "\n"


def _of_split(fit: AxisParameters) -> str:
    """Return a comment that says of an axis that only the sum of lag and dead time is known."""
    if fit.split_is_known:
        return ""
    known = f"{fit.sum_s.value:.3f} +- {fit.sum_s.within:.3f} s"
    return f"  # lag and dead time together: {known}; how it splits is not known"


def _thrust_lines(summary: IdentifySummary) -> tuple[list[str], dict[str, Interval]]:
    """Return the section [thrust], and its values by their keys in [uncertainty]; nothing if not known.

    A command in a unit of its own is one of 9.81 m/s^2 at hover, with which the gain is 1.
    """
    thrust = summary.thrust
    if thrust is None or thrust.gain is None or thrust.lag_s is None:
        return [], {}
    gain, unit = thrust.gain, "thrust over mass"
    if not thrust.scaled:
        gain = Interval(1.0, gain.within / gain.value)
        unit = f"one that is {three_digits(thrust.hover_command)} at hover"
    lines = [
        "",
        f"[thrust]  # of the command in the logs, {unit}",
        f"gain = {_round(gain.value)}",
        f"lag_s = {_round(thrust.lag_s.value)}  # with dead time and the age of the height",
    ]
    return lines, {"thrust_gain": gain, "thrust_lag_s": thrust.lag_s}


def _sensors_lines(summary: IdentifySummary) -> list[str]:
    """Return the section [sensors], if the logs show how the estimator of an autopilot errs."""
    if (errors := summary.estimator) is None:
        return []
    return [
        "",
        "[sensors]  # the estimate beside what the camera measured",
        'kind = "autopilot"',
        f"velocity_error_m_s = {_round(errors.velocity_m_s)}",
        f"velocity_error_s = {_round(errors.correlation_s)}",
    ]


def _heading(summary: IdentifySummary) -> list[str]:
    """Return the first comment lines of a file: what it describes, and from which logs."""
    flown = f"# Identified by {summary.generator} on {summary.duration_s:.0f} s of flight"
    return [
        f"{flown}: {'; '.join(summary.answer)}.",
        *(f"# {log.name}, {log.duration_s:.0f} s" for log in summary.logs),
    ]


def _half_widths(summary: IdentifySummary) -> dict[str, float]:
    """Return the half-width of the 95 % interval of each key of the model."""
    found: dict[str, Interval | None] = {}
    for name, axis in summary.axes.items():
        if (fit := axis.fitted) is not None:
            found |= {f"{name}_gain": fit.gain, f"{name}_lag_s": fit.lag_s, f"{name}_delay_s": fit.delay_s}
            found |= {f"{name}_integral_1_s": fit.integral_1_s}
    if (motion := summary.motion) is not None:
        found |= {"acceleration_per_tilt": motion.acceleration_per_tilt, "drag_1_s": motion.drag_1_s}
        found |= dict(zip(("roll_trim_rad", "pitch_trim_rad"), motion.trim_rad, strict=True))
    return {key: each.within for key, each in found.items() if each is not None}


def _round(value: float) -> str:
    """Return a value with four digits, as TOML."""
    return repr(float(f"{value:.4g}"))
