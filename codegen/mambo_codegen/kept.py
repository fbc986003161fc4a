"""Keep results that take long to compute: shipped as data for presets, else in the user's cache.

A result is found by a hash of its inputs and a hash of the source that computes it: after a change of either
it is not found, and is computed again. A cache that is missing, damaged or unwritable costs time only.
`make generated` writes the shipped results.
"""

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterator
from functools import lru_cache
from importlib import resources
from importlib.resources.abc import Traversable
from typing import Any, Final

from mambo_codegen.user_cache import read_cached, write_cached

SOURCES: Final = (
    "bundle/digest.py",
    "bundle/draws.py",
    "bundle/episodes.py",
    "methods",
    "numbers",
    "port",
    "settings",
)
"""Files and folders of this package whose source determines the results."""

SHIPPED: Final = "data/kept.json"

_recorded: dict[str, Any] | None = None
"""Results by key while `record` computes all of them, else None."""


def keep(name: str, inputs: object, compute: Callable[[], Any]) -> Any:
    """Return what `compute` returns: kept from earlier, else computed and kept.

    `name` and `inputs` determine the result; JSON can represent both. Passes on what `compute` raises.
    """
    key = _digest(json.dumps([name, inputs]))
    if _recorded is not None:
        _recorded[key] = compute()
        return _recorded[key]
    text = _shipped().get(key) or _remembered.get(key)
    if text is None:
        name = _digest(source_digest() + key)
        cached = read_cached("kept", name)
        text = cached.decode() if cached else json.dumps(compute())
        if not cached:
            write_cached("kept", name, text.encode())
        _remembered[key] = text
    return json.loads(text)


@contextlib.contextmanager
def record() -> Iterator[dict[str, Any]]:
    """Yield a dictionary to which every `keep` of the block adds its result, computed, by key."""
    global _recorded  # noqa: PLW0603 - the data are written by one thread
    _recorded = {}
    try:
        yield _recorded
    finally:
        _recorded = None


@lru_cache
def source_digest() -> str:
    """Return a hash of the source that determines the results."""
    hasher = hashlib.sha256()

    def update(entry: Traversable) -> None:
        if entry.is_dir():
            for inner in sorted(entry.iterdir(), key=lambda one: one.name):
                update(inner)
        elif entry.name.endswith(".py"):
            hasher.update(f"{entry.name}\0".encode() + entry.read_bytes() + b"\0")

    for source in SOURCES:
        update(resources.files("mambo_codegen").joinpath(source))
    return hasher.hexdigest()


def shipped_text(results: dict[str, Any]) -> str:
    """Return the text of `SHIPPED` with results by key."""
    lines = ",\n".join(f"  {json.dumps(key)}: {json.dumps(results[key])}" for key in sorted(results))
    return f'{{\n "source": "{source_digest()}",\n "results": {{\n{lines}\n }}\n}}\n'


_remembered: Final[dict[str, str]] = {}
"""Results of this process as JSON, by key."""


@lru_cache
def _shipped() -> dict[str, str]:
    """Return the shipped results as JSON, by key; none if they were made from other source."""
    try:
        document = json.loads(resources.files("mambo_codegen").joinpath(SHIPPED).read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    if document["source"] != source_digest():
        return {}
    return {key: json.dumps(value) for key, value in document["results"].items()}


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]
