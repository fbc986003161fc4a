"""Kept results are what the source computes, no cache changes one, and methods derive theirs once."""

import json
import subprocess
import sys
from dataclasses import FrozenInstanceError
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

from benchmarks.generated import SCALARS, preset_results
from mambo_codegen import kept
from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.one_norm import ONE_NORM

ADVICE = "run `make generated`, and commit what changes"
UNDETERMINING = {"mambo_codegen", "mambo_codegen.bundle", "mambo_codegen.errors", "mambo_codegen.kept"}
"""Modules that the digest imports and that change no result, besides those of the user's cache."""


def shipped() -> dict[str, Any]:
    """Return the shipped results by key."""
    document = json.loads(resources.files("mambo_codegen").joinpath(kept.SHIPPED).read_text("utf-8"))
    assert document["source"] == kept.source_digest(), ADVICE
    return dict(document["results"])


@pytest.fixture
def forgetful(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the test an empty cache, nothing shipped and nothing remembered; return the cache folder."""
    monkeypatch.setattr(kept, "_remembered", {})
    monkeypatch.setattr(kept, "_shipped", dict)
    return empty_cache


def test_shipped_results_are_of_this_source() -> None:
    """Otherwise they would not be used, and every command that needs them would take longer."""
    assert len(shipped()) >= len(presets.names())


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", presets.names())
def test_shipped_results_are_what_the_source_computes(name: str) -> None:
    """All digests and constants of a preset, in every scalar type."""
    held = shipped()
    for scalar in SCALARS:
        for key, value in preset_results(name, scalar).items():
            assert held[key] == value, ADVICE


def test_a_result_is_computed_once(forgetful: Path) -> None:
    """Then it comes from the process, or from the cache."""
    asked = []

    def compute() -> list[float]:
        asked.append(1)
        return [0.1, 1e-300]

    for _ in range(2):
        assert kept.keep("test", [1, "a"], compute) == [0.1, 1e-300]
    kept._remembered.clear()
    assert kept.keep("test", [1, "a"], compute) == [0.1, 1e-300]
    assert asked == [1]
    assert len(list((forgetful / "kept").iterdir())) == 1
    assert kept.keep("test", [1, "b"], lambda: 7) == 7


@pytest.mark.parametrize("content", [b"", b"7", bytes(32) + b"7"])
def test_a_damaged_cache_costs_time_only(forgetful: Path, content: bytes) -> None:
    """A file that is cut short or has other content is replaced; so is a template's, in the same cache."""
    assert kept.keep("test", 1, lambda: 5) == 5
    (file,) = (forgetful / "kept").iterdir()
    whole = file.read_bytes()
    file.write_bytes(content)
    kept._remembered.clear()
    assert kept.keep("test", 1, lambda: 5) == 5
    assert file.read_bytes() == whole


def test_a_cache_that_cannot_be_used_costs_time_only(forgetful: Path) -> None:
    """Others may write to it, or a file is where the folder would be."""
    forgetful.mkdir()
    (forgetful / "kept").write_text("")
    assert kept.keep("test", 1, lambda: 5) == 5
    forgetful.chmod(0o777)
    assert kept.keep("test", 2, lambda: 6) == 6
    assert [path.name for path in forgetful.iterdir()] == ["kept"]


@pytest.mark.usefixtures("forgetful")
def test_cached_results_of_other_source_are_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each source finds its own."""
    assert kept.keep("test", 1, lambda: 5) == 5
    kept._remembered.clear()
    with monkeypatch.context() as patch:
        patch.setattr(kept, "source_digest", lambda: "other")
        assert kept.keep("test", 1, lambda: 6) == 6
    kept._remembered.clear()
    assert kept.keep("test", 1, lambda: 7) == 5


def test_shipped_results_of_other_source_are_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """The data of an older commit."""
    kept._shipped.cache_clear()
    monkeypatch.setattr(kept, "source_digest", lambda: "other")
    try:
        assert kept._shipped() == {}
    finally:
        kept._shipped.cache_clear()


def test_the_source_digest_covers_all_that_a_digest_imports() -> None:
    """But for errors, and the cache itself."""
    script = "import sys, mambo_codegen.bundle.digest; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    for module in done.stdout.split():
        if module.startswith("mambo_codegen") and module not in UNDETERMINING:
            path = module.removeprefix("mambo_codegen.").replace(".", "/")
            covered = any(
                path == source.removesuffix(".py") or path.startswith(source) for source in kept.SOURCES
            )
            assert covered or module in {"mambo_codegen.user_cache", "mambo_codegen.plain_file"}, module


@pytest.mark.long
def test_a_bundle_is_the_same_with_and_without_a_cache(forgetful: Path) -> None:
    """Computed, remembered, from the cache, from a damaged cache, and without one."""
    settings = with_option(presets.preset("mambo-1norm"), "cost.tracking_weight", 1.25)
    first = render(settings)
    assert render(settings) == first
    kept._remembered.clear()
    assert render(settings) == first
    for file in forgetful.glob("kept/*"):
        file.write_bytes(file.read_bytes()[:-1] + b"?")
    kept._remembered.clear()
    assert render(settings) == first
    kept._remembered.clear()
    forgetful.chmod(0o777)
    assert render(settings) == first


@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("preset", ["mambo", "mambo-1norm"])
@pytest.mark.parametrize("name", ["numbers", "limits", "trigonometry"])
def test_everything_is_derived_once(name: str, preset: str, scalar: str) -> None:
    """Whoever is handed a method reads the same object."""
    method = method_of(with_option(presets.preset(preset), "code.scalar", scalar))
    assert getattr(method, name) is getattr(method, name)


def test_a_method_is_a_value() -> None:
    """Equal settings make equal methods, whatever has been derived already; nothing can be put in."""
    one, other = method_of(ONE_NORM), method_of(ONE_NORM)
    assert one.limits.tilt == other.limits.tilt
    assert (one, hash(one)) == (method_of(ONE_NORM), hash(other))
    assert one != method_of(with_option(ONE_NORM, "cost.effort_weight", 2.0))
    with pytest.raises(FrozenInstanceError):
        one.settings = ONE_NORM  # type: ignore[misc]
