"""The commands that generate C: init, presets, schema, generate; and the root that all commands share.

Results go to stdout, talk to stderr.
"""

import errno
import io
import json
import os
import sys
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from mambo_nmpc.codegen import __version__, bundle
from mambo_nmpc.codegen.atomic import put
from mambo_nmpc.codegen.errors import (
    BAD_INPUT,
    INTERRUPTED,
    NO_READER,
    DriftError,
    FileExistsRefusedError,
    MamboNmpcError,
    UnwritableError,
    echo,
)
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings import controller_toml, presets
from mambo_nmpc.codegen.settings.model import Settings

EXIT_CODES = (
    "Exit codes: 0 good; 1 a check failed or a flight was lost; 2 bad input, or the system refuses; "
    "130 interrupted; 141 nobody reads the output."
)

Scalar = Annotated[
    str | None, typer.Option(help="Type of the numbers (code.scalar).", metavar="float32|float64|fixed")
]


class RootGroup(TyperGroup):
    """The root of the command: errors become a message and an exit code, without a traceback."""

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Run a command line, help and version included, up to the last byte on stdout."""
        try:
            if sys.stdout is None:
                raise OSError(errno.EBADF, "is closed", "stdout")
            if isinstance(sys.stdout, io.TextIOWrapper):  # a letter that the terminal has not is no error
                sys.stdout.reconfigure(errors="backslashreplace")
            try:
                return super().main(*arguments, **options)
            finally:
                sys.stdout.flush()
        except OSError as error:
            sys.exit(_exit_code(error))
        except SystemExit as leaving:
            if isinstance(leaving.__context__, BrokenPipeError):  # typer and rich meet it first, and exit 1
                sys.exit(_exit_code(leaving.__context__))
            raise

    def invoke(self, ctx: typer.Context) -> object:  # type: ignore[override] # typer hides the base of Context
        """Run a command; with `--debug` an error shows its traceback first."""
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()
        except (MamboNmpcError, OSError, MemoryError, KeyboardInterrupt) as error:
            if ctx.params["_debug"] and not isinstance(error, KeyboardInterrupt | BrokenPipeError):
                traceback.print_exception(error)
            raise typer.Exit(_exit_code(error)) from error
        return result


def _exit_code(error: BaseException) -> int:
    """Return the exit code of a command that ended in `error`, and say why on stderr."""
    match error:
        case KeyboardInterrupt():
            return INTERRUPTED
        case MemoryError():
            typer.echo("there is not enough memory", err=True)
        case LookupError():  # jinja2.TemplateNotFound is an OSError too, but a bug of ours
            raise error
        case OSError():
            stdout_failed = _silence_broken_stdout()
            if isinstance(error, BrokenPipeError):
                return NO_READER
            file = "stdout" if stdout_failed else error.filename or "cannot read or write"
            typer.echo(f"{echo(str(file))}: {error.strerror or error}", err=True)
        case MamboNmpcError():
            typer.echo(str(error), err=True)
            return error.exit_code
    return BAD_INPUT


def _silence_broken_stdout() -> bool:
    """Send what stdout cannot take to nowhere, lest it fail again at exit; return whether that was so."""
    if sys.stdout is None:
        return False
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return True
    return False


def root() -> typer.Typer:
    """Return the command without sub-commands, for `register` of each package to fill."""
    return typer.Typer(
        name="mambo-nmpc",
        cls=RootGroup,
        callback=_root_options,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        epilog=examples("mambo-nmpc init", "mambo-nmpc generate controller.toml -o controller")
        + f"\n\n{EXIT_CODES}",
    )


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
        )
    )(generate)


def init(
    preset: Annotated[
        str, typer.Argument(help="Preset to start from; `mambo-nmpc presets` lists them.")
    ] = "mambo",
    output: Annotated[Path, typer.Option("--output", "-o", help="File to write, - for stdout.")] = Path(
        "controller.toml"
    ),
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file.")] = False,
) -> None:
    """Write a controller.toml to start from, every setting in it and explained."""
    text = controller_toml.to_toml(presets.preset(preset), presets.description(preset))
    if str(output) == "-":
        typer.echo(text, nl=False)
        return
    name = echo(str(output))
    place = Path(os.path.realpath(output))
    if place.exists() and not place.is_file():
        raise UnwritableError(f"{name}: is not a file; name one, or print to stdout with -o -")
    try:
        if os.path.lexists(output) and not force:
            raise FileExistsRefusedError(
                f"{name}: already exists; name another with -o, or overwrite it with --force"
            )
        put(place, text.encode())
    except OSError as error:
        raise UnwritableError(f"{name}: cannot be written: {error.strerror}") from error
    typer.echo(f"wrote {name}; next: mambo-nmpc generate {name} -o controller", err=True)


def list_presets(
    as_json: Annotated[bool, typer.Option("--json", help="Print {name: description} as JSON.")] = False,
) -> None:
    """List the presets, each with what it is for."""
    described = {name: presets.description(name) for name in presets.names()}
    if as_json:
        typer.echo(json.dumps(described, indent=2))
        return
    width = max(map(len, described))
    for name, description in described.items():
        typer.echo(f"{name:<{width}}  {description}")


def schema() -> None:
    """Print the JSON schema of controller.toml, for editors that check and complete TOML."""
    typer.echo(json.dumps(Settings.json_schema(), indent=2))


def load(source: str, scalar: str | None) -> Settings:
    """Load a preset or a controller.toml, with another scalar type if one is named."""
    settings = presets.load(source)
    return (
        settings
        if scalar is None
        else controller_toml.with_option(settings, "code.scalar", scalar, "--scalar")
    )


def generate(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder of the bundle.")],
    source: Annotated[str, typer.Argument(help="A preset or a controller.toml.")] = "mambo",
    *,
    check: Annotated[
        bool,
        typer.Option("--check", help="Write nothing; exit 1 with a diff if the folder is not up to date."),
    ] = False,
    prefix: Annotated[str | None, typer.Option(help="Begin public names with this (code.prefix).")] = None,
    scalar: Scalar = None,
    amalgamate: Annotated[bool, typer.Option("--amalgamate", help="One header and one source.")] = False,
    force: Annotated[
        bool,
        typer.Option("--force", help="Overwrite files edited by hand; files of other names always stay."),
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what would change and write nothing.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the outcome as JSON.")] = False,
) -> None:
    """Generate the C of a controller into a folder."""
    if check and (force or dry_run):
        raise typer.BadParameter("it writes nothing: leave out --force and --dry-run", param_hint="--check")
    settings = load(source, scalar)
    if prefix is not None:
        settings = controller_toml.with_option(settings, "code.prefix", prefix, "--prefix")
    files = render(settings, amalgamate=amalgamate)
    if check:
        _report_drifts(bundle.check(files, output), output, as_json=as_json)
    else:
        changes = bundle.write(files, output, force=force, dry_run=dry_run)
        _report_changes(changes, settings, output, dry_run=dry_run, as_json=as_json)


def _print_version(asked: bool) -> None:
    if asked:
        typer.echo(f"mambo-nmpc {__version__}")
        raise typer.Exit


def _root_options(
    _debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    _version: Annotated[
        bool,
        typer.Option("--version", help="Print the version.", is_eager=True, callback=_print_version),
    ] = False,
) -> None:
    """Generate a static-memory C99 NMPC for a very small drone, and fly it in software."""


def _report_changes(
    changes: bundle.Changes, settings: Settings, output: Path, *, dry_run: bool, as_json: bool
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
    typer.echo(f"{echo(str(output))}: {state}, settings {settings.digest[:16]}", err=True)


def _report_drifts(drifts: tuple[bundle.Drift, ...], output: Path, *, as_json: bool) -> None:
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


def examples(*lines: str) -> str:
    """Return an epilog of example commands, one paragraph each, so that help keeps them on their lines."""
    return "\n\n".join(("Examples:", *lines))
