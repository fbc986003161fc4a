"""Tapes of calls: the generated C and the reference answer them alike, and what differs is named."""

from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.errors import BuildError
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.verify import tape_replay
from mambo_sil.verify.calls import (
    NULL_COMMAND,
    NULL_SELF,
    UNWRITTEN,
    ApiFunction,
    answers,
    calls,
    tape_from,
)
from mambo_sil.verify.cases import cases
from mambo_sil.verify.check import Subject
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import quadratic_settings
from tests.support.subjects import played_fault, subject

MAMBO = ONE_NORM
LIMITED = with_option(quadratic_settings(), "limits.speed_m_s", 2.0)
GOOD = np.array([[0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 9.81]])
REFUSED = np.full((1, 12), np.nan)


@pytest.mark.long
@pytest.mark.parametrize(
    ("settings", "untried"),
    [
        (with_option(MAMBO, "limits.speed_m_s", 2.0), set()),
        (LIMITED, {Status.BAD_WEIGHT}),
    ],
    ids=["1-norm", "quadratic"],
)
def test_the_cases_have_outcomes_of_every_status(settings: Settings, untried: set[Status]) -> None:
    """No status of the interface is left untried, but those that the settings do not have."""
    statuses = np.concatenate([outcome["status"] for outcome in cases(settings)[1]])
    assert set(statuses) == {int(status) for status in Status} - untried


@pytest.mark.long
def test_the_cases_have_limits_of_every_kind_and_long_outages() -> None:
    """Each limit acting, commands at their limit and within, and outages longer than the estimate."""
    limited = np.concatenate(cases(LIMITED)[1])
    assert set(limited["active_limits"]) >= {0, 1, 2, 5, 6}
    assert set(limited["saturated"]) == {0, 1}
    assert set(limited["steps_blind"]) >= set(range(52))


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("right", "wrong", "what"),
    [
        (
            "self->command_rad[1] = self->plan_rad[1];",
            "self->command_rad[1] = self->plan_rad[0];",
            "command_rad",
        ),
        ("    self->cost = (nmpc_sum_t)0;\n", "", "cost"),
        ("        command->roll_rad = (nmpc_real_t)0;\n", "", "command_rad"),
        ("        return NMPC_BAD_WEIGHT;", "        return NMPC_BAD_COMMAND;", "status"),
    ],
    ids=["pitch takes roll", "initialised in part", "unwritten without a controller", "another status"],
)
def test_what_differs_is_named(right: str, wrong: str, what: str, tmp_path: Path) -> None:
    """Tape, call and field of the first difference, with both values."""
    fault = played_fault(subject(MAMBO, tmp_path, ("nmpc.c", right, wrong)), "-O2")
    assert fault is not None
    assert fault.startswith("tape ")
    assert what in fault


def test_the_reference_answers_as_the_interface_promises() -> None:
    """Null pointers, refused steps and another initialisation, each call answered in its turn."""
    tape = np.concatenate(
        [
            calls(MAMBO, ApiFunction.STEP, GOOD),
            calls(MAMBO, ApiFunction.STEP, REFUSED),
            calls(MAMBO, ApiFunction.STEP, GOOD, NULL_SELF),
            calls(MAMBO, ApiFunction.STEP, GOOD, NULL_COMMAND),
            calls(MAMBO, ApiFunction.INIT, GOOD),
            calls(MAMBO, ApiFunction.STEP, REFUSED),
            calls(MAMBO, ApiFunction.STEP, GOOD),
        ]
    )
    (made,) = answers(MAMBO, [tape])
    assert list(made["status"]) == [0, 2, 1, 1, 0, 2, 0]
    assert made["command_rad"][0].tobytes() == made["command_rad"][1].tobytes()
    assert np.all(made["command_rad"][2] == 0)
    assert np.all(made["command_rad"][3:5] == UNWRITTEN)
    assert np.all(made["command_rad"][5] == 0)
    assert made[6].tobytes() == made[0].tobytes()


@pytest.mark.long
def test_tapes_of_unequal_length_do_not_disturb_each_other() -> None:
    """Answers are those of each tape alone; bytes that are no whole call are dropped."""
    tapes = list(cases(MAMBO)[0][::97])
    alone = [answers(MAMBO, [tape])[0] for tape in tapes]
    assert [made.tobytes() for made in answers(MAMBO, tapes)] == [made.tobytes() for made in alone]
    assert tape_from(MAMBO, tapes[0].tobytes() + b"rest").tobytes() == tapes[0].tobytes()


def test_a_bundle_without_its_c_is_refused(tmp_path: Path) -> None:
    """The message names the file."""
    with pytest.raises(BuildError, match=r"nmpc\.c is missing; generate the bundle again"):
        tape_replay.sources(Subject(MAMBO, tmp_path, tmp_path))
