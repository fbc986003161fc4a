"""The command `doctor`: which tools are installed."""

import json
from dataclasses import asdict

import typer

from mambo_sil.cli.options import AsJson


def doctor(*, as_json: AsJson = False) -> None:
    """List which compilers, emulators and analysers are installed, and what needs those that are missing."""
    from mambo_sil.board.firmware.tool_report import doctor_text, examine

    findings = examine()
    typer.echo(json.dumps([asdict(one) for one in findings], indent=2) if as_json else doctor_text(findings))
