"""Check: cppcheck finds only the listed deviations from MISRA C:2012, and nothing by its own rules."""

import re
import subprocess
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from mambo_nmpc.codegen.flags import RULE_FLAGS
from mambo_nmpc.codegen.render import DEVIATIONS
from mambo_nmpc.sil.verify.check import Result, Subject, failed, incomplete, passed
from mambo_nmpc.sil.verify.tools import TIME_LIMIT_S, missing, run

_TEMPLATE: Final = "{file}\t{line}\t{id}\t{message}"
_MISRA: Final = "misra-c2012-"
_SHOWN: Final = 5


@dataclass(frozen=True)
class RuleViolation:
    """A line that breaks a rule of MISRA (by number) or of cppcheck (by name)."""

    file: str
    line: int
    rule: str
    message: str

    def __str__(self) -> str:
        """Name a rule of MISRA by its number, because the text of the rules is not free."""
        number = self.rule.removeprefix(_MISRA)
        what = self.message if number == self.rule else f"MISRA C:2012 rule {number}"
        return f"{self.file}:{self.line}: {what}"


def check(subject: Subject) -> Result:
    """Check the C against MISRA C:2012; a finding that is not a listed deviation is a fault."""
    gap = missing("cppcheck", "cppcheck")
    if gap:
        return incomplete(gap)
    try:
        done = run(["cppcheck", *RULE_FLAGS, f"--template={_TEMPLATE}", "-Iinclude", "src"], subject.bundle)
    except subprocess.TimeoutExpired:
        return incomplete(f"cppcheck did not end within {TIME_LIMIT_S:g} s")
    (subject.folder / "cppcheck.txt").write_text(done.stdout + done.stderr, "utf-8")
    found = violations(done.stderr)
    if done.returncode != 0 or not any(one.rule.startswith(_MISRA) for one in found):
        return incomplete("cppcheck ran without its addon misra.py, which Debian's package cppcheck has")
    listed = deviations(subject.bundle / DEVIATIONS)
    unlisted = [one for one in found if (one.rule, one.file) not in listed]
    counts = Counter(one.rule.removeprefix(_MISRA) for one in found if (one.rule, one.file) in listed)
    departed = dict(sorted(counts.items()))
    figures = {"findings": [asdict(one) for one in unlisted], "deviations": departed}
    if unlisted:
        rest = [f"{len(unlisted) - _SHOWN} more in cppcheck.txt"] if len(unlisted) > _SHOWN else []
        return failed("; ".join([*map(str, unlisted[:_SHOWN]), *rest]), figures)
    text = ", ".join(f"{rule} ({count})" for rule, count in departed.items())
    return passed(f"only the deviations listed in {DEVIATIONS}: {text}", figures)


def violations(said: str) -> list[RuleViolation]:
    """Read the output of cppcheck, one finding per line."""
    lines = (line.split("\t", 3) for line in said.splitlines())
    return [RuleViolation(words[0], int(words[1]), words[2], words[3]) for words in lines if len(words) == 4]


def deviations(file: Path) -> set[tuple[str, str]]:
    """Read {(rule, file)} from the list that a bundle ships."""
    return set(re.findall(r"^([\w.-]+):(\S+)$", file.read_text("utf-8"), re.MULTILINE))
