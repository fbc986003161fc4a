"""Settings drawn by hypothesis: any valid ones, and any valid ones but for one broken rule."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from hypothesis import strategies as st
from pydantic import ValidationError

from mambo_codegen.settings.controller_keys import KEYS
from mambo_codegen.settings.controller_toml import with_value
from mambo_codegen.settings.key import Key, spell
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.reserved import KEYWORDS, STANDARD_NAMES
from tests.support.cases import SCALARS

Values = dict[str, Any]
"""Settings by their dotted paths."""

LAGS: Values = {"model.roll_lag_s": 0.3, "model.pitch_lag_s": 0.3}
QUADRATIC: Values = LAGS | {"cost.norm": "quadratic"}
"""The fewest values that make a controller with a quadratic cost."""

RESERVED = KEYWORDS | STANDARD_NAMES
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
        "code.scalar": draw(st.sampled_from(["float32", "float64"])),
        "code.prefix": draw(prefixes()),
    }
    choices = {
        key.path: draw(st.sampled_from(_level_choices(key))) for key in CHOICES if key.path not in constrained
    }
    free = {key.path: draw(numbers(key.path)) for key in NUMBERS if key.path not in constrained}
    drawn = constrained | choices | free | {"cost.norm": "1-norm"}
    return {path: drawn[path] for path in KEYS if Settings().uses(path)}


@st.composite
def quadratic_values(draw: st.DrawFn) -> Values:
    """Draw settings of a quadratic cost, every key that it uses free within the rules, by their dotted paths.

    The ramp alone may make a loop unstable, which is refused: see `quadratic_settings`.
    """
    values: Values = {"cost.norm": "quadratic"}
    period_s = draw(numbers("horizon.update_period_s"))
    tilt_rad = draw(numbers("limits.tilt_rad"))
    thrust_min = draw(numbers("ranges.thrust_acceleration_min_m_s2"))
    none = st.just(0.0)
    values |= {
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
    for angle in ("roll", "pitch"):
        feedback_s = draw(none | numbers(f"damping.{angle}_rate_feedback_s"))
        gain = draw(numbers(f"model.{angle}_gain"))
        largest = min(0.2, 0.999 * gain * tilt_rad)
        values |= {
            f"damping.{angle}_rate_feedback_s": feedback_s,
            f"model.{angle}_lag_s": draw(numbers(f"model.{angle}_lag_s", low=feedback_s + 0.001001)),
            f"model.{angle}_delay_s": draw(none | numbers(f"model.{angle}_delay_s", low=0.001)),
            f"model.{angle}_gain": gain,
            f"model.{angle}_trim_rad": draw(none | st.floats(-largest, largest)),
        }
    trim_rad = max(abs(values["model.roll_trim_rad"]), abs(values["model.pitch_trim_rad"]))
    per_tilt = values["model.acceleration_per_tilt"] = draw(numbers("model.acceleration_per_tilt"))
    tilted_rad = min(values["model.roll_gain"], values["model.pitch_gain"]) * tilt_rad
    values |= draw(limits(tilt_rad, 9.81 * per_tilt * (tilted_rad - trim_rad)))
    for name in ("model.drag_1_s", "observer.age_s", "cost.velocity_weight_s"):
        values[name] = draw(none | numbers(name))
    settings = Settings.model_validate(nested(QUADRATIC))
    for key in KEYS.values():
        if key.path not in values and settings.uses(key.path):
            values[key.path] = draw(
                st.sampled_from(_level_choices(key)) if key.low is None else numbers(key.path)
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
    if path in ("model.tilt", "target.acceleration") or path.startswith(("height.", "guard.thrust")):
        return SLOW
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


def _level_choices(key: Key) -> list[str]:
    """Return what a key with named values admits without a height."""
    return [choice for choice in choices_of(key) if choice != "preview"]


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


@dataclass(frozen=True)
class Broken:
    """TOML text that breaks one rule, and what the message about it says: key, value, words of the rule."""

    text: str
    key: str
    value: str
    rule: str


@st.composite
def broken_settings(draw: st.DrawFn) -> Broken:
    """Draw settings that are valid but for one rule."""
    values = draw(valid_values())
    breakers: list[Callable[[st.DrawFn, Values], Broken]] = [
        *(_beyond, _no_number, _of_another_type, _misspelt, _unknown),
        *(_steps_at_odds, _lag_at_odds, _others_at_odds),
    ]
    return draw(st.sampled_from(breakers))(draw, values)


def _with(values: Values, path: str, value: Any, rule: str, spelling: str | None = None) -> Broken:
    """Return `values` with `value` at `path`, which breaks `rule`."""
    told = spelling or (f'"{value}"' if isinstance(value, str) else str(value))
    text = toml({key: other for key, other in values.items() if key != path})
    return Broken(f"{text}{path} = {spelling or spell(value)}\n", path, f" = {told} ", rule)


def _beyond(draw: st.DrawFn, values: Values) -> Broken:
    """Put a number just or far outside its bounds."""
    key = draw(st.sampled_from(NUMBERS))
    low, high = _bounds(key)
    if key.kind == "whole number":
        beyond: float = draw(st.integers(-(10**9), int(low) - 1) | st.integers(int(high) + 1, 10**9))
    else:
        beyond = draw(
            st.sampled_from([math.nextafter(low, -math.inf), math.nextafter(high, math.inf)])
            | st.floats(max_value=low, exclude_max=True, allow_infinity=False)
            | st.floats(min_value=high, exclude_min=True, allow_infinity=False)
        )
    return _with(values, key.path, beyond, f"must {key.rule}")


def _no_number(draw: st.DrawFn, values: Values) -> Broken:
    """Put what is no finite number, or a fraction where a whole number belongs."""
    key = draw(st.sampled_from(NUMBERS))
    if key.kind == "whole number":
        fraction = draw(st.floats(1, 50))
        return _with(values, key.path, fraction, f"must be a whole number and {key.rule}")
    word = draw(st.sampled_from(["nan", "inf", "-inf"]))
    return _with(values, key.path, None, f"must be a finite number; it must {key.rule}", word)


def _of_another_type(draw: st.DrawFn, values: Values) -> Broken:
    """Put a value of a type that the key does not have."""
    key = draw(st.sampled_from(list(KEYS.values())))
    told, spelling = draw(
        st.sampled_from(
            [
                ("true", "true"),
                ("a list", "[1, 2]"),
                ("a list", "[]"),
                ("a table", "{a = 1}"),
                ("1979-05-27", "1979-05-27"),
                ('"10"', '"10"') if key.low is not None else ("10", "10"),
            ]
        )
    )
    rule = key.rule if key.low is None else f"be a {key.kind} and {key.rule}"
    broken = _with(values, key.path, None, f"must {rule}", spelling)
    return replace(broken, value=f" = {told} ")


def _misspelt(draw: st.DrawFn, values: Values) -> Broken:
    """Put a word that is none of the choices, or a prefix that is no C name."""
    letters = st.text(
        st.characters(min_codepoint=32, max_codepoint=126, exclude_characters='"\\'), max_size=40
    )
    if draw(st.booleans()):
        key = draw(st.sampled_from(CHOICES))
        word = draw(letters.filter(lambda word: word not in choices_of(key)))
        return _with(values, key.path, word, f"must {key.rule}")
    key = KEYS["code.prefix"]
    if draw(st.booleans()):
        return _with(values, key.path, draw(st.sampled_from(sorted(RESERVED))), "must not be a ")
    no_name = letters.filter(lambda word: not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", word))
    return _with(values, key.path, draw(no_name), f"must {key.rule}")


def _unknown(draw: st.DrawFn, values: Values) -> Broken:
    """Add a key or a section that does not exist, or a value where a section belongs."""
    section, _, name = draw(st.sampled_from(list(KEYS))).rpartition(".")
    what = draw(st.sampled_from(["key", "section", "no section"]))
    text = toml(values)
    if what == "no section":
        others = {path: value for path, value in values.items() if not path.startswith(f"{section}.")}
        return Broken(
            f"{toml(others)}{section} = 3\n", section, " = 3 ", f"must be a section; write [{section}]"
        )
    word = name if what == "key" else section.partition(".")[0]
    place = draw(st.integers(0, len(word) - 1))
    word = word[:place] + draw(st.sampled_from("_xyz")) + word[place:]
    if what == "key":
        return Broken(f"{text}{section}.{word} = 1\n", f"{section}.{word}", "", "is not a setting; ")
    return Broken(f"{text}{word}.{name} = 1\n", word, "", "is not a section; ")


def _steps_at_odds(draw: st.DrawFn, values: Values) -> Broken:
    """Put the first step size above the largest, or below the smallest."""
    path = draw(st.sampled_from(["optimizer.step_max_rad", "optimizer.step_min_rad"]))
    initial = draw(st.floats(1e-6, 1, exclude_min=True, exclude_max=True))
    rest = values | {
        "optimizer.initial_step_rad": initial,
        "optimizer.step_max_rad": 1.0,
        "optimizer.step_min_rad": 1e-9,
    }
    if path == "optimizer.step_max_rad":
        step = draw(st.floats(1e-6, initial, exclude_max=True))
        return _with(rest, path, step, f"must lie in {initial!r}..1 (at least optimizer.initial_step_rad)")
    step = draw(st.floats(initial, 1, exclude_min=True))
    return _with(rest, path, step, f"must lie in 1e-9..{initial!r} (at most optimizer.initial_step_rad)")


def _lag_at_odds(draw: st.DrawFn, values: Values) -> Broken:
    """Put a lag where the printed model has none, or one too short to compute with."""
    path = draw(st.sampled_from(["model.roll_lag_s", "model.pitch_lag_s"]))
    rest = values | {"model.roll_lag_s": 0.0, "model.pitch_lag_s": 0.0}
    if draw(st.booleans()):
        rest["model.position_update"] = "printed"
        lag = draw(st.floats(0.001, 2))
        return _with(rest, path, lag, 'must be 0 with model.position_update = "printed"')
    lag = draw(st.floats(0, 0.001, exclude_min=True, exclude_max=True))
    return _with(rest, path, lag, "must be 0 or lie in 0.001..2; 0 means no lag")


def _others_at_odds(draw: st.DrawFn, values: Values) -> Broken:
    """Put more moves than predictions, a largest thrust not above the smallest, or a key twice."""
    path = draw(
        st.sampled_from(["horizon.control", "ranges.thrust_acceleration_max_m_s2", *list(values)[::5]])
    )
    if path == "horizon.control":
        prediction = draw(st.integers(1, 49))
        control = draw(st.integers(prediction + 1, 50))
        rest = values | {"horizon.prediction": prediction}
        return _with(rest, path, control, f"must lie in 1..{prediction} (horizon.prediction)")
    if path == "ranges.thrust_acceleration_max_m_s2":
        least = draw(st.floats(0.1, 100))
        most = draw(st.floats(0.1, least))
        rest = values | {"ranges.thrust_acceleration_min_m_s2": least}
        return _with(rest, path, most, f"must be more than {least!r} (ranges.thrust_acceleration_min_m_s2)")
    text = toml(values)
    line = f"line {len(values) + 1}, column "
    return Broken(f"{text}{path} = 1\n", line, path, "write each section and key once")
