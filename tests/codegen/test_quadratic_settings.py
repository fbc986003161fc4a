"""Settings of a quadratic cost: what the rules between keys admit, and what is said of the rest."""

import pytest
from hypothesis import given
from hypothesis import settings as profile

from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.controller_keys import KEYS
from mambo_codegen.settings.key import spell
from mambo_codegen.settings.model import Settings
from tests.support.strategies import (
    LAGS,
    QUADRATIC,
    Values,
    faults_of,
    nested,
    other_value,
    quadratic_settings,
    toml,
)

USED = {
    norm: [key for key in KEYS.values() if Settings.model_validate(nested(values)).uses(key.path)]
    for norm, values in (("1-norm", LAGS), ("quadratic", QUADRATIC))
}
HEIGHT = {path for path in KEYS if path.startswith("height.")} | {
    "model.tilt",
    "limits.fence.floor_m",
    "limits.fence.ceiling_m",
}
"""The keys that only a controller with a height uses."""
ACCELERATION = {"height.learnt_acceleration_limit_m_s2"}
"""What only a controller uses that learns an acceleration, not a gain."""
GUARD = {path for path in KEYS if path.startswith("guard.")}
"""The keys that only a controller with a guard uses; two of them need a height too."""


def test_both_norms_use_some_keys_and_no_key_is_of_none() -> None:
    """Every key is used by one norm at least; some by both."""
    paths = {norm: {key.path for key in keys} for norm, keys in USED.items()}
    assert paths["1-norm"] | paths["quadratic"] == set(KEYS) - HEIGHT - GUARD
    assert {key for key in KEYS if settings_with_height().uses(key)} == paths[
        "quadratic"
    ] | HEIGHT - ACCELERATION
    guarded = controller_toml.parse(f"{toml(QUADRATIC)}[height]\n[guard]\n", "slow.toml")
    assert {key for key in KEYS if guarded.uses(key)} == paths["quadratic"] | HEIGHT - ACCELERATION | GUARD
    assert {
        "horizon.update_period_s",
        "model.roll_lag_s",
        "damping.roll_rate_feedback_s",
        "controller.method",
    } <= (paths["1-norm"] & paths["quadratic"])
    assert "optimizer" not in {path.split(".")[0] for path in paths["quadratic"]}
    assert "observer" not in {path.split(".")[0] for path in paths["1-norm"]}


@pytest.mark.parametrize("norm", USED)
def test_a_key_without_effect_is_refused_unless_it_says_the_default(norm: str) -> None:
    """Each key of the other norm alone, with its value and what to do; its default may stand there."""
    base = {"1-norm": LAGS, "quadratic": QUADRATIC}[norm]
    printed = "model.position_update"  # which admits no lag, as a quadratic cost wants one
    others = [
        key for key in KEYS.values() if key not in USED[norm] and key.path not in {printed, *HEIGHT, *GUARD}
    ]
    for key in others:
        value = other_value(key)
        spelling = spell(value) if key.low is None else value
        fault = f'{key.path} = {spelling} has no effect with controller.method = "{norm}"; leave it out'
        assert faults_of(toml({**base, key.path: value})) == [f"slow.toml: {fault}"]
        default = Settings().value(key.path)
        settings = controller_toml.parse(toml({**base, key.path: default}), "with the default")
        assert settings == controller_toml.parse(toml(base), "without it")


def settings_with_height() -> Settings:
    """Return the simplest settings with a height, an empty section."""
    return controller_toml.parse(f"{toml(QUADRATIC)}[height]\n", "slow.toml")


def test_the_presence_of_a_section_gives_the_height() -> None:
    """An empty section has the defaults, is written with all keys, and has another digest than none."""
    settings, level = settings_with_height(), controller_toml.parse(toml(QUADRATIC), "level.toml")
    assert level.height is None
    assert settings.height is not None
    assert settings.height.thrust_min_m_s2 == Settings().value("height.thrust_min_m_s2")
    assert controller_toml.parse(controller_toml.to_toml(settings), "written") == settings
    assert "[height]" not in controller_toml.to_toml(level)
    assert settings.digest != level.digest
    assert "thrust_gain" not in settings.in_use["height"]  # so that the C of older settings stays the same


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        (
            {"controller.method": "1-norm", "height.lag_s": 0.05},
            'controller.method = "1-norm" must be "quadratic" with [height]',
        ),
        (
            {"limits.fence.ceiling_m": 2.0},
            "limits.fence.ceiling_m = 2.0 has no effect without [height]; leave it out",
        ),
        (
            {"height.lag_s": 0.05, "limits.fence.floor_m": 1.0, "limits.fence.ceiling_m": 0.5},
            "limits.fence.ceiling_m = 0.5 must be more than 1.0 (limits.fence.floor_m)",
        ),
        (
            {"height.climb_m_s": 5.0},
            "height.climb_m_s = 5.0 must be at most 2.715, which the drone can brake in time with "
            "height.thrust_min_m_s2 and this law",
        ),
        (
            {"height.descent_m_s": 2.0},
            "height.descent_m_s = 2.0 must be at most 1.427, which the drone can brake in time with "
            "height.thrust_max_m_s2 and this law",
        ),
        (
            {"height.thrust_max_m_s2": 60.0},
            "height.thrust_max_m_s2 = 60.0 must be at most 50.0 (ranges.thrust_acceleration_max_m_s2)",
        ),
        (
            {"height.thrust_gain": 0.25},
            "height.thrust_max_m_s2 = 15.0 (the default) must be at most 0.25 (height.thrust_gain) times "
            "50.0 (ranges.thrust_acceleration_max_m_s2)",
        ),
    ],
)
def test_heights_at_odds_with_other_keys_are_refused(values: Values, fault: str) -> None:
    """Another norm, walls without or across, speeds that cannot be braked, a thrust out of range."""
    base = QUADRATIC | ({} if values.get("controller.method") else {"horizon.ramp_s": 0.4})
    assert faults_of(toml(base | values)) == [f"slow.toml: {fault}"]


def test_keys_without_effect_are_all_named() -> None:
    """One line for each of them."""
    lines = faults_of(toml({**QUADRATIC, "horizon.prediction": 5, "optimizer.iterations": 7}))
    assert [line.split()[1] for line in lines] == ["horizon.prediction", "optimizer.iterations"]


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        (
            {"model.roll_lag_s": 0.0},
            'model.roll_lag_s = 0.0 must be at least 0.001 with controller.method = "quadratic"',
        ),
        (
            {"model.roll_lag_s": 0.05, "damping.roll_rate_feedback_s": 0.05},
            'model.roll_lag_s = 0.05 must be at least 0.051 with controller.method = "quadratic" and '
            "damping.roll_rate_feedback_s = 0.05",
        ),
        (
            {"model.pitch_lag_s": 0.1, "damping.pitch_rate_feedback_s": 0.2},
            'model.pitch_lag_s = 0.1 must be at least 0.201 with controller.method = "quadratic" and '
            "damping.pitch_rate_feedback_s = 0.2",
        ),
        (
            {"limits.tilt_rad": 0.1, "model.roll_trim_rad": -0.1},
            "model.roll_trim_rad = -0.1 must be less than model.roll_gain times limits.tilt_rad",
        ),
        (
            {"limits.tilt_rad": 0.2, "model.pitch_gain": 0.5, "model.pitch_trim_rad": 0.15},
            "model.pitch_trim_rad = 0.15 must be less than model.pitch_gain times limits.tilt_rad",
        ),
        (
            {"horizon.update_period_s": 0.001},
            "observer.outage_s = 0.5 (the default) must be at most 250 times horizon.update_period_s",
        ),
        (
            {"horizon.update_period_s": 0.1, "horizon.ramp_s": 0.15},
            "horizon.ramp_s = 0.15 must be 0 or at least 2 update periods",
        ),
        (
            {"horizon.ramp_s": 0.01},
            "horizon.ramp_s = 0.01 must be 0 or lie in 0.02..2; 0 means one free move",
        ),
    ],
)
def test_values_at_odds_are_refused_with_both_keys(values: Values, fault: str) -> None:
    """The lag exceeds the rate feedback, the trim lies within the limit, outage and ramp suit the period."""
    lines = faults_of(toml({**QUADRATIC, **values}))
    assert f"slow.toml: {fault}" in lines
    assert len(lines) == 1


@pytest.mark.parametrize(
    "values",
    [
        {"model.roll_lag_s": 0.051, "damping.roll_rate_feedback_s": 0.05},
        {"model.pitch_lag_s": 0.071, "damping.pitch_rate_feedback_s": 0.07},
        {"limits.tilt_rad": 0.1, "model.roll_trim_rad": -0.0872},
        {"horizon.update_period_s": 0.002},
        {"horizon.update_period_s": 0.1, "horizon.ramp_s": 0.2},
        {"horizon.update_period_s": 0.0011, "observer.outage_s": 0.275},
        {"horizon.update_period_s": 0.0017, "observer.outage_s": 0.425},
        {"observer.outage_s": 0.0},
        {"horizon.ramp_s": 0.02},
        {"height.thrust_max_m_s2": 50.0},
    ],
)
def test_values_at_the_rule_are_admitted(values: Values) -> None:
    """The same rules, at what they admit."""
    controller_toml.parse(toml({**QUADRATIC, **values}), "at the rule")


def test_a_long_ramp_at_a_short_period_is_admitted() -> None:
    """2000 control steps of ramp, and an integral part that is slow besides: their constants are derived."""
    values = {
        "horizon.update_period_s": 0.001,
        "horizon.ramp_s": 2.0,
        "cost.response_time_s": 1.0,
        "observer.outage_s": 0.25,
        "model.roll_integral_1_s": 0.005,
    }
    method = Quadratic(controller_toml.parse(toml({**QUADRATIC, **values}), "slow and quick"))
    assert method.law.moves == 2
    assert method.attitude.limit_m_step2 >= 2 * max(method.attitude.command_limit_m_step2)


@pytest.mark.long
@profile(max_examples=25)
@given(quadratic_settings("float64"))
def test_any_valid_settings_have_finite_constants_and_read_back_equal(settings: Settings) -> None:
    """No rule is missing: whatever is admitted has gains, and a file that holds every bit of it."""
    read_back = controller_toml.parse(controller_toml.to_toml(settings), "written")
    assert (read_back, read_back.digest) == (settings, settings.digest)
    method = Quadratic(settings)
    for constants in (method.law, method.observer, method.attitude):
        for name, value in vars(constants).items():
            if value is None:
                continue
            assert all(abs(number) < 1e12 for number in list_of(value)), name
    assert max(method.law.spectral_radius) < 1


def list_of(value: object) -> list[float]:
    """Return the numbers of an array or a single one."""
    flat: list[float] = value.ravel().tolist() if hasattr(value, "ravel") else [value]  # type: ignore[list-item]
    return flat
