"""A key of a file of settings: what messages and comments say of it, from its JSON schema."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Key:
    """One setting: its dotted path, its description and its allowed values.

    `kind` is "whole number", "number", "numbers", "one of" or "text"; `domain` says in words which values are
    allowed; `rule` follows "must" in a message; `low` and `high` bound a number and are None for text.
    """

    path: str
    description: str
    kind: str
    domain: str
    rule: str
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Refusal:
    """Why a joint rule refuses settings: the key to change, and the rule that it breaks."""

    section: str
    name: str
    rule: str


def spell(value: object) -> str:
    """Spell a setting's value as TOML: a number as its shortest decimal, text in quotes."""
    if isinstance(value, float):
        return repr(value).replace("e-0", "e-")
    return f'"{value}"' if isinstance(value, str) else str(value)


@dataclass(frozen=True)
class Form:
    """A kind of file with sections: descriptions of sections, and keys, both by dotted path.

    `kinds` are the sections whose key `kind` decides which others they have; `renamed` are keys of before,
    with what a message says of each.
    """

    sections: Mapping[str, str]
    keys: Mapping[str, Key]
    kinds: frozenset[str] = frozenset()
    renamed: Mapping[str, str] = field(default_factory=dict)


def key_of(path: str, schema: dict[str, Any]) -> Key:
    """Return the key at `path` from its JSON schema."""
    description = schema["description"]
    if "enum" in schema or "const" in schema:
        choices = " or ".join(spell(choice) for choice in schema.get("enum") or [schema["const"]])
        return Key(path, description, "one of", choices, f"be {choices}")
    if "pattern" in schema:
        words = f"lower-case letters, digits and single inner underscores, at most {schema['maxLength']}"
        return Key(path, description, "text", words, f"be {words}, a letter first")
    if "prefixItems" in schema:
        low, high = (schema["prefixItems"][0][bound] for bound in ("minimum", "maximum"))
        domain = f"{len(schema['prefixItems'])} numbers in {low:.10g}..{high:.10g}"
        return Key(path, description, "numbers", domain, f"be {domain}")
    low, high = schema["minimum"], schema["maximum"]
    kind = "whole number" if schema["type"] == "integer" else "number"
    if "not" in schema:
        domain = f"0 or {schema['not']['exclusiveMaximum']:.10g}..{high:.10g}"
        return Key(path, description, kind, domain, f"be {domain}", low, high)
    domain = f"{spell(low)}..{high:.10g}"
    return Key(path, description, kind, domain, f"lie in {domain}", low, high)
