"""The picture of a comparison: the answers of both controllers to a step."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from mambo_sil.experiment.compare.compared_flights import STEP_M, along_step_m
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import STEP_TIME_S
from mambo_sil.results.pictures import save
from mambo_sil.results.style import COLUMN_INCHES, COMMAND, FLOWN, TARGET, style

_SHOWN_S = (-0.2, 5.0)


def draw_steps(a: Trace, b: Trace, names: tuple[str, str], stem: Path) -> tuple[Path, Path]:
    """Draw two traces of `Answers.steps`; write stem.png and stem.svg."""
    with style():
        return save(_figure(a, b, names), stem)


def _figure(a: Trace, b: Trace, names: tuple[str, str]) -> Figure:
    figure = Figure(figsize=(2.2 * COLUMN_INCHES, 4.6), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(3, 2))
    looks = ((FLOWN, "solid"), (COMMAND, (0, (4, 1.5))))
    for axis, (positions, commands) in enumerate(panels.T):
        positions.plot(
            [_SHOWN_S[0], 0.0, 0.0, _SHOWN_S[1]], [0.0, 0.0, STEP_M, STEP_M], color=TARGET, label="target"
        )
        for trace, letter, name, (colour, dashes) in zip((a, b), "AB", names, looks, strict=True):
            time_s = trace.time_s - STEP_TIME_S
            shown = (time_s >= _SHOWN_S[0] - 1e-9) & (time_s <= _SHOWN_S[1] + 1e-9)
            look = {"color": colour, "linestyle": dashes, "label": f"{letter}: {name}"}
            positions.plot(time_s[shown], along_step_m(trace)[shown, axis], **look)
            command_rad = trace.command_rad[shown, axis, axis]
            commands.step(time_s[shown], np.degrees(command_rad), where="post", **look)
        positions.set_title(("to the right (roll)", "forward (pitch)")[axis], loc="left")
        commands.set_xlabel("time after the step, s")
    panels[0, 0].set_ylabel("position, m")
    panels[1, 0].set_ylabel("command, degrees")
    panels[0, 1].legend(loc="lower right")
    return figure
