"""The picture of a replay: logged and replayed commands, and their difference."""

from pathlib import Path

from markupsafe import Markup
from matplotlib.figure import Figure

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.replay.log_replay import AXES, read_curves
from mambo_sil.results.pictures import inline, save
from mambo_sil.results.style import BROAD, COLUMN_INCHES, COMMAND, FLOWN, THIN, style


def draw_replay(curves: Path, stem: Path) -> tuple[Path, Path]:
    """Draw the curves of a replay.csv; write stem.png and stem.svg. Raises ResultsError."""
    with style():
        return save(_figure(read_curves(curves)), stem)


def replay_panel(curves: Path) -> Markup:
    """Return the same picture for a page; raises ResultsError."""
    with style():
        return inline(
            _figure(read_curves(curves)),
            "Commands over time: of the log and of the replay, and their difference",
        )


def _figure(table: FloatArray) -> Figure:
    """Draw the table of `read_curves`: a column an axis."""
    axes = table.shape[1] // 2
    figure = Figure(figsize=((0.2 + axes) * COLUMN_INCHES, 4.2), layout="constrained")
    panels = figure.subplots(2, axes, sharex=True, squeeze=False, height_ratios=(2, 1))
    time_s, logged, replayed = table[:, 0] - table[0, 0], table[:, 1 : 1 + axes], table[:, 1 + axes :]
    for axis, (commands, differences) in enumerate(panels.T):
        commands.plot(time_s, logged[:, axis], color=COMMAND, linewidth=BROAD, label="logged")
        commands.plot(time_s, replayed[:, axis], color=FLOWN, linewidth=THIN, label="replayed")
        commands.set_title(f"{AXES[axis].name} command, {AXES[axis].unit}", loc="left")
        differences.plot(time_s, replayed[:, axis] - logged[:, axis], color=FLOWN, linewidth=THIN)
        differences.set_xlabel("time, s")
    panels[0, 0].set_ylabel("command")
    panels[1, 0].set_ylabel("difference")
    panels[0, -1].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, borderaxespad=0.1)
    return figure
