"""The command `identify-binary`: which controllers a firmware image holds."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.command import complete_presets
from mambo_sil.cli.options import AsJson


def identify_binary(
    image: Annotated[Path, typer.Argument(help="ELF, Intel HEX, UF2 or plain binary.", metavar="FILE")],
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            help="Controllers to compare with: controller.toml, folders of bundles; the presets always are.",
            metavar="SOURCE...",
            autocompletion=complete_presets,
        ),
    ] = None,
    *,
    as_json: AsJson = False,
) -> None:
    """Show which controllers a firmware image holds; exit 1 if it has none, or lacks one of SOURCE."""
    from mambo_codegen.settings import presets
    from mambo_sil.board.firmware.identity import held_controllers, identity_text, missing, name_settings

    held = held_controllers(image)
    given = {echo(source): presets.load_or_bundle(source) for source in sources or ()}
    known = dict(given)
    known |= {f"preset {name}": presets.preset(name) for name in presets.names() if name not in known}
    held = name_settings(held, known)
    lacking = missing(held, given)
    if as_json:
        found = {"controllers": [asdict(one) for one in held], "missing": lacking}
        typer.echo(json.dumps({"file": str(image), **found}, indent=2))
    else:
        typer.echo(identity_text(held, echo(str(image))))
    for source in lacking:
        typer.echo(f"{echo(str(image))}: does not hold the settings of {source}", err=True)
    if not held or lacking:
        raise typer.Exit(1)
