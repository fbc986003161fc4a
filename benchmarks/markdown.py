"""Markdown tables."""

from collections.abc import Sequence


def table(rows: Sequence[dict[str, str]]) -> str:
    """Return a table of rows by column; the longest row has all columns, in their order."""
    head = max((list(row) for row in rows), key=len)
    cells = [head, ["---"] * len(head), *([row.get(name, "") for name in head] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)
