"""Check: cppcheck finds only the listed deviations from MISRA C:2012, and nothing by its own rules."""

import json
import re
import subprocess
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.flags import RULE_FLAGS
from mambo_sil.results.build_folders import scratch_folder
from mambo_sil.verify.check import Result, Subject, failed, incomplete, passed
from mambo_sil.verify.tools import TIME_LIMIT_S, missing, run

_DEVIATIONS: Final = "deviations.txt"
_TEMPLATE: Final = "{file}\t{line}\t{id}\t{message}"
_MISRA: Final = "misra-c2012-"
_CHAPTERS: Final = 22
_LARGEST_CHAPTER: Final = 25
"""Numbers of chapters of MISRA C:2012, and no less than the number of rules in any of them."""
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
        done = _cppcheck(subject.bundle)
    except subprocess.TimeoutExpired:
        return incomplete(f"cppcheck did not end within {TIME_LIMIT_S:g} s")
    (subject.folder / "cppcheck.txt").write_text(done.stdout + done.stderr, "utf-8")
    found = violations(done.stderr)
    if done.returncode != 0 or not any(one.rule.startswith(_MISRA) for one in found):
        return incomplete("cppcheck ran without its addon misra.py, which Debian's package cppcheck has")
    listed = deviations(subject.bundle / _DEVIATIONS)
    unlisted = [one for one in found if (one.rule, one.file) not in listed]
    accepted = [(one.rule.removeprefix(_MISRA), one.file) for one in found if (one.rule, one.file) in listed]
    departed: dict[str, dict[str, int]] = {}
    for (rule, file), lines in sorted(Counter(accepted).items()):
        departed.setdefault(rule, {})[file] = lines
    figures = {"findings": [asdict(one) for one in unlisted], "deviations": departed}
    if unlisted:
        rest = [f"{len(unlisted) - _SHOWN} more in cppcheck.txt"] if len(unlisted) > _SHOWN else []
        return failed("; ".join([*map(str, unlisted[:_SHOWN]), *rest]), figures)
    text = ", ".join(f"{rule} ({sum(files.values())})" for rule, files in departed.items())
    return passed(f"only the deviations listed in {_DEVIATIONS}: {text}", figures)


def _cppcheck(bundle: Path) -> subprocess.CompletedProcess[str]:
    """Run cppcheck without the list of deviations; findings are lines of `_TEMPLATE`.

    Of equal messages on one line cppcheck prints only the first, and without texts all rules have the same
    message. So a listed deviation would hide a finding of another rule; here a rule's text has its number.
    """
    numbers = [
        f"{chapter}.{rule}" for chapter in range(1, _CHAPTERS + 1) for rule in range(1, _LARGEST_CHAPTER + 1)
    ]
    with scratch_folder() as work:
        texts = work / "rule_texts.txt"
        texts.write_text(
            "Appendix A Summary of guidelines\n"
            + "".join(f"Rule {n} Required\nMISRA rule {n}\n" for n in numbers),
            "utf-8",
        )
        addon = json.dumps({"script": "misra.py", "args": [f'--rule-texts="{texts}"']})
        flags = [flag for flag in RULE_FLAGS if not flag.startswith("--addon=")]
        sources = sorted(path.name for path in bundle.glob("*.c"))
        return run(["cppcheck", *flags, f"--addon={addon}", f"--template={_TEMPLATE}", *sources], bundle)


def violations(said: str) -> list[RuleViolation]:
    """Read the output of cppcheck, one finding per line."""
    lines = (line.split("\t", 3) for line in said.splitlines())
    return [RuleViolation(words[0], int(words[1]), words[2], words[3]) for words in lines if len(words) == 4]


def deviations(file: Path) -> set[tuple[str, str]]:
    """Read {(rule, file)} from the list that a bundle ships."""
    return set(re.findall(r"^([\w.-]+):(\S+)$", file.read_text("utf-8"), re.MULTILINE))
