"""What figures depend on: sources without comments, imported modules, the generated C."""

import ast
import hashlib
import io
import re
import tokenize
import tomllib
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option

ROOT: Final = Path(__file__).parents[2]

INERT: Final = (
    *(f"mambo_codegen.{name}" for name in ("atomic", "bundle", "design", "errors", "methods", "plain_file")),
    *(f"mambo_codegen.{name}" for name in ("numbers.literals", "reference", "settings", "toolchain")),
    *("mambo_sil.errors", "mambo_sil.results"),
    *(f"mambo_sil.experiment.campaign.{name}" for name in ("executors", "store")),
)
"""Modules and packages without influence on a figure: they name, store, format or distribute.

Settings and what is derived from them have one by the generated C, which is looked at itself.
"""

_VERSION: Final = "mambo_codegen"
"""The package that holds the version, which is no figure either."""

_C_TOKEN: Final = re.compile(r'"(?:\\.|[^"\\\n])*"|//[^\n]*|/\*.*?\*/', re.DOTALL)
_NAMES_OF_A_BUNDLE: Final = re.compile(
    r"^#define NMPC_(?:VERSION|SETTINGS_DIGEST|SETTINGS_ID) .*|^#if !defined\(NMPC_SETTINGS_ID\).*",
    re.MULTILINE,
)
"""Lines with version and settings digest, which a new key with its default changes as well."""
_NOT_FLOWN: Final = ("nmpc_self_test",)


def digest_of(texts: Iterable[str]) -> str:
    """Return 16 hexadecimal digits of the SHA-256 of texts, in their order."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


def plain_python(source: str) -> str:
    """Return Python without comments, docstrings, blank lines and trailing spaces.

    Any version of Python gives the same text, which is not so of `ast.dump`.
    """
    lines = source.split("\n")
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column]
    for node in ast.walk(ast.parse(source)):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            first, last = node.lineno - 1, node.end_lineno or node.lineno
            if not lines[first][: node.col_offset].strip():
                lines[first:last] = [""] * (last - first)
    return "\n".join(line.rstrip() for line in lines if line.strip())


def plain_c(source: str) -> str:
    """Return C without comments, blank lines and the spaces between words."""
    bare = _C_TOKEN.sub(lambda found: found[0] if found[0].startswith('"') else " ", source)
    return "\n".join(" ".join(line.split()) for line in bare.splitlines() if line.strip())


@cache
def plain(path: Path) -> str:
    """Return a file's text without what only a reader sees, by its kind: Python, C, TOML."""
    text = path.read_text("utf-8")
    match path.suffix:
        case ".py":
            return plain_python(text)
        case ".c" | ".h":
            return plain_c(text)
        case ".toml":
            return repr(tomllib.loads(text))
    raise ValueError(f"{path}: a source of evidence must be Python, C or TOML")


@cache
def _module_path(module: str) -> Path | None:
    """Return the file of a module of ours, None if there is no such module."""
    inside = module.replace(".", "/")
    stems = [ROOT / folder / inside for folder in ("", "codegen", "sil")]
    found = [path for stem in stems for path in (stem.with_suffix(".py"), stem / "__init__.py")]
    return next((path for path in found if path.is_file()), None)


@cache
def _imported(path: Path) -> frozenset[str]:
    """Return the modules of ours that a module imports, anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return frozenset(
        name for name in names if name.startswith(("mambo_codegen.", "mambo_sil.", "benchmarks."))
    )


def reached(modules: Iterable[str]) -> set[Path]:
    """Return the files of modules and of all that they import, with the C beside them.

    Of `INERT` ones only those in `modules`. Raises ValueError if a module does not exist.
    """
    waiting, files = list(modules), set()
    for module in waiting:
        if _module_path(module) is None:
            raise ValueError(f"{module}: there is no such module")
    while waiting:
        path = _module_path(waiting.pop())
        if path is not None and path not in files:
            files |= {path, *path.parent.glob("*.[ch]")}
            waiting += [name for name in _imported(path) if not _is_inert(name)]
    return files


def _is_inert(module: str) -> bool:
    return module == _VERSION or any(f"{module}.".startswith(f"{name}.") for name in INERT)


@cache
def generated(controller: str) -> str:
    """Return the C of a preset or a file, as `mambo --scalar fixed`, without its names."""
    source, _, scalar = controller.partition(" --scalar ")
    settings = presets.load(source if source in presets.names() else str(ROOT / source))
    if scalar:
        settings = with_option(settings, "code.scalar", scalar)
    flown = {
        path: _NAMES_OF_A_BUNDLE.sub("", plain_c(text))
        for path, text in render(settings, with_digest=False).items()
        if path.startswith(("src/", "include/")) and not Path(path).name.startswith(_NOT_FLOWN)
    }
    return "\n".join([repr(settings.horizon.update_period_s), *(flown[path] for path in sorted(flown))])


def parts(
    controllers: Iterable[str], modules: Iterable[str], data: Iterable[str], commands: Iterable[str]
) -> dict[str, str]:
    """Return the digests of what figures depend on: each folder, each controller, and the commands.

    modules: entry points, with all that they import. data: patterns of files below the repository.
    """
    files = reached(modules)
    for pattern in data:
        found = set(ROOT.glob(pattern))
        if not found:
            raise ValueError(f"{pattern}: there is no such file")
        files |= found
    folders: dict[str, list[Path]] = {}
    for path in sorted(files):
        folders.setdefault(path.parent.relative_to(ROOT).as_posix(), []).append(path)
    return {
        "commands": digest_of(commands),
        **{f"controller {name}": digest_of([generated(name)]) for name in controllers},
        **{
            folder: digest_of(text for path in paths for text in (path.name, plain(path)))
            for folder, paths in folders.items()
        },
    }
