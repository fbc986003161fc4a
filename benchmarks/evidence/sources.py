"""What figures depend on: the generated C of controllers, and git's object ids of files and folders."""

import hashlib
import os
import re
import subprocess
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any, Final

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse, with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_flight import chosen_text

ROOT: Final = Path(__file__).parents[2]
HERE: Final = "benchmarks/evidence"
FLIGHT: Final = ("sil/mambo_sil/drone", "sil/mambo_sil/flight")
STYLE: Final = "sil/mambo_sil/results/style.py"
"""Paths on which many figures depend."""

_C_TOKEN: Final = re.compile(r'"(?:\\.|[^"\\\n])*"|//[^\n]*|/\*.*?\*/', re.DOTALL)
_NAMES_OF_A_BUNDLE: Final = re.compile(
    r"^#define NMPC_(?:VERSION|SETTINGS_DIGEST|SETTINGS_ID) .*|^#if !defined\(NMPC_SETTINGS_ID\).*",
    re.MULTILINE,
)
"""Lines with version and settings digest, which a new key with its default changes as well."""


_DESIGN: Final = "design "


def plain_c(source: str) -> str:
    """Return C without comments, blank lines and the spaces between words."""
    bare = _C_TOKEN.sub(lambda found: found[0] if found[0].startswith('"') else " ", source)
    return "\n".join(" ".join(line.split()) for line in bare.splitlines() if line.strip())


def _settings(source: str) -> Settings:
    """Return the settings of a preset, a file, or `design DRONE [--sensors KIND]`."""
    if source.startswith(_DESIGN):
        name, *words = source.removeprefix(_DESIGN).split()
        options: dict[str, Any] = dict(zip(words[::2], words[1::2], strict=True))
        drone = vehicle_toml.load(name)
        if "--sensors" in options:
            drone = drone.with_sensors(options["--sensors"])
        return parse(chosen_text(drone, name), source)
    return presets.load(source if source in presets.names() else str(ROOT / source))


@cache
def generated(controller: str) -> str:
    """Return update period and C of settings, without their names.

    `controller` is a preset, a file, or `design DRONE [--sensors KIND]`, with or without
    `--scalar TYPE`.
    """
    source, _, scalar = controller.partition(" --scalar ")
    settings = _settings(source)
    if scalar:
        settings = with_option(settings, "code.scalar", scalar)
    files = render(settings, with_digest=False)
    flown = [_NAMES_OF_A_BUNDLE.sub("", plain_c(files[name])) for name in ("nmpc.c", "nmpc.h")]
    return "\n".join([repr(settings.horizon.update_period_s), *flown])


def controller_digests(controllers: Iterable[str]) -> dict[str, str]:
    """Return 16 hexadecimal digits of the SHA-256 of the C of each controller."""
    return {name: hashlib.sha256(generated(name).encode()).hexdigest()[:16] for name in controllers}


def object_ids(paths: Iterable[str]) -> dict[str, str]:
    """Return git's ids of files and folders as they are in the working tree, committed or not.

    An index of its own takes them, so that the index of the repository stays as it is.
    """
    paths = sorted(paths)
    with tempfile.TemporaryDirectory() as folder:
        index = {"GIT_INDEX_FILE": f"{folder}/index"}
        git("add", "--all", "--", *paths, **index)
        tree = git("write-tree", **index)
    return dict(zip(paths, git("rev-parse", *(f"{tree}:{path}" for path in paths)).split(), strict=True))


def git(*arguments: str, **variables: str) -> str:
    """Return what a git command prints in the repository."""
    ran = subprocess.run(
        ["git", *arguments],
        cwd=ROOT,
        env=os.environ | variables,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return ran.stdout.strip()
