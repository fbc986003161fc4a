"""Two small bundles; files put into a folder, and read from it."""

from collections.abc import Mapping
from pathlib import Path

from mambo_codegen.bundle import bundle
from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings.model import Settings

FILES = {
    "README.md": "What.\n",
    "include/nmpc.h": "#pragma once\n",
    "src/nmpc.c": "int x;\n",
    "src/a.c": "µ\n",
}
NEXT = {"README.md": "What.\n", "include/nmpc.h": "/* next */\n", "src/nmpc.c": "int x;\n", "src/b.c": "\n"}


def place(files: Mapping[str, str], folder: Path) -> Path:
    """Write `files`, {relative path: text}, into `folder`, and return it."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, "utf-8")
    return folder


def write_target(name: str, settings: Settings, folder: Path) -> Path:
    """Write the firmware target `name` for `settings` into `folder`, and return it."""
    return place(render_target(settings, find_target(name), with_digest=False), folder)


def content(folder: Path) -> dict[str, bytes]:
    """Return {relative path: bytes} of every file in `folder`, hidden ones included."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def expected(files: dict[str, str]) -> dict[str, bytes]:
    """Return what a folder holds that holds the bundle `files` alone."""
    return {path: text.encode() for path, text in {**files, "manifest.json": bundle.manifest(files)}.items()}
