"""The commands of the panel Generate: generate, which-controller."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen.bundle.targets import complete_targets, default_source, find_target, target_names
from mambo_codegen.errors import DriftError, echo
from mambo_codegen.settings.toml_file import PRESETS
from mambo_sil.cli.options import AsJson, OptionalSource, Scalar, complete_presets, load, output_option

if TYPE_CHECKING:
    from mambo_codegen.bundle.bundle import Changes, Drift
    from mambo_codegen.settings.model import Settings


def generate(
    output: Annotated[
        Path,
        output_option("Folder of the bundle."),
    ],
    source: OptionalSource = None,
    *,
    target: Annotated[
        str | None,
        typer.Option(
            "--for",
            help=f"Write a folder that builds for: {', '.join(target_names())}.",
            metavar="TARGET",
            autocompletion=complete_targets,
        ),
    ] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="Write nothing; exit 1 with a diff if the folder is not up to date."),
    ] = False,
    prefix: Annotated[
        str | None, typer.Option(help="Prefix of public names (code.prefix).", metavar="NAME")
    ] = None,
    scalar: Scalar = None,
    force: Annotated[
        bool,
        typer.Option("--force", help="Overwrite files edited by hand; other files in the folder stay."),
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print what would change and write nothing.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Generate the C of a controller into a folder, with --for one that builds for a drone or a tool.

    When the settings fly in simulation, and shall go into a firmware.
    """
    from mambo_codegen.bundle import bundle
    from mambo_codegen.bundle.render import render, render_target
    from mambo_codegen.settings import controller_toml

    if check and (force or dry_run):
        raise typer.BadParameter("it writes nothing: leave out --force and --dry-run", param_hint="--check")
    wanted = None if target is None else find_target(target)
    if source is None:
        source = "mambo" if wanted is None else default_source(wanted)
    settings = load(source, scalar)
    if prefix is not None:
        settings = controller_toml.with_option(settings, "code.prefix", prefix, "--prefix")
    files = render_target(settings, wanted) if wanted else render(settings)
    own = PRESETS.own_file(source)  # left as it is, unless an option has changed the settings
    own = own if own and controller_toml.read(own) == settings else None
    if check:
        _report_drifts(bundle.check(files, output, target, source=own), output, as_json=as_json)
    else:
        changes = bundle.write(files, output, target, source=own, force=force, dry_run=dry_run)
        _report_changes(changes, settings, output, dry_run=dry_run, as_json=as_json)


def _report_changes(
    changes: "Changes", settings: "Settings", output: Path, *, dry_run: bool, as_json: bool
) -> None:
    if as_json:
        outcome = {"directory": str(output), "digest": settings.digest, "dry_run": dry_run, **asdict(changes)}
        typer.echo(json.dumps(outcome, indent=2))
        return
    for verb in ("created", "changed", "removed"):
        for path in getattr(changes, verb):
            typer.echo(f"{verb} {echo(path)}")
    for path in changes.edited:
        typer.echo(f"kept {echo(path)}: edited by hand, and no longer part of the bundle; delete or move it")
    would = "would be " if dry_run else ""
    state = f"{would}written" if changes.any else "unchanged"
    typer.echo(f"{echo(str(output))}: {state}, settings {settings.short_digest}", err=True)


def _report_drifts(drifts: "tuple[Drift, ...]", output: Path, *, as_json: bool) -> None:
    """Print the drifts; raises DriftError if there are any."""
    name = echo(str(output))
    if as_json:
        typer.echo(
            json.dumps({"directory": str(output), "drifts": [asdict(drift) for drift in drifts]}, indent=2)
        )
    else:
        for drift in drifts:
            typer.echo(drift.diff or f"{drift.kind} {echo(drift.path)}")
    if drifts:
        raise DriftError(f"{name}: not up to date, {len(drifts)} to write; generate it without --check")
    typer.echo(f"{name}: up to date", err=True)


def which_controller(
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
    """Show which controllers a firmware image holds; exit 1 if it has none, or lacks one of SOURCE.

    Before you flash an image, or to know what an old one flies.
    """
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
