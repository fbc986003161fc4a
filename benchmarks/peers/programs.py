"""Programs that answer `run` of glue/run.h: how their C is written and compiled.

The Python that has the peers imports this module too, so it imports nothing of ours.
"""

import re
import subprocess
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

Cost = Literal["1-norm", "quadratic", "quadratic, other problem"]

ROOT: Final = Path(__file__).parents[2]
HERE: Final = Path(__file__).parent


class NotHereError(Exception):
    """A program cannot be generated or built here; its text is the reason."""


def run_tool(line: list[str]) -> str:
    """Run a command in the repository; returns its stdout.

    Raises NotHereError with the first error of its output, or else the last line.
    """
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode:
        said = [text for text in (done.stderr or done.stdout).splitlines() if text.strip()]
        errors = [text for text in said if re.search("error:|cannot find|undefined", text)]
        reason = [*errors[:1], *said[-1:], f"exit code {done.returncode}"][0]
        raise NotHereError(re.sub(r"^/\S*/", "", reason))
    return done.stdout


@dataclass(frozen=True, kw_only=True)
class Program(ABC):
    """A contender, built as its own build files say.

    `sources` are globs and `includes` folders in the folder of its C; `glue`, a file here, defines `run`.
    """

    name: str
    title: str
    cost: Cost
    scalar: Literal["float32", "float64", "fixed"]
    sources: tuple[str, ...]
    includes: tuple[str, ...]
    glue: str
    defines: tuple[str, ...] = ()
    language: Literal["c", "c++"] = "c"
    dialect: str = "-std=c99"

    @abstractmethod
    def write(self, folder: Path) -> dict[str, str]:
        """Generate C into `folder`; returns the versions of the packages that did. Raises NotHereError."""

    def files(self, folder: Path) -> list[Path]:
        """Return the source files in `folder`."""
        return sorted({path for pattern in self.sources for path in folder.glob(pattern)})

    def definitions(self, folder: Path) -> list[str]:
        """Return the flags for macros and include folders."""
        return [f"-D{name}" for name in self.defines] + [f"-I{folder / name}" for name in self.includes]

    def compile(self, line: list[str], folder: Path, work: Path) -> list[str]:
        """Compile sources and glue with the command `line`; returns the object files, which are in `work`."""
        objects: list[str] = []
        for source in [*self.files(folder), HERE / self.glue]:
            objects.append(str(work / f"{len(objects)}.o"))
            flags = [*self.definitions(folder), f"-I{HERE / 'glue'}"]
            run_tool([*line, self.dialect, *flags, "-c", str(source), "-o", objects[-1]])
        return objects
