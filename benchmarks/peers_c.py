"""Generate the C of a peer, and find its sources, macros and include folders."""

import json
import shutil
import subprocess
from pathlib import Path

from benchmarks.peers_programs import Program


class NotHereError(Exception):
    """A peer cannot be generated or built here; its text is the reason."""


def run_tool(line: list[str], folder: Path | None = None) -> str:
    """Run a command; returns its stdout, raises NotHereError with the last line of its output."""
    done = subprocess.run(
        line,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode:
        said = [text for text in (done.stderr or done.stdout).splitlines() if text.strip()]
        raise NotHereError(said[-1] if said else f"exit code {done.returncode}")
    return done.stdout


def generate(python: str, program: Program, folder: Path) -> dict[str, str]:
    """Generate C into `folder` with the peer installed in `python`; returns the versions of its packages.

    Deletes binaries that the peer builds. Raises NotHereError.
    """
    line = [python, "-m", "benchmarks.peers_setups", program.name, str(folder)]
    said = run_tool(line, Path(__file__).parents[1])
    versions: dict[str, str] = json.loads(said.splitlines()[-1])
    for product in [path for pattern in program.products for path in folder.glob(pattern)]:
        if product.is_dir():
            shutil.rmtree(product)
        else:
            product.unlink()
    return versions


def sources(program: Program, folder: Path) -> list[Path]:
    """Return the source files of `program` in `folder`."""
    return sorted({path for pattern in program.sources for path in folder.glob(pattern)})


def definitions(program: Program, folder: Path) -> list[str]:
    """Return the flags for macros and include folders of `program`."""
    return [f"-D{name}" for name in program.defines] + [f"-I{folder / name}" for name in program.includes]
