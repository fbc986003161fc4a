"""The command `verify`: every check of the generated C, one verdict, and a folder of evidence."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from mambo_nmpc.codegen import bundle
from mambo_nmpc.codegen import cli as generating
from mambo_nmpc.codegen.errors import InvalidSettingsError, echo
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.cli.progress import progress_bar
from mambo_nmpc.sil.files.folders import SUMMARY, new_results, summary_text
from mambo_nmpc.sil.verify import report
from mambo_nmpc.sil.verify.check import Outcome, Result, Subject
from mambo_nmpc.sil.verify.checks import CHECKS, Entry
from mambo_nmpc.sil.verify.report import PAGE, Verified, line, verdict

CONTROLLER, REPORTS = "controller/", "checks/"
NAMES = ", ".join(entry.name for entry in CHECKS)


def register(app: typer.Typer) -> None:
    """Add the command of this module to `app`."""
    app.command(
        epilog=generating.examples(
            "mambo-nmpc verify",
            "mambo-nmpc verify controller.toml -o evidence",
            "mambo-nmpc verify controller.toml --only proof,rules --json",
            "mambo-nmpc verify --scalar fixed",
        )
        + "\n\nExit codes: 0 passed; 1 failed, or incomplete because a tool is missing; 2 bad input, or the "
        "system refuses."
    )(verify)


def verify(
    source: Annotated[str, typer.Argument(help="A preset or a controller.toml.")] = "mambo",
    *,
    only: Annotated[str | None, typer.Option(help=f"Checks to run, of {NAMES}.", metavar="NAME,NAME")] = None,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for the evidence; an earlier one there is replaced."),
    ] = Path("verification"),
    scalar: generating.Scalar = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.", metavar="")] = False,
) -> None:
    """Prove and test the C that a controller's settings generate, and keep the evidence."""
    settings = generating.load(source, scalar)
    chosen = _chosen(only)
    with new_results(output, "verify", (CONTROLLER, REPORTS, PAGE)) as place:
        folder = place.resolve()
        bundle.write(render(settings), folder / CONTROLLER)
        found = _run(chosen, settings, folder, aloud=not as_json)
        summary = report.summary(found, source, settings)
        (folder / PAGE).write_text(report.page(summary), "utf-8")
        summary["files"] = report.digests(folder)
        text = summary_text("verify", summary)
        (folder / SUMMARY).write_text(text, "utf-8")
    outcome = verdict(found)
    typer.echo(text if as_json else report.closing(found), nl=not as_json)
    typer.echo(f"{echo(str(output))}: {PAGE}, {SUMMARY}, {CONTROLLER}, {REPORTS}", err=True)
    if outcome is not Outcome.PASSED:
        raise typer.Exit(1)


def _chosen(only: str | None) -> Sequence[Entry]:
    """Return the checks that `only` names, in the registry's order; raises InvalidSettingsError."""
    if only is None:
        return CHECKS
    names = only.split(",")
    for name in names:
        if name not in {entry.name for entry in CHECKS}:
            raise InvalidSettingsError((f"--only {echo(only)}: {echo(name)} is no check; there are {NAMES}",))
    return [entry for entry in CHECKS if entry.name in names]


def _run(chosen: Sequence[Entry], settings: Settings, folder: Path, *, aloud: bool) -> list[Verified]:
    """Run the checks one after the other, each in a folder of its own; say how each ended."""
    found: list[Verified] = []
    with progress_bar("verifying") as progress:
        for entry in chosen:
            own = folder / REPORTS / entry.name
            own.mkdir(parents=True)
            result = entry.check(Subject(settings, folder / CONTROLLER, own))
            evidence = result.evidence.replace(f"{folder}/", "")
            found.append(Verified(entry, Result(result.outcome, evidence, result.figures, result.tools)))
            progress(len(found) / len(chosen))
            if aloud:
                typer.echo(line(found[-1]))
    return found
