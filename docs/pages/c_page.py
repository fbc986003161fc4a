"""The functions on the page of the C interface, from the comments of nmpc.h."""

import re
from collections.abc import Iterator
from textwrap import dedent
from typing import Final

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_settings import controller_text

_FUNCTION: Final = re.compile(
    r"^/\* ((?:(?!\*/).)+) \*/\n(\w[^;{}/]*?\b(nmpc_\w+)\([^;]*\);)$", re.DOTALL | re.MULTILINE
)
"""A comment, the declaration that follows it, and the name of the function."""


def c_part() -> str:
    """Return what the code writes on the page of the C interface: each function with its comment."""
    parts = []
    for name, (label, declaration, comment) in _functions().items():
        title = f"### {name}" + (f" ({label})" if label else "")
        parts += [title, f"```c\n{declaration}\n```", *_paragraphs(comment)]
    files = [f"{name} {_link(name, 'nmpc.h')} {_link(name, 'nmpc.c')}" for name in presets.names()]
    return "\n\n".join([*parts, f"The C of the presets, to read: {'; '.join(files)}."]) + "\n"


def _link(preset: str, file: str) -> str:
    """Return a link to a file that the hooks write when the site is built."""
    return f'<a href="../c/{preset}/{file}">{file}</a>'


def _functions() -> dict[str, tuple[str, str, str]]:
    """Return label, declaration and comment of each function by name, from the first bundle that has it."""
    found: dict[str, tuple[str, str, str]] = {}
    named = {label: dict(_declared(settings)) for label, settings in _bundles()}
    for label, functions in named.items():
        for name, (declaration, comment) in functions.items():
            only = "quadratic" if label == "" and name not in named["1-norm"] else label
            found.setdefault(name, (only, declaration, comment))
    return found


def _bundles() -> Iterator[tuple[str, Settings]]:
    """Yield settings, and what they have that those before have not."""
    mambo = presets.preset("mambo")
    third = parse(controller_text(vehicle_toml.preset("crazyflie"), "crazyflie"), "crazyflie")
    tilt_only = mambo.limits.model_copy(update={"speed_m_s": 0.0, "braking_m_s2": 0.0})
    yield "", mambo.model_copy(update={"limits": tilt_only})
    yield "with limits", mambo
    yield "with a height", third.model_copy(update={"guard": None})
    yield "with a guard", third
    yield "1-norm", presets.preset("mambo-1norm")


def _declared(settings: Settings) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield name, and declaration and comment, of the functions in the headers of a bundle."""
    files = render(settings, with_digest=False)
    for header in ("nmpc.h", "nmpc_self_test.h"):
        for comment, declaration, name in _FUNCTION.findall(files[header]):
            yield name, (declaration, comment)


def _paragraphs(comment: str) -> list[str]:
    """Return the paragraphs of a comment; what is indented in it is code."""
    lines = [re.sub(r"^ \* ?", "", line) for line in comment.split("\n")]
    blocks = "\n".join(lines).split("\n\n")
    return [f"```c\n{dedent(block)}\n```" if block.startswith("    ") else block for block in blocks]
