"""The commands that generate C: init, presets, schema, generate."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen.bundle.targets import TARGETS, complete_targets, find_target
from mambo_codegen.errors import DriftError, echo
from mambo_sil.cli.command import (
    AsJson,
    OptionalSource,
    OutputFile,
    Overwrite,
    Scalar,
    complete_presets,
    examples,
    load,
    output_option,
    write_file,
)

if TYPE_CHECKING:
    from mambo_codegen.bundle.bundle import Changes, Drift
    from mambo_codegen.settings.model import Settings


def register(app: typer.Typer) -> None:
    """Add the commands of this module to `app`."""
    app.command(
        epilog=examples(
            "mambo-nmpc init", "mambo-nmpc init table1 -o paper.toml", "mambo-nmpc init -o - | less"
        )
    )(init)
    app.command(name="presets")(list_presets)
    app.command(epilog=examples("mambo-nmpc schema > controller.schema.json"))(schema)
    app.command(
        epilog=examples(
            "mambo-nmpc generate -o controller",
            "mambo-nmpc generate controller.toml -o controller --prefix roll_pitch",
            "mambo-nmpc generate controller.toml -o controller --check",
            "mambo-nmpc generate --for crazyflie -o app",
        )
    )(generate)


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
    """Write a controller.toml that holds and explains every setting."""
    from mambo_codegen.settings import controller_toml, presets
    from mambo_codegen.settings.toml_file import PRESETS

    text = controller_toml.to_toml(presets.preset(preset), PRESETS.description(preset))
    if write_file(text, output, force=force):
        name = echo(str(output))
        typer.echo(f"wrote {name}; next: mambo-nmpc generate {name} -o controller", err=True)


def list_presets(as_json: AsJson = False) -> None:
    """List the presets and their purpose."""
    from mambo_codegen.settings.toml_file import PRESETS

    described = {name: PRESETS.description(name) for name in PRESETS.names()}
    if as_json:
        typer.echo(json.dumps(described, indent=2))
        return
    width = max(map(len, described))
    for name, description in described.items():
        typer.echo(f"{name:<{width}}  {description}")


def schema() -> None:
    """Print the JSON schema of controller.toml; editors check and complete TOML with it."""
    from mambo_codegen.settings.model import Settings

    typer.echo(json.dumps(Settings.json_schema(), indent=2))


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
            help=f"Write a folder that builds for: {', '.join(TARGETS)}.",
            metavar="TARGET",
            autocompletion=complete_targets,
        ),
    ] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="Write nothing; exit 1 with a diff if the folder is not up to date."),
    ] = False,
    prefix: Annotated[str | None, typer.Option(help="Prefix of public names (code.prefix).")] = None,
    scalar: Scalar = None,
    amalgamate: Annotated[
        bool, typer.Option("--amalgamate", help="Join the C into one header and one source.")
    ] = False,
    force: Annotated[
        bool,
        typer.Option("--force", help="Overwrite files edited by hand; other files in the folder stay."),
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print what would change and write nothing.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Generate the C of a controller into a folder, with --for one that builds for a drone or a tool."""
    from mambo_codegen.bundle import bundle
    from mambo_codegen.bundle.render import render, render_target
    from mambo_codegen.settings import controller_toml

    if check and (force or dry_run):
        raise typer.BadParameter("it writes nothing: leave out --force and --dry-run", param_hint="--check")
    if amalgamate and target is not None:
        raise typer.BadParameter("--for decides the layout: leave one of them out", param_hint="--amalgamate")
    wanted = None if target is None else find_target(target)
    settings = load(source or (wanted.preset if wanted else "mambo"), scalar)
    if prefix is not None:
        settings = controller_toml.with_option(settings, "code.prefix", prefix, "--prefix")
    files = render_target(settings, wanted) if wanted else render(settings, amalgamate=amalgamate)
    if check:
        _report_drifts(bundle.check(files, output, target), output, as_json=as_json)
    else:
        changes = bundle.write(files, output, target, force=force, dry_run=dry_run)
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
