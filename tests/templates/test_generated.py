"""The committed bundles are what their settings generate today."""

from pathlib import Path

import pytest

from mambo_codegen.bundle import bundle
from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import read, with_option

GENERATED = Path(__file__).parents[2] / "generated"
BUNDLES = {
    "mambo": ("mambo", "float32"),
    "mambo-fixed": ("mambo", "fixed"),
    "table1": ("table1", "float32"),
}


@pytest.mark.parametrize("name", BUNDLES)
def test_committed_bundle_is_up_to_date(name: str) -> None:
    """Byte for byte; `make generated` writes them anew."""
    preset, scalar = BUNDLES[name]
    settings = with_option(presets.load(preset), "code.scalar", scalar)
    assert bundle.check(render(settings), GENERATED / name) == ()


def test_nothing_else_is_committed_as_generated() -> None:
    """Every folder in generated/ is one that the test above checks."""
    assert {path.name for path in GENERATED.iterdir()} == BUNDLES.keys()


@pytest.mark.parametrize("name", BUNDLES)
def test_a_bundle_regenerates_from_its_own_settings(name: str) -> None:
    """The controller.toml in the bundle is all that it takes."""
    settings = read(GENERATED / name / "controller.toml")
    assert bundle.check(render(settings), GENERATED / name) == ()
