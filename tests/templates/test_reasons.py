"""Reasons for what no case reaches and no fault shows: none outlives the line that it explains."""

import pytest

from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.controller_toml import with_option
from tests.support import coverage_reasons, mutation_reasons
from tests.support.cases import SCALARS
from tests.support.reasons import Reason, plain


@pytest.fixture(scope="module")
def generated() -> dict[str, str]:
    """Return each file as all presets in all scalar types have it, one after the other."""
    texts: dict[str, str] = {}
    for name in presets.names():
        for scalar in SCALARS:
            files = render(with_option(presets.load(name), "code.scalar", scalar, "test"), with_digest=False)
            texts |= {path: texts.get(path, "") + plain(text, "nmpc") for path, text in files.items()}
    return texts


@pytest.mark.parametrize(
    "reason", [*coverage_reasons.REASONS, *mutation_reasons.REASONS], ids=lambda row: f"{row.line} {row.what}"
)
def test_the_line_is_still_generated(reason: Reason, generated: dict[str, str]) -> None:
    """Some preset has it, in the file that the row names."""
    assert reason.line in generated[reason.file]
