"""Check: Frama-C's plug-in Eva proves the promises of `proof/nmpc_proof.c` of the bundle for every input."""

import csv
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.flags import PROOF_FLAGS, PROOF_PREPROCESSING
from mambo_codegen.bundle.render import with_prefix
from mambo_codegen.methods import method_of
from mambo_sil.verify.check import Result, Subject, failed, incomplete, passed
from mambo_sil.verify.tools import TIME_LIMIT_S, missing, number, run

_SHOWN: Final = 5
"""Most alarms in the line of evidence; the reports list all."""
_PROMISE: Final = "user assertion"
_ASSUMED: Final = "postcondition"


@dataclass(frozen=True)
class Property:
    """One assertion, of Eva or of the driver, and its status."""

    place: str
    function: str
    kind: str
    status: str
    text: str


@dataclass(frozen=True)
class Report:
    """What Frama-C found from one entry function: all properties, and the number of statements reached."""

    properties: tuple[Property, ...]
    statements: int


def check(subject: Subject) -> Result:
    """Prove that no run-time error occurs and that the driver's promises hold; every alarm is a fault."""
    absent = missing("frama-c", "frama-c-base")
    if absent:
        return incomplete(absent)
    reports = []
    for name in _proofs(subject):
        report = prove(subject, name)
        if isinstance(report, Result):
            return report
        reports.append(report)
    return judge(subject, reports)


def prove(subject: Subject, name: str) -> Report | Result:
    """Run Frama-C from the entry function `name`; return a result if it ends without a report."""
    report = subject.folder.resolve() / f"{name}.csv"
    try:
        done = run([*command(subject, name), "-then", "-report-csv", str(report)], subject.bundle)
    except subprocess.TimeoutExpired:
        return incomplete(f"frama-c did not end within {TIME_LIMIT_S:g} s")
    log = done.stdout + done.stderr
    (subject.folder / f"{name}.txt").write_text(log, "utf-8")
    if done.returncode != 0 or not report.is_file():
        return failed(f"frama-c failed: {_complaint(log)}")
    return Report(tuple(read_properties(report)), number(log, r"(\d+) statements reached"))


def judge(subject: Subject, reports: Sequence[Report]) -> Result:
    """Return the result of all proofs of a controller."""
    properties = [one for report in reports for one in report.properties]
    statements = sum(report.statements for report in reports)
    assumed = method_of(subject.settings).assumed_contracts
    alarms = [
        one
        for one in unproven(properties)
        if not (one.kind == _ASSUMED and one.status == "Unknown" and one.function in assumed)
    ]
    proven = len({one.place for one in properties if one.kind == _PROMISE and one.status == "Valid"})
    promised = _driver(subject).read_text("utf-8").count("/*@ assert ")
    figures = {
        "alarms": [asdict(alarm) for alarm in alarms],
        "promises": promised,
        "promises_proven": proven,
        "assumed": list(assumed),
        "statements": statements,
    }
    if alarms:
        return failed(_alarm_text(alarms), figures)
    if proven < promised:
        return failed(f"{promised - proven} of {promised} promises were not reached", figures)
    fixed = subject.settings.code.scalar == "fixed"
    return passed(
        f"no alarm in {statements} statements for any inputs and any order of calls: no run-time "
        f"error, {'no overflow' if fixed else 'no NaN or infinity stored'}, no command beyond the tilt limit",
        figures,
    )


def command(subject: Subject, name: str) -> list[str]:
    """Return the command that `make proof` runs in the bundle for the proof `name`, without its report."""
    flags = _proofs(subject)[name]
    return [
        "frama-c",
        f"-cpp-extra-args={shlex.join(('-I.', *PROOF_PREPROCESSING))}",
        *shlex.split(with_prefix(" ".join((*PROOF_FLAGS, *flags)), subject.settings.code.prefix)),
        _driver(subject).relative_to(subject.bundle).as_posix(),
    ]


def unproven(properties: Sequence[Property]) -> list[Property]:
    """Return the properties that are not proven.

    A promise may be unreachable in one proof if the other one proves it. A postcondition that one proof
    assumes of a function must be proven by the other.
    """
    proven = {one.place for one in properties if one.status == "Valid"}
    return [
        one
        for one in properties
        if one.status not in ("Valid", "Considered valid")
        and not (_is_promise(one) and one.status == "Dead" and one.place in proven)
        and not (one.kind == _ASSUMED and one.status != "Invalid" and one.place in proven)
    ]


def read_properties(report: Path) -> list[Property]:
    """Read Frama-C's table of properties, without its own library's."""
    with report.open(encoding="utf-8", newline="") as file:
        return [
            Property(
                place=(Path(row["directory"]) / f"{row['file']}:{row['line']}").as_posix(),
                function=row["function"],
                kind=row["property kind"],
                status=row["status"],
                text=row["property"],
            )
            for row in csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE)
            if not row["directory"].startswith("FRAMAC_SHARE")
        ]


def _is_promise(one: Property) -> bool:
    """Whether the driver states it: an assertion of the driver, or a precondition of a function it calls."""
    return one.kind == _PROMISE or one.kind.startswith("precondition of ")


def _proofs(subject: Subject) -> Mapping[str, tuple[str, ...]]:
    return method_of(subject.settings).proofs


def _driver(subject: Subject) -> Path:
    return subject.bundle / "proof" / f"{subject.settings.code.prefix}_proof.c"


def _alarm_text(alarms: Sequence[Property]) -> str:
    shown = [
        f"{alarm.place}: {alarm.kind} not proven ({alarm.status}): {alarm.text}" for alarm in alarms[:_SHOWN]
    ]
    rest = [f"{len(alarms) - _SHOWN} more in the tables"] if len(alarms) > _SHOWN else []
    return "; ".join([f"{len(alarms)} alarms", *shown, *rest])


def _complaint(log: str) -> str:
    lines = [line.strip() for line in log.splitlines() if "error" in line.lower()]
    return lines[0] if lines else "it ended without a report"
