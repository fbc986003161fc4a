"""Commands that must succeed."""

import subprocess
from pathlib import Path


def shell(*command: str | Path, folder: Path | None = None) -> str:
    """Run a command that must succeed, in `folder`; return what it printed."""
    done = subprocess.run(
        [str(word) for word in command], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
