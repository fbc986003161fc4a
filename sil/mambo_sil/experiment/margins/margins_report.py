"""The margins of a controller as text."""

from collections.abc import Iterator

from mambo_codegen.errors import echo
from mambo_sil.experiment.margins.margin_figures import figure_table
from mambo_sil.experiment.margins.margins_record import ManyDrones, MarginsSummary
from mambo_sil.results.terminal import sentence, table


def margins_text(summary: MarginsSummary) -> str:
    """Format the margins of a controller."""
    state = "the true state" if summary.sensors == "true" else f"sensors {summary.sensors}"
    period = f"{1e3 * summary.update_period_s:g} ms an update"
    lines = [sentence(f"{echo(summary.source)} on {echo(summary.vehicle)}, {state}, {period}")]
    lines += [sentence(one) for one in summary.verdicts]
    if summary.axes is not None:
        rows = [(name, *values, unit) for name, values, unit in figure_table(summary.axes)]
        heads = ("broken at", *(axis.axis for axis in summary.axes), "")
        lines += ["", *table(heads, rows, (0, -1))]
    if summary.many is not None:
        lines += ["", *_spread_lines(summary.many)]
    return "\n".join(lines)


def _spread_lines(many: ManyDrones) -> Iterator[str]:
    yield sentence(f"{many.drones} drones, {many.origin}; {many.unstable} unstable")
    yield from table(("", "worst", "median", "worst drone"), many.table, (0, -1))
    changed = ", ".join(f"{name} = {_spelled(value)}" for name, value in many.worst_values.items())
    yield sentence(f"drone {many.worst_drone}: {changed}")


def _spelled(value: float | str) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
