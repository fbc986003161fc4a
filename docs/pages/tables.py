"""Tables of Markdown."""

from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of Markdown; a bar in a cell is escaped."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", r"\|") for cell in line) + " |" for line in lines)


def plain(text: str) -> str:
    """Return `text` with the characters that Markdown or HTML would take for markup escaped."""
    for character in "\\*<>[]":
        text = text.replace(character, f"&#{ord(character)};")
    return text


def code(text: str) -> str:
    """Return `text` as code, bars included, or nothing if it is empty."""
    return f"`{text}`" if text else ""
