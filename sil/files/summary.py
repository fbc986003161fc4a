"""What a command found, as one record: written as the summary of its folder, printed, and read back."""

import json
import math
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import BaseModel, BeforeValidator, ConfigDict

from mambo_nmpc.codegen import __version__
from mambo_nmpc.sil.files.folders import GENERATOR, SUMMARY, finite

Number = Annotated[int | float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""A measured value; NaN and infinity are null in JSON, null is read as NaN, and a whole number stays one."""


class Summary(BaseModel):
    """What every summary begins with; keys that a later version may add are passed over."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    command: ClassVar[str]
    generator: str = f"{GENERATOR}{__version__}"

    def text(self) -> str:
        """Return the summary as JSON."""
        whole = {"generator": self.generator, "command": self.command} | self.model_dump(mode="json")
        return json.dumps(finite(whole), indent=2, allow_nan=False) + "\n"

    def write(self, folder: Path) -> None:
        """Write the summary of a result folder."""
        (folder / SUMMARY).write_text(self.text(), "utf-8")
