"""Prove a controller, unless the record says that the same Frama-C has proven the same C before.

What Frama-C says depends on its version, its options and the C alone. `tests/verify/proven.txt` has a line
for each controller without an alarm: a digest of all these, the number of promises, and the test that wants
the proof; and a line for each controller with faults of which each raised its alarm, with their number. C
that has changed is proven as if there were no record, and takes the place of what its test has proven
before; so is all C by another Frama-C. Whoever changes the C commits the record too.

make proofs   make all proofs that tests want, and write the record anew
"""

import fcntl
import hashlib
import inspect
import os
import re
import subprocess
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.flags import PROOF_PREPROCESSING
from mambo_codegen.methods import method_of
from mambo_codegen.toolchain import Toolchain
from mambo_sil.verify import proof
from mambo_sil.verify.check import CheckOutcome, Result, Subject, passed
from tests.support import alarms, headings
from tests.support.tools import require

RECORD: Final = Path(__file__).parents[1] / "verify" / "proven.txt"
ANEW: Final = "PROOFS"
"""The environment variable that `make proofs` and `make thorough` set: the record is not read."""
_MACHINE: Final = ("-nostdinc", "-m32", "-D__FRAMAC__", "-D__FC_MACHDEP_X86_32")


def check(its: Subject) -> Result:
    """Return the result of all proofs of a controller, made now or before."""
    key = digest(its)
    if (promises := _recorded(key)) is not None:
        return passed(f"proven before: {RECORD.name}", {"promises": promises, "promises_proven": promises})
    result = headings.check(its)
    if result.outcome is CheckOutcome.PASSED:
        _record(key, result.figures["promises"])
    return result


def unnoticed(its: Subject, faults: Mapping[str, alarms.Fault]) -> list[str]:
    """Return the faults of a controller that raise no alarm of their own, now or before."""
    key = alarm_digest(its, faults)
    if _recorded(key) is not None:
        return []
    found = alarms.unnoticed(its, faults)
    if not found:
        _record(key, len(faults))
    return found


def alarm_digest(its: Subject, faults: Mapping[str, alarms.Fault]) -> str:
    """Return the digest of all that the alarms of a controller with faults depend on."""
    return digest(its, inspect.getsource(alarms.unnoticed), *map(repr, faults.values()))


def digest(its: Subject, *others: str) -> str:
    """Return the digest of all that a result depends on: Frama-C, its options, the C, its judge."""
    parts = [
        _of_frama_c("-version").partition(" ")[0].partition("-")[0],
        *(" ".join(proof.command(its, name)) for name in method_of(its.settings).proofs),
        inspect.getsource(proof),
        *sorted(method_of(its.settings).assumed_contracts),
        _code(its),
        *others,
    ]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


@cache
def _of_frama_c(option: str) -> str:
    """Return what Frama-C says of itself."""
    return subprocess.run(["frama-c", option], capture_output=True, text=True, check=True).stdout.strip()


def _code(its: Subject) -> str:
    """Return driver and controller after the preprocessor, with contracts and without other comments.

    Generator version and settings digest are left out: the C returns them as a text, which no proof reads.
    """
    headings.join(its)
    library = f"-I{_of_frama_c('-print-share-path')}/libc"
    flags = (*_MACHINE, *PROOF_PREPROCESSING, f"-I{its.bundle.resolve()}", library)
    Toolchain((require("gcc", "gcc"),)).run(["-E", "-P", *flags, "joined.c", "-o", "proven.i"], its.folder)
    text = (its.folder / "proven.i").read_text("utf-8")
    text, count = re.subn(r'"mambo-nmpc [^"]*" " settings " "[^"]*"', '""', text)
    assert count == 1, "the text that names a controller has moved on"
    return re.sub(r"^ *#pragma .*\n", "", text, flags=re.MULTILINE)


def _recorded(key: str) -> int | None:
    """Return the number in a line of the record, None if it is not there or all proofs are made anew."""
    anew = bool(os.environ.get(ANEW))
    lines = RECORD.read_text("utf-8").splitlines() if RECORD.is_file() and not anew else []
    return next((int(line.split()[1]) for line in lines if line.startswith(f"{key} ")), None)


def _record(key: str, count: int) -> None:
    """Write the line of the present test into the record, whose lines are ordered by their tests."""
    test = os.environ["PYTEST_CURRENT_TEST"].rpartition(" ")[0]
    with RECORD.open("a+", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.seek(0)
        lines = {line.split(maxsplit=2)[2]: line for line in file.read().splitlines()}
        lines[test] = f"{key} {count} {test}"
        file.seek(0)
        file.truncate()
        file.write("".join(f"{lines[name]}\n" for name in sorted(lines)))
