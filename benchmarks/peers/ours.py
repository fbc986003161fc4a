"""Our controller as a contender."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.peers.problem import STEP_S
from benchmarks.peers.programs import Program
from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings

ONE_NORM: Final = with_option(presets.load("mambo-1norm"), "target.acceleration", "none")
"""Preset mambo-1norm without its tracker: the lags of the Mambo, and targets as the peers know them."""

PEERS_MODEL: Final = with_option(presets.load("table1"), "horizon.prediction_step_s", STEP_S)
"""Settings of the peers' problem: preset table1 with their prediction step."""


@dataclass(frozen=True, kw_only=True)
class Ours(Program):
    """A program with the bundle of `settings`."""

    settings: Settings

    def write(self, folder: Path) -> dict[str, str]:
        """Write the bundle."""
        for path, text in render(self.settings).items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, "utf-8")
        return {}


def bundle(name: str, title: str, settings: Settings) -> Ours:
    """Return the program of our controller with `settings`."""
    return Ours(
        name=name,
        title=title,
        cost="1-norm",
        scalar=settings.code.scalar,
        sources=("nmpc*.c",),
        includes=(".",),
        glue="glue/ours.c",
        settings=settings,
    )
