"""The margins of a controller as text."""

import textwrap
from collections.abc import Iterator

from mambo_codegen.errors import echo
from mambo_sil.experiment.margins.margin_figures import figure_table
from mambo_sil.experiment.margins.margins_record import ManyDrones, MarginsSummary

_WIDE, _COLUMN = 50, 10
_PAGE = 110
_INFINITE = "\N{INFINITY}"
_DASH = "\N{EN DASH}"


def margins_text(summary: MarginsSummary) -> str:
    """Format the margins of a controller."""
    state = "the true state" if summary.sensors == "none" else f"sensors {summary.sensors}"
    period = f"{1e3 * summary.update_period_s:g} ms an update"
    lines = [f"{echo(summary.source)} on {echo(summary.vehicle)}, {state}, {period}", ""]
    if summary.axes is not None:
        lines.append(_line("broken at", *(axis.axis for axis in summary.axes), ""))
        lines += [_line(name, *values, unit) for name, values, unit in figure_table(summary.axes)]
        lines.append("")
    if summary.many is not None:
        lines += [*_spread_lines(summary.many), ""]
    return "\n".join([*lines, *(textwrap.fill(one, _PAGE) for one in summary.verdicts)])


def _spread_lines(many: ManyDrones) -> Iterator[str]:
    yield f"{many.drones} drones, {many.origin}; {many.unstable} unstable"
    yield _line("", "worst", "median", "drone with the worst")
    yield from (_line(*row) for row in many.table)
    changed = ", ".join(f"{name} = {_spelled(value)}" for name, value in many.worst_values.items())
    yield textwrap.fill(f"drone {many.worst_drone}: {changed}", _PAGE)


def _spelled(value: float | str) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _line(name: str, *cells: str) -> str:
    *values, note = cells
    return (f"{name:<{_WIDE}}" + "".join(f"{value:>{_COLUMN}}" for value in values) + f"  {note}").rstrip()
