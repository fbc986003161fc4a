"""Faults in the C, and the line and the kind of the alarm that Frama-C must raise for each.

An alarm of one proof is an alarm of all proofs together: other proofs can excuse only a promise that this
proof does not reach, or a postcondition that it assumes, and neither counts here.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from mambo_codegen.settings.model import Settings
from mambo_sil.verify.check import Subject
from mambo_sil.verify.proof import Report, prove
from tests.support.subjects import Harm, subject

_CONTROLLER = "nmpc.c"
NAN_PASSES = Harm(
    _CONTROLLER,
    r"\(value >= minimum\);\n(.*)\(value <= maximum\)",
    r"!(value < minimum);\n\1!(value > maximum)",
)
INFINITY_PASSES = Harm(_CONTROLLER, r"\(value <= maximum\)", "1")
UNCHECKED_HEADING = Harm(_CONTROLLER, r"within\(state->yaw_rad, NMPC_YAW_RANGE_RAD\)", "1")
NULL_FOLLOWED = Harm(_CONTROLLER, r"\(state != NULL\) && ", "")
UNSET_COMMAND = Harm(
    _CONTROLLER, r"(?s)    command->roll_rad = self->command_rad\[0\];\n(?=.*return status)", ""
)
UNLIMITED_CLAMP = Harm(
    _CONTROLLER, r"\(value < \(nmpc_real_t\)0\) \? -limit", "(value < (nmpc_real_t)0) ? value"
)
"""Faults that the C of both norms can have."""


class Alarm(NamedTuple):
    """An alarm of a kind at the line of `path` in which `line` occurs."""

    path: str
    line: str
    kind: str


class Fault(NamedTuple):
    """A fault, the entry function of the proof that shows it, and the alarm that it raises there."""

    entry: str
    harm: Harm
    alarm: Alarm


def runs(faults: Mapping[str, Fault], at_once: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """Return the names of the faults of each proof: those shown at once, and the others one by one."""
    together = {name for names in at_once for name in names}
    return [*at_once, *((name,) for name in faults if name not in together)]


def harmed(settings: Settings, folder: Path, faults: Mapping[str, Fault], *others: Harm) -> Subject:
    """Write the bundle of a controller with all faults, and with `others`, which raise no alarm."""
    alarms = [fault.alarm for fault in faults.values()]
    assert len(set(alarms)) == len(alarms), "every fault has an alarm of its own"
    return subject(settings, folder, *(fault.harm for fault in faults.values()), *others)


def unnoticed(its: Subject, faults: Mapping[str, Fault]) -> list[str]:
    """Run one proof of a controller with all faults, and return those that raise no alarm of their own."""
    (entry,) = {fault.entry for fault in faults.values()}
    report = prove(its, entry)
    assert isinstance(report, Report), report
    raised = set()
    for one in report.properties:
        if one.status in ("Unknown", "Invalid", "Invalid or unreachable") and one.kind != "postcondition":
            path, _, number = one.place.rpartition(":")
            raised.add((path, (its.bundle / path).read_text("utf-8").splitlines()[int(number) - 1], one.kind))
    return [
        name
        for name, (_, _, alarm) in faults.items()
        if not any(
            (path, kind) == (alarm.path, alarm.kind) and alarm.line in line for path, line, kind in raised
        )
    ]
