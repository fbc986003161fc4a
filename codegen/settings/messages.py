"""Turn the errors of pydantic into one sentence per fault: key, value, rule and fix."""

import difflib
import json
import math
import re
from collections.abc import Mapping

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from mambo_nmpc.codegen.errors import echo, echo_value
from mambo_nmpc.codegen.settings.keys import KEYS, SECTIONS, Key


def faults(error: ValidationError, document: Mapping[str, object]) -> tuple[str, ...]:
    """Return one sentence for each fault of `document`, without the name of its source."""
    return tuple(
        _fault(details, document) for details in error.errors(include_url=False, include_context=False)
    )


def _fault(details: ErrorDetails, document: Mapping[str, object]) -> str:
    """Name the wrong key and its value, and say what to write instead."""
    names = [str(part) for part in details["loc"]]
    dotted = ".".join(_spell_name(name) for name in names)
    if details["type"] == "extra_forbidden":
        return _unknown(names, dotted)
    value = details["input"]
    if len(names) == 1:
        return f"{dotted} = {_spell_value(value)} must be a section; write [{dotted}] and its keys below"
    key = KEYS[dotted]
    section = document.get(names[0])
    default = "" if isinstance(section, Mapping) and names[1] in section else " (the default)"
    return f"{dotted} = {_spell_value(value)}{default} {_rule(details, key)}"


def _rule(details: ErrorDetails, key: Key) -> str:
    """Return the rule that the value breaks, for most errors from "must" on."""
    value = details["input"]
    match details["type"]:
        case "int_type" | "float_type" if not (isinstance(value, int) and not isinstance(value, bool)):
            return f"must be a {key.kind} and {key.rule}"
        case "int_type" | "float_type" | "less_than_equal" | "greater_than_equal":
            return f"must {key.rule}{_unit_hint(value, key)}"
        case "finite_number":
            return f"must be a finite number; it must {key.rule}"
        case "literal_error" | "string_type" | "string_pattern_mismatch" | "string_too_long":
            return f"must {key.rule}"
        case _:
            return details["msg"]


def _unit_hint(value: float, key: Key) -> str:
    """Return a hint if the number fits in Hz instead of seconds, or in degrees instead of radians."""
    if key.low is None or key.high is None or not key.high < value < 1e6:
        return ""
    if key.path.endswith(("_period_s", "_step_s")) and key.low <= 1 / value <= key.high:
        return f"; it is a period in seconds: for {value:g} Hz write {1 / value:.3g}"
    if key.path.endswith("_rad") and key.low <= math.radians(value) <= key.high:
        return f"; it is in radians: for {value:g} degrees write {math.radians(value):.3g}"
    return ""


def _unknown(names: list[str], dotted: str) -> str:
    """Say that a section or key does not exist, and name the most similar one."""
    if len(names) == 1:
        return f"{dotted} is not a section{_suggestion(names[0], list(SECTIONS))}"
    siblings = [path.removeprefix(f"{names[0]}.") for path in KEYS if path.startswith(f"{names[0]}.")]
    return f"{dotted} is not a setting{_suggestion(names[1], siblings)}"


def _suggestion(name: str, siblings: list[str]) -> str:
    """Suggest a similar sibling of `name`, else the same key of another section, else list the siblings."""
    elsewhere = [path for path in KEYS if path.endswith(f".{name}")]
    near = difflib.get_close_matches(name, siblings, n=1) or elsewhere[:1]
    return f"; did you mean {near[0]}?" if near else f"; there are {', '.join(siblings)}"


def _spell_name(name: str) -> str:
    """Spell a key as TOML, without quotes if possible."""
    return echo(name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False))


def _spell_value(value: object) -> str:
    """Spell a value as TOML, shortened; a table or list only as its type."""
    match value:
        case dict():
            return "a table"
        case list():
            return "a list"
        case str() | int():
            return echo_value(value)
        case _:
            return echo(str(value))
