"""Chapters of the kernel, read by a C compiler as they stand in the templates."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import jinja2

from mambo_codegen.bundle.kernel import KERNEL, KernelLoader, with_head
from mambo_codegen.bundle.products import CALL, arguments_of, form
from mambo_codegen.bundle.render import environment, render, template_context
from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings

FOLDER: Final = Path(__file__).parents[2] / "templates" / "mambo_templates" / "kernel"
CHAPTERS: Final = sorted(FOLDER.rglob("*.c"))


class PlainLoader(KernelLoader):
    """Loads chapters of the kernel with their constants, and with their conditions as they stand."""

    def get_source(
        self, environment: jinja2.Environment, template: str
    ) -> tuple[str, str, Callable[[], bool] | None]:
        """Return text, path, and what says whether the file is still the same."""
        text, path, is_current = jinja2.PackageLoader.get_source(self, environment, template)
        if template.startswith(KERNEL):
            text = with_head(text, template.split("/")[1])
        return text, path, is_current


def parts_of(settings: Settings) -> dict[str, bool]:
    """Return the parts of a controller, by the names of their conditions."""
    return {f"WITH_{name.upper()}": is_there for name, is_there in method_of(settings).presence.items()}


def defines(parts: dict[str, bool]) -> list[str]:
    """Return the options of a compiler that define parts."""
    return ["-include", "iso646.h", *(f"-D{name}={int(is_there)}" for name, is_there in parts.items())]


def as_it_stands(settings: Settings) -> dict[str, str]:
    """Return the bundle of `settings`, whose nmpc.c has the chapters of the kernel as they stand.

    In floating point a product is a macro.
    """
    plain = environment().overlay(loader=PlainLoader("mambo_templates", ""), bytecode_cache=None)
    plain.filters = plain.filters | {"infix": str}
    context = template_context(settings, with_digest=False)
    text = plain.get_template("common/nmpc.c.j2").render(context)
    return render(settings) | {
        "nmpc.c": ("" if settings.code.scalar == "fixed" else _macros(settings)) + text
    }


def _macros(settings: Settings) -> str:
    """Return macros for the products of chapters."""
    folders = ("common", method_of(settings).folder)
    chapters = "".join(path.read_text("utf-8") for path in CHAPTERS if path.parent.name in folders)
    counts = {call[1]: len(arguments_of(chapters, call.end())[1]) for call in CALL.finditer(chapters)}
    lines = []
    for name, count in counts.items():
        letters = "abcd"[:count]
        product = form(name, [f"({letter})" for letter in letters])
        lines.append(f"#define {name}({', '.join(letters)}) ({product})\n")
    return "".join(lines)
