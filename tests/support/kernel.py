"""Chapters of the kernel, read by a C compiler as they stand in the templates."""

from pathlib import Path
from typing import Final

from mambo_codegen.bundle.products import CALL, arguments_of, form
from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings

KERNEL: Final = Path(__file__).parents[2] / "templates" / "mambo_templates" / "kernel"
CHAPTERS: Final = sorted(KERNEL.rglob("*.c"))


def parts_of(settings: Settings) -> dict[str, bool]:
    """Return the parts of a controller, by the names of their conditions."""
    context = method_of(settings).context
    return {name: bool(value) for name, value in context.items() if name.startswith("WITH_")}


def defines(parts: dict[str, bool]) -> list[str]:
    """Return the options of a compiler that define parts."""
    return ["-include", "iso646.h", *(f"-D{name}={int(is_there)}" for name, is_there in parts.items())]


def as_it_stands(settings: Settings) -> dict[str, str]:
    """Return the bundle of `settings`, whose nmpc.c has the chapters of the kernel as they stand.

    In floating point a product is a macro.
    """
    files = render(settings)
    text = files["nmpc.c"]
    chapters = [
        path.read_text("utf-8") for path in CHAPTERS if path.parent.name == method_of(settings).folder
    ]
    for chapter in chapters:
        begin = text.index(chapter.splitlines()[0])
        end = text.index("/* ---- ", begin + 1)
        text = f"{text[:begin]}{chapter}\n{text[end:]}"
    macros = "" if settings.code.scalar == "fixed" else _macros("".join(chapters))
    return files | {"nmpc.c": macros + text}


def _macros(chapters: str) -> str:
    """Return macros for the products of chapters."""
    counts = {call[1]: len(arguments_of(chapters, call.end())[1]) for call in CALL.finditer(chapters)}
    lines = []
    for name, count in counts.items():
        letters = "abcd"[:count]
        product = form(name, [f"({letter})" for letter in letters])
        lines.append(f"#define {name}({', '.join(letters)}) ({product})\n")
    return "".join(lines)
