"""Our controller, and a plain roll-out of it, as contenders."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from benchmarks.problem import STEP_S
from benchmarks.programs import Program
from mambo_codegen.bundle.render import render
from mambo_codegen.numbers.literals import real
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


def rollout(name: str, title: str, settings: Settings) -> Ours:
    """Return the program of the plain roll-out; it supports only rprop+ and the exact position update."""
    step_s, model = settings.horizon.prediction_step_s, settings.model
    lags_s = model.roll_lag_s, model.pitch_lag_s
    decay = [math.exp(-step_s / lag_s) if lag_s else 0.0 for lag_s in lags_s]
    speed_s = [lag_s * (1 - left) for lag_s, left in zip(lags_s, decay, strict=True)]
    shift_s2 = [lag_s * (step_s - lack) for lag_s, lack in zip(lags_s, speed_s, strict=True)]
    tables = {"DECAY": decay, "SPEED_LACK": speed_s, "SHIFT_LACK": shift_s2}
    return replace(
        bundle(name, title, settings),
        sources=(),
        glue="rollout.c",
        defines=(
            f"ROLLOUT_HAS_LAG={int(any(lags_s))}",
            f"ROLLOUT_KEEPS_PLAN={int(settings.optimizer.warm_start == 'plan')}",
            *(
                f"ROLLOUT_{table}={{{','.join(real(value, settings.code.scalar) for value in values)}}}"
                for table, values in tables.items()
            ),
        ),
    )
