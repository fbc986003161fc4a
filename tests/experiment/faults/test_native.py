"""Faults injected in the engine have the bits of those injected in Python."""

import math
from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.experiment.faults.fault import (
    Fault,
    FreezeState,
    KeepInputs,
    ScaleState,
    SetState,
    SetThrust,
    ShiftState,
    ShiftTarget,
    WrapYaw,
)
from mambo_sil.experiment.faults.injection import FaultyController
from mambo_sil.flight import loop
from mambo_sil.flight.controllers.pd import PdController
from mambo_sil.flight.engine.adjusted import Adjustment
from mambo_sil.flight.engine.native import is_native
from mambo_sil.flight.engine.simulate import fly
from tests.support.faults import CHANGES, FAULTS, PATIENCE, UPDATES, faulty_controller, faulty_flight
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import quadratic_settings
from tests.support.tools import toolchain

SCALARS = ("float32", "float64", "fixed")
SETTINGS = {
    f"{norm}, {scalar}": with_option(chosen, "code.scalar", scalar, "test")
    for norm, chosen in (("1-norm", ONE_NORM), ("quadratic", quadratic_settings()))
    for scalar in SCALARS
}


def assert_same_bits(
    chosen: Settings,
    faults: Sequence[Fault | None],
    changes: Sequence[Adjustment],
    patience: Sequence[int],
) -> list[tuple[int, int]]:
    """Fly in C and in Python, compare traces and answers to weights, and return the answers."""
    toolchain("gcc")
    flight = faulty_flight(faults)
    ours, answered = faulty_controller(chosen, faults, changes, patience)
    theirs, expected = faulty_controller(chosen, faults, changes, patience)
    assert is_native(ours)
    assert fly(flight, ours).same_bits(loop.fly(flight, theirs))
    assert answered.answers == expected.answers
    return answered.answers


@pytest.mark.first_is_quick
@pytest.mark.parametrize("kind", SETTINGS)
def test_every_fault_has_the_bits_of_python(kind: str) -> None:
    """Every effect, missing updates, late commands, weights and callers of some patience."""
    changes = CHANGES if kind.startswith("1-norm") else ()
    answers = assert_same_bits(SETTINGS[kind], FAULTS, changes, PATIENCE)
    assert answers == ([(1, Status.BAD_WEIGHT), (4, Status.OK), (1, Status.OK)] if changes else [])


def test_a_fault_around_a_pd_has_the_bits_of_python() -> None:
    """A controller without memory."""
    toolchain("gcc")
    flight = faulty_flight(FAULTS)
    ours, theirs = (FaultyController(PdController(), FAULTS) for _ in range(2))
    assert fly(flight, ours).same_bits(loop.fly(flight, theirs))


NUMBERS = st.sampled_from([0.0, -0.0, math.nan, math.inf, -math.inf, 1e300, 1e-310, 0.5, -3.0])


@st.composite
def faults(draw: st.DrawFn) -> Fault:
    """Draw a fault, which may end before it begins or act on nothing."""
    number = NUMBERS | st.floats()
    columns = st.tuples(st.integers(0, 7), st.integers(0, 7)).map(lambda ends: range(min(ends), max(ends)))
    alter = draw(
        st.one_of(
            st.builds(KeepInputs),
            st.builds(FreezeState),
            st.builds(SetState, columns, number, st.integers(0, 5), st.integers(1, 5)),
            st.builds(ScaleState, st.tuples(*[number] * 7)),
            st.builds(ShiftState, st.tuples(*[number] * 7)),
            st.builds(WrapYaw),
            st.builds(ShiftTarget, st.tuples(*[number] * 6)),
            st.builds(SetThrust, number),
        )
    )
    begin, end = draw(st.integers(0, UPDATES)), draw(st.integers(0, UPDATES + 5))
    return Fault(begin, end, alter, draw(st.integers(0, 4)), draw(st.integers(0, 30)))


@pytest.mark.long
@settings(max_examples=25)
@given(data=st.data())
@pytest.mark.filterwarnings("ignore:invalid value|overflow:RuntimeWarning")
def test_any_fault_has_the_bits_of_python(data: st.DataObject) -> None:
    """Drawn faults with any numbers, among them NaN and infinity."""
    kind = data.draw(st.sampled_from(sorted(SETTINGS)))
    chosen = data.draw(st.lists(faults(), min_size=1, max_size=4))
    row, weight = st.integers(0, len(chosen) - 1), NUMBERS | st.floats(0.0, 10.0)
    change = st.builds(
        Adjustment, row, st.integers(0, UPDATES), st.just("set_weights"), st.tuples(weight, weight)
    )
    changes = (
        data.draw(st.lists(change, max_size=3, unique_by=lambda one: (one.row, one.update)))
        if kind.startswith("1-norm")
        else []
    )
    patience = data.draw(st.lists(st.integers(1, 6), min_size=len(chosen), max_size=len(chosen)))
    assert_same_bits(SETTINGS[kind], chosen, changes, patience)


def test_a_fault_around_python_flies_in_numpy() -> None:
    """The engine calls no Python."""

    class Stubborn:
        """A controller whose step is Python."""

        step = PdController().step

    assert not is_native(FaultyController(Stubborn(), [None]))
    assert is_native(FaultyController(PdController(), [None]))
