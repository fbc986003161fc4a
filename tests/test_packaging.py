"""The wheel, installed where nothing else of ours is, does what the checkout does."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.mark.long
def test_the_wheel_generates_and_flies_in_a_clean_environment(tmp_path: Path) -> None:
    """Templates, presets and the glue are in the wheel; the bundle equals the committed one."""

    def run(*command: str | Path) -> str:
        line = [str(word) for word in command]
        done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    run(sys.executable, "-m", "venv", "clean")
    python = tmp_path / "clean" / "bin" / "python"
    run(python, "-m", "pip", "wheel", "-q", "--no-deps", "-w", "wheels", ROOT)
    wheel = next((tmp_path / "wheels").glob("mambo_nmpc-*.whl"))
    run(python, "-m", "pip", "install", "-q", "-c", ROOT / "constraints.txt", wheel)
    command = tmp_path / "clean" / "bin" / "mambo-nmpc"
    run(command, "generate", "mambo", "-o", ROOT / "generated" / "mambo", "--check")
    assert "IAE" in run(command, "fly", "--duration-s", "1", "-o", "flight")
