"""The manual on drones: its example flies, and it names every key and shipped drone."""

import re
from pathlib import Path

import pytest

from docs.pages.settings_page import vehicle_part
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import form
from tests.support.command import run

DOCS = Path(__file__).parents[3] / "docs"
MOST_LINES = 25


@pytest.fixture
def example(tmp_path: Path) -> Path:
    """Return the file that a tutorial has its reader save."""
    text = (DOCS / "tutorials" / "own-drone.md").read_text("utf-8")
    blocks = re.findall(r'```toml title="my-drone.toml"\n(.*?)```', text, re.DOTALL)
    assert len(blocks) == 1
    path = tmp_path / "my-drone.toml"
    path.write_text(blocks[0])
    return path


@pytest.mark.parametrize("sensors", ["true", "mocap"])
def test_the_example_is_short_and_flies(example: Path, sensors: str, tmp_path: Path) -> None:
    """Within 25 lines, without a crash."""
    assert len(example.read_text().splitlines()) <= MOST_LINES
    flags = ["--duration-s", "20", "--no-pictures", "--sensors", sensors, "-o", str(tmp_path / "flight")]
    text, _ = run("fly", "--vehicle", str(example), *flags)
    assert "IAE" in text
    assert '"name": "my-drone"' in (tmp_path / "flight" / "summary.json").read_text()


def test_every_key_is_documented() -> None:
    """Of every kind of attitude loop and of sensors, on the page that the code writes."""
    page = vehicle_part()
    for attitude in ("mambo", "cascade", "first_order"):
        for sensors in ("true", "mambo", "mocap"):
            for path in form(attitude, sensors).keys:
                assert f"`{path.rpartition('.')[2]}`" in page, path


def test_every_shipped_drone_is_documented() -> None:
    """In the first table of docs/reference/vehicles.md."""
    text = (DOCS / "reference" / "vehicles.md").read_text("utf-8")
    for name in vehicle_toml.names():
        assert f"\n| `{name}` | " in text
