"""Settings drawn by hypothesis: any valid ones."""

import math
from functools import cache
from typing import Any

from hypothesis import strategies as st
from pydantic import ValidationError

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.controller_keys import KEYS
from mambo_codegen.settings.controller_toml import with_value
from mambo_codegen.settings.key import Key, spell
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.reserved import KEYWORDS, OWN_NAMES, STANDARD_NAMES
from tests.support.cases import SCALARS

Values = dict[str, Any]
"""Settings by their dotted paths."""

LAGS: Values = {"model.roll_lag_s": 0.3, "model.pitch_lag_s": 0.3}
QUADRATIC: Values = LAGS | {"controller.method": "quadratic"}
"""The fewest values that make a controller with a quadratic cost."""

LEAST_BRAKING_M_S2 = 0.126
"""What the tilt limit of a quadratic cost must give at least, and a little more."""

RESERVED = KEYWORDS | STANDARD_NAMES | OWN_NAMES
NUMBERS = [key for key in KEYS.values() if key.low is not None]
CHOICES = [key for key in KEYS.values() if key.kind == "one of"]


@cache
def numbers(path: str, low: float | None = None, high: float | None = None) -> st.SearchStrategy[float]:
    """Draw a number that the key at `path` admits, within narrower bounds if given; often a bound."""
    least, most = _bounds(KEYS[path])
    least, most = max(least, low or least), min(most, high or most)
    smallest = max(least, most * 1e-12)
    across_decades = st.floats(math.log(smallest), math.log(most)).map(
        lambda logarithm: min(max(math.exp(logarithm), least), most)
    )
    return st.sampled_from([least, most]) | st.floats(least, most) | across_decades


@st.composite
def valid_values(draw: st.DrawFn) -> Values:
    """Draw valid settings of a 1-norm, every key that it uses free within the rules, by their dotted paths.

    All are of floating point, for fixed point refuses some: see `any_settings`.
    """
    prediction = draw(st.integers(1, 50))
    update = draw(st.sampled_from(["exact", "printed"]))
    none, lags = st.just(0.0), {}
    for angle in ("roll", "pitch"):
        key, feedback = f"model.{angle}_lag_s", f"damping.{angle}_rate_feedback_s"
        lags[feedback] = draw(none | numbers(feedback))
        shortest = lags[feedback] + 0.001001 if lags[feedback] else 0.001
        lags[key] = draw(none if update == "printed" else none | numbers(key, low=shortest))
    step_min = draw(numbers("optimizer.step_min_rad"))
    initial = draw(numbers("optimizer.initial_step_rad", low=step_min))
    thrust_min = draw(numbers("ranges.thrust_acceleration_min_m_s2"))
    tilt_rad = draw(numbers("limits.tilt_rad"))
    constrained: Values = {
        "horizon.prediction": prediction,
        "horizon.control": draw(st.integers(1, prediction)),
        "model.position_update": update,
        **lags,
        "optimizer.iterations": draw(st.integers(1, 100)),
        "optimizer.initial_step_rad": initial,
        "optimizer.step_max_rad": draw(numbers("optimizer.step_max_rad", low=initial)),
        "optimizer.step_min_rad": step_min,
        "ranges.thrust_acceleration_min_m_s2": thrust_min,
        "ranges.thrust_acceleration_max_m_s2": draw(
            numbers("ranges.thrust_acceleration_max_m_s2", low=math.nextafter(thrust_min, math.inf))
        ),
        **draw(limits(tilt_rad, 9.81 * tilt_rad)),
        "target.acceleration": draw(st.sampled_from(["none", "tracked"])),
        "code.scalar": draw(st.sampled_from(["float32", "float64"])),
        "code.prefix": draw(prefixes()),
    }
    choices = {
        key.path: draw(st.sampled_from(choices_of(key))) for key in CHOICES if key.path not in constrained
    }
    free = {key.path: draw(numbers(key.path)) for key in NUMBERS if key.path not in constrained}
    drawn = constrained | choices | free | {"controller.method": "1-norm"}
    return {path: drawn[path] for path in KEYS if Settings().uses(path)}


@st.composite
def quadratic_values(draw: st.DrawFn) -> Values:
    """Draw settings of a quadratic cost, every key that it uses free within the rules, by their dotted paths.

    The ramp alone may make a loop unstable, which is refused: see `quadratic_settings`.
    """
    values: Values = {"controller.method": "quadratic"}
    period_s = draw(numbers("horizon.update_period_s"))
    gains = {angle: draw(numbers(f"model.{angle}_gain")) for angle in ("roll", "pitch")}
    per_tilt, gain = draw(numbers("model.acceleration_per_tilt")), min(gains.values())
    braking_rad = LEAST_BRAKING_M_S2 / (9.81 * per_tilt)
    tilt_rad = draw(numbers("limits.tilt_rad", low=1.001 * braking_rad / gain))
    largest_trim_rad = min(0.2, (gain * tilt_rad) - braking_rad)
    thrust_min = draw(numbers("ranges.thrust_acceleration_min_m_s2"))
    none = st.just(0.0)
    values |= {
        "model.acceleration_per_tilt": per_tilt,
        "horizon.update_period_s": period_s,
        "horizon.ramp_s": draw(none | numbers("horizon.ramp_s", low=max(0.02, 2 * period_s))),
        "limits.tilt_rad": tilt_rad,
        "observer.outage_s": draw(numbers("observer.outage_s", high=min(2, 250 * period_s))),
        "ranges.thrust_acceleration_min_m_s2": thrust_min,
        "ranges.thrust_acceleration_max_m_s2": draw(
            numbers("ranges.thrust_acceleration_max_m_s2", low=math.nextafter(thrust_min, math.inf))
        ),
        "code.scalar": draw(st.sampled_from(["float32", "float64"])),
        "code.prefix": draw(prefixes()),
    }
    for angle, its_gain in gains.items():
        feedback_s = draw(none | numbers(f"damping.{angle}_rate_feedback_s"))
        values |= {
            f"damping.{angle}_rate_feedback_s": feedback_s,
            f"model.{angle}_lag_s": draw(numbers(f"model.{angle}_lag_s", low=feedback_s + 0.001001)),
            f"model.{angle}_delay_s": draw(none | numbers(f"model.{angle}_delay_s", low=0.001)),
            f"model.{angle}_gain": its_gain,
            f"model.{angle}_trim_rad": draw(none | st.floats(-largest_trim_rad, largest_trim_rad)),
        }
    trim_rad = max(abs(values["model.roll_trim_rad"]), abs(values["model.pitch_trim_rad"]))
    values |= draw(limits(tilt_rad, 9.81 * per_tilt * ((gain * tilt_rad) - trim_rad)))
    for name in ("model.drag_1_s", "observer.measurement_age_s", "cost.velocity_weight_s"):
        values[name] = draw(none | numbers(name))
    settings = Settings.model_validate(nested(QUADRATIC))
    for key in KEYS.values():
        if key.path not in values and settings.uses(key.path):
            values[key.path] = draw(
                st.sampled_from(choices_of(key)) if key.low is None else numbers(key.path)
            )
    return {path: values[path] for path in KEYS if path in values}


@cache
def prefixes() -> st.SearchStrategy[str]:
    """Draw a prefix, of up to three words and 24 letters."""
    word = st.text("abcdefghijklmnopqrstuvwxyz0123456789", min_size=1, max_size=7)
    begun = st.lists(word, min_size=1, max_size=3).map("_".join)
    return begun.filter(lambda prefix: prefix[0].isalpha() and prefix not in RESERVED)


def any_settings() -> st.SearchStrategy[Settings]:
    """Draw valid settings of any scalar type, every key free within the rules."""
    return st.sampled_from(SCALARS).flatmap(settings_in)


def settings_in(scalar: str) -> st.SearchStrategy[Settings]:
    """Draw valid settings of a scalar type; for fixed point, what it refuses, nearly half, is drawn again."""

    def representable(values: Values) -> bool:
        try:
            Settings.model_validate(nested(values))
        except ValidationError:
            if scalar != "fixed":
                raise
            return False
        return True

    drawn = valid_values().map(lambda values: values | {"code.scalar": scalar}).filter(representable)
    return drawn.map(lambda values: Settings.model_validate(nested(values)))


def quadratic_settings(scalar: str) -> st.SearchStrategy[Settings]:
    """Draw valid settings of a quadratic cost; a ramp with which the loop is unstable is drawn again."""

    def is_stable(values: Values) -> bool:
        try:
            Settings.model_validate(nested(values))
        except ValidationError as error:
            if any(fault["loc"] != ("horizon", "ramp_s") for fault in error.errors()):
                raise
            return False
        return True

    drawn = quadratic_values().map(lambda values: values | {"code.scalar": scalar}).filter(is_stable)
    return drawn.map(lambda values: Settings.model_validate(nested(values)))


WIDE: Values = {"limits.tilt_rad": 1.2, "ranges.position_m": 10000.0, "ranges.velocity_m_s": 1000.0}
"""Values beside which limits may have any value."""


@st.composite
def limits(draw: st.DrawFn, tilt_rad: float, most_braking_m_s2: float) -> Values:
    """Draw limits of speed, braking and place that go with a tilt limit and the braking that it gives."""
    none = st.just(0.0)
    can_brake = 0.8 * most_braking_m_s2 > 0.1
    reach_m, speed_m_s = draw(numbers("ranges.position_m")), draw(numbers("ranges.velocity_m_s"))
    speed = braking = none
    if can_brake:
        speed = none | numbers("limits.speed_m_s", low=0.1, high=speed_m_s)
        braking = none | numbers("limits.braking_m_s2", low=0.1, high=0.999 * most_braking_m_s2)
    fence: Values = {}
    for axis in draw(st.sampled_from(["", "x", "y", "xy"])) if can_brake else "":
        walls = st.lists(st.floats(-reach_m, reach_m), min_size=2, max_size=2, unique=True)
        low, high = sorted(draw(walls.filter(lambda pair: min(pair) < 9999 and max(pair) > -9999)))
        fence |= {f"limits.fence.{axis}_min_m": low, f"limits.fence.{axis}_max_m": high}
    walls_without = {f"limits.fence.{axis}_{end}_m": 0.0 for axis in "xy" for end in ("min", "max")}
    return (
        walls_without
        | fence
        | {
            "limits.tilt_rad": tilt_rad,
            "limits.speed_m_s": draw(speed),
            "limits.braking_m_s2": draw(braking),
            "ranges.position_m": reach_m,
            "ranges.velocity_m_s": speed_m_s,
        }
    )


SLOW: Values = QUADRATIC | {
    "height.climb_m_s": 0.1,
    "height.descent_m_s": 0.1,
    "ranges.thrust_acceleration_max_m_s2": 1000.0,
}
"""Values with a height beside which its other keys may have any value."""


def base_of(path: str) -> Values:
    """Return the fewest values beside which a controller uses the key at `path`, whatever its value."""
    if path in ("limits.fence.floor_m", "limits.fence.ceiling_m"):
        walls = {"limits.fence.floor_m": -10000.0, "limits.fence.ceiling_m": 10000.0}
        return WIDE | SLOW | {other: value for other, value in walls.items() if other != path}
    if path in ("height.climb_m_s", "height.descent_m_s"):
        strong = {
            "height.response_time_s": 2.0,
            "height.thrust_min_m_s2": 0.5,
            "height.thrust_max_m_s2": 100.0,
        }
        return WIDE | {other: value for other, value in (SLOW | strong).items() if other != path}
    if path == "model.tilt" or path.startswith(("height.", "guard.thrust")):
        learns = path == "height.learnt_acceleration_limit_m_s2"
        return SLOW | ({"height.learnt": "acceleration"} if learns else {})
    if path.startswith("limits.fence."):
        walls = {
            f"limits.fence.{axis}_{end}_m": value
            for axis in "xy"
            for end, value in (("min", -10000.0), ("max", 10000.0))
        }
        return WIDE | {other: value for other, value in walls.items() if other != path}
    if path in ("limits.speed_m_s", "limits.braking_m_s2"):
        return WIDE
    return {} if Settings().uses(path) else QUADRATIC


def choices_of(key: Key) -> list[str]:
    """Return what a key with named values admits."""
    return [choice.strip('"') for choice in key.domain.split(" or ")]


def nested(values: Values) -> dict[str, Values]:
    """Return {section: {key: value}} of {"section.key": value}."""
    document: dict[str, Values] = {}
    for path, value in values.items():
        document = with_value(document, path, value)
    return document


def toml(values: Values) -> str:
    """Return TOML text of {"section.key": value}."""
    return "".join(f"{path} = {spell(value)}\n" for path, value in values.items())


def _bounds(key: Key) -> tuple[float, float]:
    assert key.low is not None
    assert key.high is not None
    return key.low, key.high


def other_value(key: Key) -> str | float:
    """Return a value of a key that is not its default."""
    default = Settings().value(key.path)
    match key.kind:
        case "one of":
            return next(choice for choice in choices_of(key) if choice != default)
        case "text":
            return "roll"
        case "whole number":
            return 3
        case _:
            return default * 0.9 or 0.1


def faults_of(text: str) -> list[str]:
    """Return the lines that `text` gets as the file slow.toml, none if its settings are valid."""
    try:
        controller_toml.parse(text, "slow.toml")
    except InvalidSettingsError as refused:
        return str(refused).splitlines()
    return []
