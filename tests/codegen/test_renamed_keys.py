"""Settings of version 0.3: a key that has another name now is refused with that name."""

import pytest

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.controller_keys import KEYS
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.renamed_keys import RENAMED

OLD = """
[cost]
norm = "quadratic"
[model]
attitude = "predicted"
[observer]
age_s = 0.01
[height]
learn = "gain"
learn_limit = 0.3
[guard]
tilt_rad = 1.5
tilt_rad_s = 6.0
thrust_m_s2 = 12.0
thrust_m_s3 = 100.0
"""


def faults_of(text: str) -> list[str]:
    """Return the faults of settings that are refused."""
    with pytest.raises(InvalidSettingsError) as refused:
        controller_toml.parse(text, "old.toml")
    return list(refused.value.faults)


def test_a_file_of_before_is_told_every_new_name() -> None:
    """All at once, and nothing else."""
    assert sorted(faults_of(OLD)) == sorted(f"old.toml: {old} is now {new}" for old, new in RENAMED.items())


@pytest.mark.parametrize("old", RENAMED)
def test_a_renamed_key_names_one_that_is_there(old: str) -> None:
    """In words that `KEYS` knows; the key of before is none of them."""
    section, _, name = old.partition(".")
    assert faults_of(f"[{section}]\n{name} = 1\n") == [f"old.toml: {old} is now {RENAMED[old]}"]
    assert RENAMED[old].partition(";")[0] in KEYS
    assert old not in KEYS


def test_an_option_of_before_is_told_too() -> None:
    """A program that changes settings by the path."""
    with pytest.raises(InvalidSettingsError, match=r"--set: cost\.norm is now controller\.method"):
        controller_toml.with_option(Settings(), "cost.norm", "quadratic", "--set")


def test_what_is_learnt_has_the_limit_of_its_unit() -> None:
    """The limit of the other one has no use, as both have none where nothing is learnt."""
    head = '[controller]\nmethod = "quadratic"\n[height]\n'
    for learnt, limit in (("acceleration", "learnt_gain_limit"), ("gain", "learnt_acceleration_limit_m_s2")):
        fault = f'old.toml: height.{limit} = 0.3 has no effect with height.learnt = "{learnt}"; leave it out'
        assert faults_of(f'{head}learnt = "{learnt}"\n{limit} = 0.3\n') == [fault]
        assert faults_of(f'{head}learnt = "none"\n{limit} = 0.3\n') == [fault.replace(learnt + '"', 'none"')]


def test_a_key_that_is_gone_says_why() -> None:
    """It has no successor."""
    assert faults_of("[guard]\ntarget_noise_m_s2 = 0.1\n") == [
        "old.toml: guard.target_noise_m_s2 is gone, leave it out: each target says what it knows"
    ]
