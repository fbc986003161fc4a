"""Turn the errors of pydantic into one sentence per fault: key, value, rule and fix."""

import difflib
import json
import math
import re
from collections.abc import Iterable, Mapping

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from mambo_codegen.errors import echo, echo_value
from mambo_codegen.settings.key import Form, Key


def faults(error: ValidationError, document: Mapping[str, object], form: Form) -> tuple[str, ...]:
    """Return one sentence for each fault of `document`, without the name of its source."""
    return tuple(
        _fault(details, document, form) for details in error.errors(include_url=False, include_context=False)
    )


def _fault(details: ErrorDetails, document: Mapping[str, object], form: Form) -> str:
    """Name the wrong key and its value, and say what to write instead."""
    names = [str(part) for part in details["loc"]]
    if names[0] in form.kinds:
        del names[1:2]  # pydantic adds the kind
    dotted = ".".join(_spell_name(name) for name in names)
    value = details["input"]
    match details["type"]:
        case "extra_forbidden":
            return _unknown(names, dotted, form)
        case "missing" if dotted in form.sections:
            return f"{dotted} is missing; write [{dotted}] and its keys below: {form.sections[dotted]}"
        case "missing" | "union_tag_not_found" if isinstance(value, Mapping):
            key = form.keys[dotted if details["type"] == "missing" else f"{dotted}.kind"]
            return f"{key.path} is missing; add it, it must {key.rule}: {key.description}"
        case "union_tag_invalid":
            key = form.keys[f"{dotted}.kind"]
            return f"{key.path} = {_spell_value(value['kind'])} must {key.rule}"
    if dotted in form.sections:
        return f"{dotted} = {_spell_value(value)} must be a section; write [{dotted}] and its keys below"
    key = form.keys[dotted]
    default = "" if _is_given(names, document) else " (the default)"
    return f"{dotted} = {_spell_value(value)}{default} {_rule(details, key)}"


def _is_given(names: list[str], document: object) -> bool:
    """Return whether `document` itself has a value at the path `names`."""
    for name in names:
        if not isinstance(document, Mapping) or name not in document:
            return False
        document = document[name]
    return True


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
        return degrees_hint(value)
    return ""


def degrees_hint(degrees: float) -> str:
    """Return the end of a message that refuses an angle in radians which is one in degrees."""
    return f"; it is in radians: for {degrees:g} degrees write {math.radians(degrees):.4g}"


def _unknown(names: list[str], dotted: str, form: Form) -> str:
    """Say that a section or key does not exist, and name the most similar one."""
    if dotted in form.renamed:
        return f"{dotted} {form.renamed[dotted]}"
    parent = ".".join(names[:-1])
    if parent not in form.sections:
        return f"{dotted} is not a section{_suggestion(names[0], _children('', form.sections), form)}"
    siblings = _children(f"{parent}.", [*form.keys, *form.sections])
    return f"{dotted} is not a setting{_suggestion(names[-1], siblings, form)}"


def _children(prefix: str, paths: Iterable[str]) -> list[str]:
    """Return the names that follow `prefix` in `paths`, without what is below them."""
    found = (path.removeprefix(prefix) for path in paths if path.startswith(prefix))
    return [name for name in found if "." not in name]


def _suggestion(name: str, siblings: list[str], form: Form) -> str:
    """Suggest a similar sibling of `name`, else the same key of another section, else list the siblings."""
    elsewhere = [path for path in form.keys if path.endswith(f".{name}")]
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
