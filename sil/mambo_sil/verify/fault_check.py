"""Check: under every fault in flight, commands stay bounded, bad input is refused, and the drone recovers."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial

from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.experiment.faults.fault_flights import STRAY_M, End, Verdict, fly_faults
from mambo_sil.experiment.faults.faults_report import faults_markdown, write_csv
from mambo_sil.experiment.faults.scenarios import TO_THE_END, scenarios
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import build_library, load_library
from mambo_sil.results.folders import finite
from mambo_sil.verify.check import Result, Subject, failed, incomplete, passed


def check(subject: Subject) -> Result:
    """Fly with every fault; raises BuildError, CacheError and FlightError."""
    settings = subject.settings
    verdicts = fly_faults(settings, partial(controller, subject))
    (subject.folder / "faults.md").write_text(faults_markdown(verdicts) + "\n", "utf-8")
    write_csv(verdicts, subject.folder / "faults.csv")
    return replace(judge(verdicts, settings), tools={"compiler": host_toolchain().identity().splitlines()[0]})


def controller(subject: Subject, n: int) -> CompiledController:
    """Compile the C in the subject's bundle, and return n controllers; raises BuildError and CacheError.

    The library requires the prefix nmpc: for another prefix the C is generated again with nmpc.
    """
    settings = subject.settings
    if settings.code.prefix != "nmpc":
        return CompiledController(settings, n, build_library(settings, host_toolchain()))
    files = {path.name: path.read_text("utf-8") for path in sorted(subject.bundle.glob("*.[ch]"))}
    return CompiledController(settings, n, load_library(files, host_toolchain()))


def judge(verdicts: Sequence[Verdict], settings: Settings) -> Result:
    """Return the result of the flights of one controller.

    It is INCOMPLETE if the drone strays without any fault, because then no recovery can be judged.
    """
    limit = method_of(settings).tilt_limit_rad
    flown = scenarios(settings)
    may_crash = {scenario.name for scenario in flown if scenario.may_crash}
    ending = {scenario.name for scenario in flown if scenario.duration_s != TO_THE_END}
    strays = any(not verdict.band_m <= STRAY_M for verdict in verdicts)
    wrong = []
    for verdict in verdicts:
        where = f"{verdict.fault} ({verdict.course})"
        if not verdict.largest_command_rad <= limit:
            wrong.append(f"{where}: a command of {verdict.largest_command_rad:g} rad")
        if not verdict.expected:
            wrong.append(f"{where}: statuses {verdict.statuses}")
        if verdict.end is End.CRASHED and not strays and verdict.fault not in may_crash:
            wrong.append(f"{where}: crashed")
        if verdict.end is End.NOT_RECOVERED and not strays and verdict.fault in ending:
            wrong.append(f"{where}: did not recover")
    figures = finite({"wrong": wrong, "flights": [asdict(verdict) for verdict in verdicts]})
    if wrong:
        return failed("; ".join(wrong[:3]) + (f"; {len(wrong)} in all" if wrong[3:] else ""), figures)
    if strays:
        return incomplete(
            f"the drone strays more than {STRAY_M:g} m without a fault, so recovery cannot be judged", figures
        )
    return passed(_evidence(verdicts, ending), figures)


def _evidence(verdicts: Sequence[Verdict], ending: set[str]) -> str:
    back = [verdict for verdict in verdicts if verdict.end is End.RECOVERED]
    slowest = max((v for v in back if v.fault in ending), key=lambda verdict: verdict.recovery_s)
    crashes = sorted({verdict.fault for verdict in verdicts if verdict.end is End.CRASHED})
    lost = (
        f"no crash but of {' and '.join(crashes)}, in which nothing is known of the height"
        if crashes
        else "no crash"
    )
    return (
        f"{len(verdicts)} faults: {lost}, command at most "
        f"{max(verdict.largest_command_rad for verdict in verdicts):.4g} rad, {len(back)} recovered, "
        f"the last {slowest.recovery_s:.1f} s after '{slowest.fault}'"
    )
