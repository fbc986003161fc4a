"""The base of the record of a command: printed, written as the summary of its result folder, reported."""

import json
import math
from abc import abstractmethod
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import BaseModel, BeforeValidator, ConfigDict

from mambo_codegen import __version__
from mambo_sil.results.blocks import CommandResult
from mambo_sil.results.folders import GENERATOR, SUMMARY, finite

Number = Annotated[int | float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""A measured value: NaN and infinity become null in JSON, null is read as NaN, a whole number stays whole."""


class Summary(BaseModel):
    """The keys of every summary; unknown keys, which a later version may add, are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore", defer_build=True)

    command: ClassVar[str]
    generator: str = f"{GENERATOR}{__version__}"

    def text(self) -> str:
        """Return the summary as JSON."""
        whole = {"generator": self.generator, "command": self.command} | self.model_dump(mode="json")
        return json.dumps(finite(whole), indent=2, allow_nan=False) + "\n"

    def write(self, folder: Path) -> None:
        """Write the summary of a result folder."""
        (folder / SUMMARY).write_text(self.text(), "utf-8")


class ReportedSummary(Summary):
    """The record of a command that finds something: console and report show its result."""

    @abstractmethod
    def result(self, folder: Path, /) -> CommandResult:
        """Return what was found; its pictures are drawn from files in `folder`, if they are there.

        Raises ResultsError and TraceError, as the drawing does.
        """
