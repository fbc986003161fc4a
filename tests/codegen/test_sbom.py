"""The bill of materials: valid by the tools of SPDX, and of the files that are there."""

import hashlib
import json
from pathlib import Path

import pytest
from spdx_tools.spdx.parser.parse_anything import parse_file
from spdx_tools.spdx.validation.document_validator import validate_full_spdx_document

from mambo_codegen.bundle.render import render, render_target
from mambo_codegen.bundle.sbom import SBOM, with_sbom
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings.presets import preset

MAMBO = preset("mambo")


@pytest.mark.parametrize("target", [None, "arduino"])
def test_it_is_valid_and_lists_each_file_with_its_hash(target: str | None, tmp_path: Path) -> None:
    """All files but itself and the manifest, of a bundle and of the folder of a target."""
    files = (
        render(MAMBO, with_digest=False)
        if target is None
        else render_target(MAMBO, find_target(target), with_digest=False)
    )
    (tmp_path / SBOM).write_text(files[SBOM], "utf-8")
    assert validate_full_spdx_document(parse_file(str(tmp_path / SBOM))) == []
    listed = {
        one["fileName"]: one["checksums"][1]["checksumValue"] for one in json.loads(files[SBOM])["files"]
    }
    assert listed == {
        f"./{path}": hashlib.sha256(text.encode()).hexdigest() for path, text in files.items() if path != SBOM
    }


def test_the_validator_sees_a_fault(tmp_path: Path) -> None:
    """A license that SPDX does not list."""
    text = with_sbom({"nmpc.c": ""})[SBOM].replace('Concluded": "MIT-0"', 'Concluded": "MIT-00"')
    (tmp_path / SBOM).write_text(text, "utf-8")
    faults = validate_full_spdx_document(parse_file(str(tmp_path / SBOM)))
    assert any("licen" in fault.validation_message for fault in faults)
