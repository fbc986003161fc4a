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
    """Tell generator version and settings of the controllers in a firmware image; exit 1 if it has none."""
    from mambo_codegen.settings import presets
    from mambo_sil.board.firmware.identity import held_controllers, identity_text, name_settings

    held = held_controllers(image)
    known = {echo(source): presets.load_or_bundle(source) for source in sources or ()}
    known |= {f"preset {name}": presets.preset(name) for name in presets.names() if name not in known}
    held = name_settings(held, known)
    if as_json:
        typer.echo(json.dumps({"file": str(image), "controllers": [asdict(one) for one in held]}, indent=2))
    else:
        typer.echo(identity_text(held, echo(str(image))))
    if not held:
        raise typer.Exit(1)
