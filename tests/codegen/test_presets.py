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
            "mambo",
            {
                "horizon.ramp_s": 0.4,
                "model.roll_lag_s": 0.28,
                "model.pitch_lag_s": 0.154,
                "model.roll_delay_s": 0.045,
                "model.pitch_delay_s": 0.06,
                "model.roll_integral_1_s": 1.0,
                "model.pitch_integral_1_s": 0.77,
                "model.drag_1_s": 0.067,
                "model.attitude": "predicted",
                "target.acceleration": "tracked",
                "target.tracker_gain": 0.5,
                "cost.norm": "quadratic",
                "damping.roll_rate_feedback_s": 0.05,
                "limits.speed_m_s": 5.0,
                "limits.braking_m_s2": 3.0,
            },
        ),
        (
            "crazyflie",
            {
                "horizon.ramp_s": 0.4,
                "model.roll_lag_s": 0.1347,
                "model.pitch_lag_s": 0.1347,
                "model.roll_delay_s": 0.0235,
                "model.pitch_delay_s": 0.0235,
                "model.roll_integral_1_s": 0.4616,
                "model.pitch_integral_1_s": 0.4616,
                "model.drag_1_s": 0.12,
                "model.attitude": "predicted",
                "target.acceleration": "tracked",
                "cost.norm": "quadratic",
                "cost.response_time_s": 0.125,
                "cost.velocity_weight_s": 0.08,
                "observer.disturbance_noise": 3.0,
                "observer.position_noise": 0.001,
                "observer.velocity_noise": 0.15,
                "observer.age_s": 0.01,
                "limits.tilt_rad": 0.5,
                "limits.speed_m_s": 5.0,
                "limits.braking_m_s2": 3.0,
                "guard.tilt_rad": 1.5,
                "guard.tilt_rad_s": 6.0,
                "guard.thrust_m_s2": 12.0,
                "guard.thrust_m_s3": 100.0,
                "guard.target_noise_m_s2": 0.3,
                "guard.position_noise": 0.03,
            },
        ),
        (
            "mambo-1norm",
            {
                "horizon.prediction_step_s": 0.055,
                "model.roll_lag_s": 0.27,
                "model.pitch_lag_s": 0.15,
                "target.acceleration": "tracked",
                "optimizer.warm_start": "plan",
            },
        ),
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
def test_preset_departs_from_table_1_where_it_says(name: str, expected: dict[str, Any]) -> None:
    """A preset changes what its comments explain and nothing else."""
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
