"""The results of a verification as SARIF 2.1.0, which source hosts and editors show beside the lines."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from mambo_codegen import __version__
from mambo_sil.verify.check import CHECKS, CheckOutcome
from mambo_sil.verify.verify_report import Verified, VerifySummary

SARIF: Final = "verify.sarif"
_LEVELS: Final = {CheckOutcome.FAILED: "error", CheckOutcome.INCOMPLETE: "warning"}


def sarif(summary: VerifySummary, folder: Path) -> str:
    """Return a result for each check that did not pass; of MISRA rules one for each line.

    `folder` has the checked bundle; relative to the working folder its files have relative addresses.
    """
    begin = folder.as_uri() if folder.is_absolute() else quote(folder.as_posix())
    rules = [{"id": one.name, "shortDescription": {"text": one.about}} for one in CHECKS]
    driver = {"name": "mambo-nmpc verify", "version": __version__, "rules": rules}
    results = [found for one in summary.checks for found in _results(one, begin)]
    run = {"tool": {"driver": driver}, "results": results}
    document = {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [run],
    }
    return json.dumps(document, indent=1) + "\n"


def _results(one: Verified, folder: str) -> Iterator[dict[str, Any]]:
    if one.outcome not in _LEVELS:
        return
    lines: list[Mapping[str, Any]] = one.figures.get("findings", []) if one.name == "rules" else []
    if not lines:
        yield _result(one, one.evidence, f"{folder}/controller.toml", 1)
    for found in lines:
        yield _result(
            one, f"{found['rule']}: {found['message']}", f"{folder}/{quote(found['file'])}", found["line"]
        )


def _result(one: Verified, text: str, file: str, line: int) -> dict[str, Any]:
    place = {"artifactLocation": {"uri": file}, "region": {"startLine": max(line, 1)}}
    return {
        "ruleId": one.name,
        "ruleIndex": [entry.name for entry in CHECKS].index(one.name),
        "level": _LEVELS[one.outcome],
        "message": {"text": text},
        "locations": [{"physicalLocation": place}],
    }
