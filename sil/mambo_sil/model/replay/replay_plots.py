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
            "Roll and pitch command over time: of the log and of the replay, and their difference",
        )


def _figure(table: FloatArray) -> Figure:
    """Draw the table of `read_curves`: a column an axis."""
    figure = Figure(figsize=(2.2 * COLUMN_INCHES, 4.2), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(2, 1))
    time_s, logged_rad, replayed_rad = table[:, 0] - table[0, 0], table[:, 1:3], table[:, 3:]
    for axis, (commands, differences) in enumerate(panels.T):
        commands.plot(time_s, logged_rad[:, axis], color=COMMAND, linewidth=BROAD, label="logged")
        commands.plot(time_s, replayed_rad[:, axis], color=FLOWN, linewidth=THIN, label="replayed")
        commands.set_title(f"{AXES[axis]} command", loc="left")
        differences.plot(time_s, replayed_rad[:, axis] - logged_rad[:, axis], color=FLOWN, linewidth=THIN)
        differences.set_xlabel("time, s")
    panels[0, 0].set_ylabel("command, rad")
    panels[1, 0].set_ylabel("difference, rad")
    panels[0, 1].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, borderaxespad=0.1)
    return figure
