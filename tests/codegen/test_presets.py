"""Presets: what each departs from, and how a name or a path finds its settings."""

from pathlib import Path
from typing import Any

import pytest

from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError, UnreadableFileError
from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.toml_file import PRESETS


def departures(settings: Settings) -> dict[str, Any]:
    """Return {"section.key": value} of what differs from the defaults."""
    defaults = Settings().model_dump(exclude_none=True)
    return {
        f"{section}.{name}": value
        for section, values in settings.model_dump(exclude_none=True).items()
        for name, value in values.items()
        if value != defaults.get(section, {}).get(name)
    }


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("table1", {}),
        (
            "table1-printed",
            {
                "horizon.prediction_step_s": 0.01,
                "model.position_update": "printed",
                "model.yaw_convention": "printed",
            },
        ),
    ],
)
def test_the_presets_of_the_paper_depart_from_table_1_where_they_say(
    name: str, expected: dict[str, Any]
) -> None:
    """Nowhere, and where the text of the paper does. The numbers of all presets are in the kept results."""
    assert departures(presets.preset(name)) == expected


def test_every_preset_is_described_in_one_line() -> None:
    """The list of presets has a sentence for each."""
    assert presets.names() == ("crazyflie", "mambo", "mambo-1norm", "table1", "table1-printed")
    for name in presets.names():
        description = PRESETS.description(name)
        assert description.endswith(".")
        assert not description.startswith("#")


def test_name_finds_preset_and_path_finds_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bare name is the preset even where a file has that name; ./name is the file."""
    monkeypatch.chdir(tmp_path)
    Path("mambo").write_text("horizon.control = 7\n", encoding="utf-8")
    Path("own.toml").write_text("horizon.control = 8\n", encoding="utf-8")
    assert presets.load("mambo") == presets.preset("mambo")
    assert presets.load("./mambo").horizon.control == 7
    assert presets.load("own.toml").horizon.control == 8


@pytest.mark.parametrize("name", ["mamba", "none/controller.toml", "a\0b", "x" * 5000, "\x1b[31m"])
def test_unknown_source_lists_presets_and_suggests_init(name: str) -> None:
    """The message lists the presets, and says how to write a file; a near name is suggested."""
    with pytest.raises(SourceNotFoundError) as caught:
        presets.load(name)
    message = str(caught.value)
    assert (
        "presets are crazyflie, mambo, mambo-1norm, table1, table1-printed, and `mambo-nmpc init` writes"
        in message
    )
    assert ("mamba is neither a preset nor a file (did you mean mambo?)" in message) == (name == "mamba")
    assert message.isprintable()
    assert len(message) < 300


def test_bad_file_is_named(tmp_path: Path) -> None:
    """A file that is there and wrong is reported by its path."""
    path = tmp_path / "slow.toml"
    path.write_text("horizon.control = 11", encoding="utf-8")
    with pytest.raises(InvalidSettingsError, match=r"slow\.toml: horizon\.control = 11 must lie in 1\.\.10"):
        presets.load(str(path))
    with pytest.raises(UnreadableFileError, match="is a folder"):
        presets.load(str(tmp_path))
