"""The command `verify`: run all checks of the generated C, give a verdict, and keep the evidence."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_sil.cli.options import AsJson, Results, Scalar, Source, load, show
from mambo_sil.verify.check_list import CHECKS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mambo_codegen.settings.model import Settings
    from mambo_sil.cli.progress import Bar
    from mambo_sil.verify.check_list import Entry
    from mambo_sil.verify.verify_report import Verified

CONTROLLER, REPORTS = "controller/", "checks/"
NAMES = ", ".join(entry.name for entry in CHECKS)
EXIT_CODES = (
    "Exit codes: 0 passed; 1 failed, or incomplete because a tool is missing; 2 bad input or a system error."
)


def verify(
    source: Source = "mambo",
    *,
    only: Annotated[str | None, typer.Option(help=f"Run only these of {NAMES}.", metavar="NAME,NAME")] = None,
    output: Results = Path("verification"),
    scalar: Scalar = None,
    as_json: AsJson = False,
) -> None:
    """Generate the C of a controller, prove and test it, and keep the evidence."""
    from mambo_codegen.bundle import bundle
    from mambo_codegen.bundle.render import render
    from mambo_sil.cli.progress import counting_bar
    from mambo_sil.results.folders import SUMMARY, digests, new_results
    from mambo_sil.results.scratch import check_tmpdir
    from mambo_sil.verify.check import CheckOutcome
    from mambo_sil.verify.verify_report import PAGE, VerifySummary, closing, page, summarise

    settings = load(source, scalar)
    chosen = _chosen(only)
    check_tmpdir()
    with (
        new_results(output, VerifySummary.command, (CONTROLLER, REPORTS, PAGE)) as place,
        counting_bar("generating the C", "checks", len(chosen)) as bar,
    ):
        folder = place.resolve()
        bundle.write(render(settings), folder / CONTROLLER)
        found = _run(chosen, settings, folder, bar, aloud=not as_json)
        summary = summarise(found, source, settings)
        (folder / PAGE).write_text(page(summary), "utf-8")
        summary = summary.model_copy(update={"files": digests(folder)})
        summary.write(folder)
    show(summary, closing(found), as_json=as_json)
    typer.echo(f"{echo(str(output))}: {PAGE}, {SUMMARY}, {CONTROLLER}, {REPORTS}", err=True)
    if summary.verdict is not CheckOutcome.PASSED:
        raise typer.Exit(1)


def _chosen(only: str | None) -> "Sequence[Entry]":
    """Return the checks that `only` names, in the registry's order; raises InvalidSettingsError."""
    if only is None:
        return CHECKS
    names = only.split(",")
    for name in names:
        if name not in {entry.name for entry in CHECKS}:
            raise InvalidSettingsError(
                (f"--only {echo(only)}: {echo(name)} is not a check; the checks are {NAMES}",)
            )
    return [entry for entry in CHECKS if entry.name in names]


def _run(
    chosen: "Sequence[Entry]", settings: "Settings", folder: Path, bar: "Bar", *, aloud: bool
) -> "list[Verified]":
    """Run the checks one after the other, each in its own folder; with `aloud` print each result."""
    from mambo_sil.verify.check import Subject
    from mambo_sil.verify.tools import versions
    from mambo_sil.verify.verify_report import Verified, line

    found: list[Verified] = []
    bar(0)
    for entry in chosen:
        bar.stage(f"verifying: {entry.name}")
        own = folder / REPORTS / entry.name
        own.mkdir(parents=True)
        result = entry.check(Subject(settings, folder / CONTROLLER, own))
        evidence = result.evidence.replace(f"{folder}/", "")
        tools = versions(entry.tools) | dict(result.tools)
        found.append(Verified(entry.name, entry.about, result.outcome, evidence, result.figures, tools))
        bar(len(found))
        if aloud:
            typer.echo(line(found[-1]))
    return found
