"""Prove a controller as `verify` does, but each text of sine and cosine only once for all controllers.

`turn_everywhere` takes most of the time of a proof, and the C that it reaches depends on few settings: on the
scalar type and on the norm. Where all of that C is the same, so is what Frama-C says of it.
"""

import hashlib
import json
import os
import re
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.flags import PROOF_PREPROCESSING
from mambo_codegen.methods import method_of
from mambo_codegen.toolchain import Toolchain
from mambo_sil.board.firmware.tool_report import command_version
from mambo_sil.verify.check import Result, Subject
from mambo_sil.verify.proof import Property, Report, judge, prove
from tests.support.tools import require

HEADINGS: Final = "turn_everywhere"
_DRIVER: Final = "proof/nmpc_proof.c"
_WORD: Final = re.compile(r"[A-Za-z_]\w*")


def check(its: Subject) -> Result:
    """Return the result of all proofs; that of `turn_everywhere` may be of another controller."""
    reports = []
    for name, flags in method_of(its.settings).proofs.items():
        report = _headings(its, flags) if name == HEADINGS else prove(its, name)
        if isinstance(report, Result):
            return report
        reports.append(report)
    return judge(its, reports)


def reached(its: Subject) -> str:
    """Return all definitions and contracts that `turn_everywhere` reaches, after the preprocessor."""
    join(its)
    include = [f"-I{its.bundle.resolve()}"]
    Toolchain((require("gcc", "gcc"),)).run(
        ["-E", "-P", *PROOF_PREPROCESSING, *include, "joined.c", "-o", "joined.i"], its.folder
    )
    items = _items((its.folder / "joined.i").read_text("utf-8"))
    found, names = set[str](), [HEADINGS]
    while names:
        for item in items.get(names.pop(), ()):
            if item not in found:
                found.add(item)
                names += _WORD.findall(item)
    return "\n".join(sorted(found))


def join(its: Subject) -> None:
    """Write driver and controller as one file, `joined.c`, whose contracts the preprocessor keeps."""
    texts = {path: _open_contracts((its.bundle / path).read_text("utf-8")) for path in (_DRIVER, "nmpc.c")}
    joined = texts[_DRIVER].replace('#include "nmpc.c"\n', texts["nmpc.c"])
    (its.folder / "joined.c").write_text(joined, "utf-8")


def _headings(its: Subject, flags: tuple[str, ...]) -> Report | Result:
    """Return the report of `turn_everywhere`, kept beside the compile cache if nothing is wrong.

    Properties of other functions are left out, since the other proofs have them, and the functions may be of
    this controller alone. A property's place is kept as the text of its line.
    """
    code = reached(its)
    text = "\n".join([str(command_version("frama-c")), *flags, code])
    file = Path(os.environ["XDG_CACHE_HOME"]) / f"{hashlib.sha256(text.encode()).hexdigest()}.json"
    lines = (its.bundle / _DRIVER).read_text("utf-8").splitlines()
    if not file.is_file():
        report = prove(its, HEADINGS)
        if isinstance(report, Result):
            return report
        known = [one for one in report.properties if one.status != "Dead"]
        if any(one.status not in ("Valid", "Considered valid") for one in known):
            return report
        own = [one for one in known if one.function in _WORD.findall(code)]
        stored = [asdict(one) | {"place": _line(lines, one.place)} for one in own]
        file.parent.mkdir(parents=True, exist_ok=True)
        draft = file.with_suffix(f".{os.getpid()}")
        draft.write_text(json.dumps([report.statements, stored]), "utf-8")
        draft.rename(file)
    statements, stored = json.loads(file.read_text("utf-8"))
    properties = [Property(**one) for one in stored]
    return Report(tuple(replace(one, place=_place(lines, one.place)) for one in properties), statements)


def _line(lines: list[str], place: str) -> str:
    """Return the text of a line of the driver."""
    path, _, number = place.rpartition(":")
    assert path == _DRIVER, place
    return lines[int(number) - 1]


def _place(lines: list[str], line: str) -> str:
    """Return the place of the only line of the driver with this text."""
    (index,) = (index for index, one in enumerate(lines) if one == line)
    return f"{_DRIVER}:{index + 1}"


def _open_contracts(text: str) -> str:
    """Turn comments for Frama-C into text of one line between @, in which the preprocessor expands macros."""
    return re.sub(r"/\*@(.*?)\*/\s*", lambda found: f"@{' '.join(found[1].split())}@ ", text, flags=re.DOTALL)


def _items(text: str) -> Mapping[str, list[str]]:
    """Return declarations and definitions by their name; each begins at the edge of a line.

    The name of a static assertion is its own, which nothing reaches, not that of a type whose size it tells.
    """
    items: dict[str, list[str]] = defaultdict(list)
    for item in re.split(r"^(?=[A-Za-z@])", text, flags=re.MULTILINE):
        plain = re.sub(r"@[^@]*@", "", item)
        plain = re.sub(r"^(typedef [^{]*)\{[^{}]*\}", r"\1", plain)
        head = re.split(r"[(\[={;]", plain, maxsplit=1)[0]
        if words := _WORD.findall(head):
            items[words[-1]].append(item)
    return items
