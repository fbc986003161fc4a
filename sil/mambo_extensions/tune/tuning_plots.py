"""The picture of a study: all trials, Pareto front, base and chosen point."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from mambo_extensions.tune.study import FinishedTrial, pareto_front
from mambo_sil.results.pictures import save
from mambo_sil.results.style import COLUMN_INCHES, DOT, FLOWN, INK, SKY, VERMILION, style


def draw_front(
    trials: Sequence[FinishedTrial], base: Sequence[FinishedTrial], best: FinishedTrial, stem: Path
) -> tuple[Path, Path]:
    """Draw IAE against command variation, both logarithmic; write stem.png and stem.svg.

    A trial without any command variation is left out, as it has no place on a logarithmic axis.
    """
    front = pareto_front(trials)
    with style():
        figure = Figure(figsize=(COLUMN_INCHES, 2.8), layout="constrained")
        axes = figure.subplots()
        for points, form, colour, label in (
            (trials, ".", SKY, "trial"),
            (front, "o-", FLOWN, "Pareto front"),
            (base, "s", INK, "base"),
            ([best], "*", VERMILION, "chosen"),
        ):
            moving = [one for one in points if one.command_variation_rad > 0.0]
            x, y = [one.command_variation_rad for one in moving], [one.iae_m_s for one in moving]
            axes.plot(x, y, form, color=colour, label=label, markersize=3.0 * DOT if form == "*" else DOT)
        axes.set(xscale="log", yscale="log", xlabel="command variation, rad an update", ylabel="IAE, m s")
        axes.legend()
        return save(figure, stem)
