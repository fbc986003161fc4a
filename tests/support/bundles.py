"""Two small bundles, and what a folder holds that holds one."""

from pathlib import Path

from mambo_nmpc.codegen import bundle

FILES = {
    "README.md": "What.\n",
    "include/nmpc.h": "#pragma once\n",
    "src/nmpc.c": "int x;\n",
    "src/a.c": "µ\n",
}
NEXT = {"README.md": "What.\n", "include/nmpc.h": "/* next */\n", "src/nmpc.c": "int x;\n", "src/b.c": "\n"}


def content(folder: Path) -> dict[str, bytes]:
    """Return {relative path: bytes} of every file in `folder`, hidden ones included."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def expected(files: dict[str, str]) -> dict[str, bytes]:
    """Return what a folder holds that holds the bundle `files` alone."""
    return {path: text.encode() for path, text in {**files, "manifest.json": bundle.manifest(files)}.items()}
