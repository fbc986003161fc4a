"""The commands on the page of the command line, from the application itself."""

from typing import Any, Final

import typer
from typer.core import TyperGroup
from typer.main import get_command

from docs.pages.tables import code, plain, table
from mambo_sil.cli.app import app

EXAMPLES: Final = "Examples:"


def command_part() -> str:
    """Return what the code writes on the page: a section for each command, in the order of the help."""
    root = get_command(app())
    assert isinstance(root, TyperGroup)
    context = typer.Context(root, info_name="mambo-nmpc")
    parts = [table(["option", "what it is for"], _records(root, context, "option"))]
    parts += [f"\n{line}" for line in _paragraphs(root.epilog) if line.startswith("Exit codes")]
    for name, command in root.commands.items():
        inside = typer.Context(command, info_name=f"mambo-nmpc {name}")
        usage = " ".join(["mambo-nmpc", name, *command.collect_usage_pieces(inside)])
        parts += [f"\n## {name}\n", plain(" ".join((command.help or "").split())) + "\n"]
        parts += [f"```text\n{usage}\n```\n"]
        for kind in ("argument", "option"):
            if rows := _records(command, inside, kind):
                parts += [table([kind, "what it is for"], rows) + "\n"]
        lines = _paragraphs(command.epilog)
        if shown := [line for line in lines if line.startswith("mambo-nmpc ")]:
            parts += ["```text\n" + "\n".join(shown) + "\n```\n"]
        parts += [plain(line) + "\n" for line in lines if line not in shown and line != EXAMPLES]
    return "\n".join(parts) + "\n"


def _paragraphs(text: str | None) -> list[str]:
    return [line for line in (text or "").split("\n\n") if line]


def _records(command: Any, context: typer.Context, kind: str) -> list[list[str]]:
    """Return name and explanation of the arguments or the options of a command, as its help has them."""
    rows = []
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if record is not None and parameter.param_type_name == kind:
            rows.append([code(record[0]), plain(" ".join(record[1].split()))])
    return rows
