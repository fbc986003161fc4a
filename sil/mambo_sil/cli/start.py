"""The commands of the panel Start: init, doctor."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from mambo_codegen.errors import echo
from mambo_codegen.settings.toml_file import PRESETS
from mambo_sil.cli.options import (
    AsJson,
    OutputFile,
    Overwrite,
    complete_presets,
    write_file,
)


def init(
    preset: Annotated[
        str,
        typer.Argument(
            help="Preset to start from; `mambo-nmpc presets` lists them.", autocompletion=complete_presets
        ),
    ] = "mambo",
    output: OutputFile = Path("controller.toml"),
    force: Overwrite = False,
) -> None:
    """Write a controller.toml that holds and explains every setting.

    To begin with settings of your own.
    """
    from mambo_codegen.settings import controller_toml, presets

    text = controller_toml.to_toml(presets.preset(preset), PRESETS.description(preset))
    if write_file(text, output, force=force):
        name = echo(str(output))
        typer.echo(f"wrote {name}; next: mambo-nmpc generate {name} -o controller", err=True)


def doctor(*, as_json: AsJson = False) -> None:
    """List which compilers, emulators and analysers are installed, and what needs those that are missing.

    When a command says that a tool is missing.
    """
    from mambo_sil.board.firmware.tool_report import doctor_text, examine

    findings = examine()
    typer.echo(json.dumps([asdict(one) for one in findings], indent=2) if as_json else doctor_text(findings))
