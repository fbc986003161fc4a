"""Faults in flight: inputs of the controller, commands to the drone, verdicts, and the check of `verify`."""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.bundle import bundle
from mambo_codegen.bundle.flags import COMPILE_FLAGS, WARNING_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.experiment.faults.fault import (
    ControllerInput,
    Fault,
    FreezeState,
    ScaleState,
    SetState,
    SetThrust,
    WrapYaw,
    move_target,
    shift_yaw,
)
from mambo_sil.experiment.faults.fault_flights import End, Verdict, fly_faults
from mambo_sil.experiment.faults.faults_report import faults_markdown
from mambo_sil.experiment.faults.injection import FaultyController, LevellingCaller
from mambo_sil.experiment.faults.scenarios import FaultScenario, scenarios
from mambo_sil.experiment.table2.table2 import CASES
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import Applied
from mambo_sil.flight.engine.adjusted import AdjustedController, Adjustment
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Hover
from mambo_sil.verify.check import CheckOutcome
from mambo_sil.verify.fault_check import check, judge
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import quadratic_settings
from tests.support.shell import shell
from tests.support.subjects import subject
from tests.support.tools import require

MAMBO = ONE_NORM
QUADRATIC = presets.preset("mambo")
EIGHT = next(iter(CASES.values()))
DOCS = Path(__file__).parents[3] / "docs" / "evidence"
NOW = ControllerInput(np.arange(1.0, 8.0), np.arange(6.0), 9.81)
BEGAN = ControllerInput(-NOW.state, -NOW.target, 1.0)
FLOWN_S = 1.5


def fly_start(controller: PositionController, flights: int = 1) -> Trace:
    """Fly the first 1.5 s of the Table II case."""
    return fly(Flight(EIGHT, duration_s=FLOWN_S, flights=flights), controller)


def fly_with(fault: Fault | None) -> Trace:
    """Fly the compiled C with a fault."""
    return fly_start(FaultyController(CompiledController(MAMBO), [fault]))


def test_a_fault_alters_only_the_inputs_that_it_names() -> None:
    """Each fault is applied to inputs of distinct values; all other values stay."""
    frozen = FreezeState()(NOW, BEGAN, 3)
    assert (frozen.state.tolist(), frozen.target.tolist()) == (BEGAN.state.tolist(), NOW.target.tolist())
    burst = SetState(range(1), math.inf, on=2, of=5)
    assert [burst(NOW, BEGAN, since).state[0] for since in range(6)] == [math.inf] * 2 + [1.0] * 3 + [
        math.inf
    ]
    assert burst(NOW, BEGAN, 0).state[1:].tolist() == NOW.state[1:].tolist()
    assert ScaleState((1, 1, 1, 1, 2, 2, 2))(NOW, BEGAN, 0).state.tolist() == [1, 2, 3, 4, 10, 12, 14]
    assert shift_yaw(1.0)(NOW, BEGAN, 0).state.tolist() == [1, 2, 3, 4, 5, 6, 8]
    assert move_target(100.0)(NOW, BEGAN, 0).target.tolist() == [100, 1, 2, 3, 4, 5]
    assert SetThrust(0.0)(NOW, BEGAN, 0).thrust_acceleration_m_s2 == 0.0
    assert NOW.state.tolist() == [1, 2, 3, 4, 5, 6, 7]


@pytest.mark.parametrize("yaw_rad", [-7.0, -3.2, -3.0, 0.0, 3.1, 3.2, 100.0])
def test_a_wrapped_yaw_is_the_same_heading_within_half_a_turn(yaw_rad: float) -> None:
    """The wrapped yaw is in [-pi, pi) and differs by a multiple of 2 pi."""
    wrapped = WrapYaw()(replace(NOW, state=np.array([0.0] * 6 + [yaw_rad])), BEGAN, 0).state[6]
    assert -math.pi <= wrapped < math.pi
    assert math.isclose(math.remainder(wrapped - yaw_rad, 2 * math.pi), 0.0, abs_tol=1e-12)


def test_without_a_fault_the_wrapper_changes_no_bit() -> None:
    """Neither no fault nor a fault with default effects changes a bit of the trace."""
    plain = fly_start(CompiledController(MAMBO))
    assert fly_with(None).same_bits(plain)
    assert fly_with(Fault(20, 100)).same_bits(plain)


def test_a_fault_begins_and_ends_on_time() -> None:
    """The controller rejects exactly the updates with NaN."""
    status = fly_with(Fault(20, 50, SetState(range(1), math.nan))).status[:, 0]
    assert np.flatnonzero(status == Status.BAD_STATE).tolist() == list(range(20, 50))
    assert np.unique(status).tolist() == [Status.OK, Status.BAD_STATE]


def test_a_frozen_state_is_the_state_at_the_onset() -> None:
    """During the fault the controller receives the state of the first update of the fault."""
    recorder = Recorder()
    fly_start(FaultyController(recorder, [Fault(30, 60, FreezeState())]))
    shown = recorder.states
    assert all(np.array_equal(shown[update], shown[30]) for update in range(30, 60))
    assert not np.array_equal(shown[60], shown[30])
    assert not np.array_equal(shown[30], shown[29])


class Recorder:
    """The compiled C, which records states and commands and is not called at updates of `skipped`."""

    def __init__(self, skipped: Sequence[int] = (), settings: Settings = MAMBO) -> None:
        self.controller, self.skipped = CompiledController(settings), skipped
        self.states: list[NDArray[np.float64]] = []
        self.commands: list[NDArray[Any]] = []

    def step(self, state: Any, target: Any, thrust: Any) -> Applied:
        """Step and record, or hold the last command."""
        skip = len(self.states) in self.skipped
        self.states.append(state.copy())
        if skip:
            return Applied(self.commands[-1], np.array([NOT_CALLED]))
        outcome = self.controller.step(state, target, thrust)
        self.commands.append(outcome.command_rad.astype(np.float64))
        return Applied(self.commands[-1], outcome.status)


@pytest.mark.parametrize(
    ("drop_every", "skipped"),
    [(1, range(20, 60)), (3, range(20, 60, 3))],
    ids=["all", "every third"],
)
def test_a_dropped_update_equals_a_controller_that_is_not_called(drop_every: int, skipped: range) -> None:
    """Passing NaN gives the same trace, bit for bit, as not calling the controller."""
    assert fly_with(Fault(20, 60, drop_every=drop_every)).same_bits(fly_start(Recorder(skipped)))


def test_a_dropped_update_leaves_a_quadratic_cost_as_it_is() -> None:
    """There a refused state changes the memory, which is restored."""
    settings = quadratic_settings()
    controller = CompiledController(settings)
    fault = Fault(20, 60, drop_every=3)
    found = fly_start(FaultyController(controller, [fault], controller.instances))
    assert found.same_bits(fly_start(Recorder(range(20, 60, 3), settings)))
    assert not found.same_bits(fly_start(FaultyController(CompiledController(settings), [fault])))


def test_faults_of_weights_need_weights() -> None:
    """A quadratic cost has the others."""
    names = {one.name for one in scenarios(MAMBO)}
    assert {name for name in names if "weight" in name} == names - {
        one.name for one in scenarios(quadratic_settings())
    }


def test_late_commands_are_those_computed_earlier() -> None:
    """During the fault the drone receives the command of 5 updates ago, at first the last one on time."""
    recorder = Recorder()
    applied = fly_start(FaultyController(recorder, [Fault(20, 60, late_updates=5)])).command_rad
    for update in range(len(applied)):
        source = max(update - 5, 19) if 20 <= update < 60 else update
        assert np.array_equal(applied[update], recorder.commands[source]), update


def test_a_fault_of_one_flight_does_not_affect_the_others() -> None:
    """Two fault-free flights beside a faulty one, new weights and levelling included, keep their bits."""
    compiled = CompiledController(MAMBO, 3)
    adjusted = AdjustedController(compiled, 3, [Adjustment(1, 10, "set_weights", (0.0, 0.0))])
    caller = LevellingCaller(adjusted, compiled, np.array([2, 2, 2]))
    nan = Fault(30, 80, SetState(range(1), math.nan))
    together = fly_start(FaultyController(caller, [None, nan, None]), flights=3)
    alone = fly_start(CompiledController(MAMBO))
    for row in (0, 2):
        assert np.array_equal(together.command_rad[:, row], alone.command_rad[:, 0])
        assert np.array_equal(together.position_m[:, row], alone.position_m[:, 0])
    assert not np.array_equal(together.position_m[:, 1], alone.position_m[:, 0])


def test_bad_weights_are_rejected_and_good_ones_accepted() -> None:
    """`answers` has the status of each flight's change; rejected weights change no bit of the flight."""
    alone = fly_start(CompiledController(MAMBO))
    changes = [
        Adjustment(0, 30, "set_weights", (math.nan, 1.0)),
        Adjustment(1, 30, "set_weights", (0.0, 0.0)),
    ]
    adjusted = AdjustedController(CompiledController(MAMBO, 2), 2, changes)
    trace = fly_start(adjusted, flights=2)
    assert adjusted.answers == [(0, Status.BAD_WEIGHT), (1, Status.OK)]
    assert np.array_equal(trace.position_m[:, 0], alone.position_m[:, 0])
    held = trace.command_rad[30:, 1]
    assert (held == held[0]).all()  # both weights 0: the gradient is 0 and the plan stays


def test_a_levelling_caller_commands_zero_tilt_after_its_patience() -> None:
    """The last command is held for 20 rejected steps, then zero tilt; the controller restarts from zero."""
    compiled = CompiledController(MAMBO)
    caller = LevellingCaller(compiled, compiled, np.array([20]))
    trace = fly_start(FaultyController(caller, [Fault(30, 80, SetState(range(1), math.nan))]))
    command = trace.command_rad[:, 0]
    assert (command[30:49] == command[29]).all()
    assert command[29].any()
    assert not command[49:80].any()
    assert np.abs(command[80]).max() <= 5 * 0.0206  # five growing steps of RPROP from zero tilt


CHOSEN = (
    FaultScenario("outage", 1.0, SetState(range(1), math.nan), answers=frozenset({Status.BAD_STATE})),
    FaultScenario("moved", math.inf, move_target(3.0), moved_m=3.0),
    FaultScenario("wrapped", math.inf, WrapYaw(), turning=True),
    FaultScenario("wrongly refused", 1.0, answers=frozenset({Status.BAD_STATE})),
)


@pytest.mark.long
def test_verdicts_match_known_outcomes() -> None:
    """Statuses, errors and recovery are those expected of an outage, a moved target and a wrapped yaw."""
    verdicts = fly_faults(MAMBO, lambda n: CompiledController(MAMBO, n), chosen=CHOSEN)
    assert [(v.course, v.fault) for v in verdicts] == [
        (course, one.name) for course in ("eight", "hover") for one in CHOSEN
    ]
    outage, moved, wrapped, wrong = verdicts[:4]
    assert outage.statuses == ("BAD_STATE",)
    assert outage.expected
    assert outage.end is End.RECOVERED
    assert outage.recovery_s > 0.5
    assert outage.largest_error_m > outage.band_m
    assert 2.9 < moved.largest_error_m < 3.1  # the error at the jump
    assert moved.end is End.RECOVERED
    assert moved.saturated_share > outage.saturated_share
    assert wrapped.recovery_s == 0.0  # the heading is the same
    assert not wrong.expected


VERDICT = Verdict(
    course="eight",
    fault="state NaN, 1 s",
    turning=False,
    statuses=("BAD_STATE",),
    expected=True,
    largest_command_rad=0.3,
    largest_tilt_rad=0.4,
    largest_error_m=1.0,
    band_m=0.1,
    saturated_share=0.25,
    recovery_s=2.0,
    end=End.RECOVERED,
)


@pytest.mark.parametrize(
    ("change", "outcome", "word"),
    [
        ({}, CheckOutcome.PASSED, "no crash"),
        ({"largest_command_rad": 0.3501}, CheckOutcome.FAILED, "a command of 0.3501 rad"),
        ({"largest_command_rad": math.nan}, CheckOutcome.FAILED, "a command of nan rad"),
        ({"expected": False}, CheckOutcome.FAILED, "statuses"),
        ({"end": End.CRASHED}, CheckOutcome.FAILED, "crashed"),
        ({"end": End.NOT_RECOVERED, "recovery_s": math.nan}, CheckOutcome.FAILED, "did not recover"),
        ({"band_m": 17.0, "end": End.NOT_RECOVERED}, CheckOutcome.INCOMPLETE, "without a fault"),
        ({"band_m": math.nan, "end": End.CRASHED}, CheckOutcome.INCOMPLETE, "without a fault"),
    ],
)
def test_the_check_judges_each_rule(change: dict[str, Any], outcome: CheckOutcome, word: str) -> None:
    """One violation beside a passed flight decides outcome and evidence; the figures are valid JSON."""
    found = judge([VERDICT, replace(VERDICT, **change)], MAMBO)
    assert found.outcome is outcome
    assert word in found.evidence
    json.dumps(found.figures, allow_nan=False)


def test_a_fault_without_an_end_need_not_be_recovered_from() -> None:
    """A controller without a valid state cannot return to its target, and passes."""
    gone = replace(VERDICT, fault="state NaN to the end", end=End.NOT_RECOVERED, recovery_s=math.nan)
    assert judge([VERDICT, gone], MAMBO).outcome is CheckOutcome.PASSED


@pytest.mark.long
def test_the_check_passes_the_preset_and_leaves_its_table(tmp_path: Path) -> None:
    """Faults, statuses and ends equal those of the table in the manual."""
    chosen = subject(QUADRATIC, tmp_path)
    found = check(chosen)
    assert found.outcome is CheckOutcome.PASSED, found.evidence
    documented = (DOCS / "faults.md").read_text("utf-8")
    assert words((chosen.folder / "faults.md").read_text("utf-8")) == words(documented)


def words(text: str) -> list[tuple[str, str, str]]:
    """Return fault, status and end of every row of the fault table in `text`, wherever its columns are."""
    tables = [
        [line.strip("| ").split(" | ") for line in table.splitlines()]
        for table in re.findall(r"(?m)(?:^\|.*\n)+", text)
    ]
    (found,) = (table for table in tables if {"fault", "status", "end"} <= set(table[0]))
    fault, status, end = (found[0].index(name) for name in ("fault", "status", "end"))
    rows = [(row[fault], row[status], row[end]) for row in found[2:]]
    assert len(rows) == len(scenarios(QUADRATIC))
    return rows


@pytest.mark.long
def test_the_check_fails_a_controller_that_accepts_nan(tmp_path: Path) -> None:
    """A controller whose check of the state is removed lets NaN reach the plan, and fails."""
    right = "int is_good = is_good_point(state->position_m, state->velocity_m_s)\n                  &&"
    chosen = subject(MAMBO, tmp_path, ("nmpc.c", right, "int is_good = (state != 0) || "))
    assert check(chosen).outcome is CheckOutcome.FAILED


def test_the_documented_caller_compiles_and_levels_out(tmp_path: Path) -> None:
    """The code in docs/evidence/faults.md commands zero tilt from the fifth rejected step on."""
    compiler = require("gcc", "gcc")
    lines = re.search(r"```c\n(.*?)```", (DOCS / "faults.md").read_text("utf-8"), re.DOTALL)
    assert lines is not None
    bundle.write(render(MAMBO), tmp_path / "bundle")
    (tmp_path / "caller.c").write_text(CALLER.replace("LINES", lines[1]), "utf-8")
    sources = sorted(map(str, (tmp_path / "bundle").glob("*.c")))
    command = [compiler, *COMPILE_FLAGS, *WARNING_FLAGS, "-Werror", "-Ibundle", "caller.c", *sources]
    shell(*command, "-o", "caller", folder=tmp_path)
    good, *refused = map(float, shell(tmp_path / "caller").split())
    assert good != 0
    assert refused == [good] * 4 + [0.0] * 2


CALLER = """
#include <stdio.h>
#include "nmpc.h"
int main(void)
{
    nmpc_t controller;
    nmpc_state_t state = { { 1.0f, 1.0f }, { 0.0f, 0.0f }, 0.0f, 0.0f, 0.0f };
    const nmpc_target_t target = { { 0.0f, 0.0f }, { 0.0f, 0.0f } };
    const nmpc_real_t thrust_acceleration_m_s2 = 9.81f;
    nmpc_command_t command;
    nmpc_status_t status;
    int refused = 0;
    int step;

    nmpc_init(&controller);
    for (step = 0; step < 7; step++) {
LINES
        printf("%.9g\\n", (double)command.pitch_rad);
        state.yaw_rad = 2000.0f;
    }
    return 0;
}
"""


def test_the_table_has_one_row_per_fault() -> None:
    """Both courses are side by side; a column for both shows the worse."""
    worse = replace(VERDICT, largest_command_rad=0.35, saturated_share=0.5, end=End.NOT_RECOVERED)
    text = faults_markdown([VERDICT, replace(worse, course="hover")])
    assert (
        "| state NaN, 1 s | not recovered | BAD_STATE | 1.00 | 2.0 | 1.00 | never | 0.35 | 0.40 | 50.0 |"
        in text
    )
    assert "eight 100 mm, hover 100 mm" in text


def test_the_heading_follows_its_yaw_rate() -> None:
    """With a yaw reference of constant rate the drone turns at that rate."""
    trace = fly(Flight(Hover(), duration_s=6.0, yaw_rate_rad_s=0.5), CompiledController(MAMBO))
    assert trace.euler_rad[0, 0, 2] == 0.0
    turned_rad = trace.euler_rad[-1, 0, 2] - trace.euler_rad[-101, 0, 2]
    assert turned_rad == pytest.approx(0.5, rel=0.01)
