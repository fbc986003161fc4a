"""The committed bundles are what their settings generate today."""

from pathlib import Path

import pytest

from mambo_codegen.bundle import bundle
from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import read, with_option

GENERATED = Path(__file__).parents[2] / "generated"
WHOLE = "mambo"
BUNDLES = {
    WHOLE: ("mambo", "float32"),
    "mambo-fixed": ("mambo", "fixed"),
    "table1": ("table1", "float32"),
}


def committed(files: dict[str, str], name: str) -> set[str]:
    """Return the committed files of a bundle: all of one; of the others the C and the manifest."""
    return {*files, bundle.MANIFEST} if name == WHOLE else {"nmpc.c", "nmpc.h", bundle.MANIFEST}


def differing(files: dict[str, str], name: str) -> list[bundle.Drift]:
    """Return the committed files that are not those of the bundle, byte for byte."""
    drifts = bundle.check(files, GENERATED / name)
    return [drift for drift in drifts if drift.path in committed(files, name)]


@pytest.mark.parametrize("name", BUNDLES)
def test_committed_bundle_is_up_to_date(name: str) -> None:
    """The manifest too, whose hashes hold the files that are left out; `make generated` writes them anew."""
    preset, scalar = BUNDLES[name]
    files = render(with_option(presets.load(preset), "code.scalar", scalar))
    folder = GENERATED / name
    assert differing(files, name) == []
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert found == committed(files, name)


def test_nothing_else_is_committed_as_generated() -> None:
    """Every folder in generated/ is one that the test above checks."""
    assert {path.name for path in GENERATED.iterdir()} == BUNDLES.keys()


def test_a_bundle_regenerates_from_its_own_settings() -> None:
    """The controller.toml in the bundle is all that it takes."""
    assert differing(render(read(GENERATED / WHOLE / "controller.toml")), WHOLE) == []
