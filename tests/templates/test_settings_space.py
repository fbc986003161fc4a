"""The whole space of settings: what the rules admit goes the whole way, the rest is refused in words."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import Phase, given, seed, settings
from hypothesis import strategies as st

from mambo_codegen.methods.one_norm.controller import OneNormController
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import ffi
from tests.support import command
from tests.support.cases import SCALARS
from tests.support.parity import differences, inputs_of_steps, run
from tests.support.strategies import any_settings, settings_in
from tests.support.strict_builds import built

SHARDS = range(12)
VALID_EACH = 6
"""More than 5: some are drawn twice, such as the simplest settings, with which every shard begins."""

STEPS = 4
USUAL_WORK = 10_000
"""Predicted steps times moves times iterations up to which a hundred controllers step side by side."""


def goes_the_whole_way(drawn: Settings, compiler: str) -> None:
    """Generate, compile without a word, run the self-test, and compare some hundred steps bit for bit."""
    with tempfile.TemporaryDirectory() as folder:
        library = built(drawn, Path(folder), compiler)
    assert library.nmpc_self_test(ffi.new("char[]", library.nmpc_batch_instance_bytes())) == 0
    work = drawn.horizon.prediction * drawn.horizon.control * drawn.optimizer.iterations
    n = 100 if work <= USUAL_WORK else 25
    inputs = inputs_of_steps(drawn, n, STEPS, work)
    expected = run(OneNormController(OneNorm(drawn), n), inputs, work)
    found = run(CompiledController(drawn, n, library), inputs, work)
    assert differences(expected, found) == {}


def over_valid_settings(drawn: st.SearchStrategy[Settings], examples: int) -> Callable[[], None]:
    """Return the test of `examples` drawn settings, with each compiler."""

    @settings(max_examples=examples, phases=[Phase.generate])  # to shrink takes minutes of compiling
    @given(drawn, st.sampled_from(["gcc", "clang"]))
    def test(drawn: Settings, compiler: str) -> None:
        goes_the_whole_way(drawn, compiler)

    return test


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
def test_a_few_settings_go_the_whole_way(scalar: str) -> None:
    """Any valid settings: no warning, the self-test passes, and C and reference differ in no bit."""
    over_valid_settings(settings_in(scalar), 2)()


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("horizon.control = 11", "horizon.control = 11 must lie in 1..10 (horizon.prediction)"),
        ("cost.tracking_weight = nan", "cost.tracking_weight = nan must be a finite number; "),
        ("horizon.predicton = 9", "horizon.predicton is not a setting; did you mean prediction?"),
    ],
)
def test_broken_settings_are_refused_in_words(text: str, fault: str, tmp_path: Path) -> None:
    """By exit code 2 and one line, which names file, key, value and rule; and nothing is written.

    The other rules are in tests/codegen/test_settings.py.
    """
    (tmp_path / "own.toml").write_text(text, "utf-8")
    said, talk = command.run("generate", str(tmp_path / "own.toml"), "-o", str(tmp_path / "out"), code=2)
    assert said == ""
    (line,) = talk.splitlines()
    assert f"own.toml: {fault}" in line
    assert [path.name for path in tmp_path.iterdir()] == ["own.toml"]


@pytest.mark.sampled(12)
@pytest.mark.long
@pytest.mark.parametrize("shard", SHARDS)
def test_sixty_settings_go_the_whole_way(shard: int) -> None:
    """All shards together: 60 different settings, gcc and clang."""
    seed(shard)(over_valid_settings(any_settings(), VALID_EACH))()
