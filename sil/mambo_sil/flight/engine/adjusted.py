"""Controllers whose weights or limits change in flight."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.flight.controllers.compiled import SETTERS, CompiledController, Setter
from mambo_sil.flight.controllers.thrust_controller import adapted, innermost
from mambo_sil.flight.engine.engine_library import ffi, pointer
from mambo_sil.flight.engine.native import Native, foreign
from mambo_sil.flight.loop import Outcome, PositionController


@dataclass(frozen=True)
class Adjustment:
    """New weights or limits of flight `row`, set before update `update`; the first of a flight is 0.

    values: tracking and effort weight, or the seven numbers of nmpc_limits_t.
    """

    row: int
    update: int
    setter: Setter
    values: tuple[float, ...]


class AdjustedController:
    """n controllers whose weights or limits change in flight.

    Controllers of the batch that do not change receive NaN, which they reject. `controller` has the functions
    `set_weights` and `set_limits` that the adjustments name; its twin in sil/mambo_sil/flight/engine/faults.c
    calls compiled controllers only.
    """

    def __init__(self, controller: PositionController, n: int, adjustments: Sequence[Adjustment]) -> None:
        self.controller = adapted(controller)
        self._n = n
        self._adjustments = adjustments
        self._update = 0
        self._status = np.full(len(adjustments), NOT_CALLED, np.int64)

    @property
    def answers(self) -> list[tuple[int, int]]:
        """Row and status of each adjustment that was made, in the order of those given."""
        return [
            (adjustment.row, int(status))
            for adjustment, status in zip(self._adjustments, self._status, strict=True)
            if status != NOT_CALLED
        ]

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Outcome:
        """Set what is due at this update, and step."""
        for setter in SETTERS:
            due = [
                index
                for index, one in enumerate(self._adjustments)
                if one.update == self._update and one.setter == setter
            ]
            if due:
                rows = [self._adjustments[index].row for index in due]
                given = [self._adjustments[index].values for index in due]
                values = np.full((self._n, len(given[0])), np.nan)
                values[rows] = given
                self._status[due] = getattr(innermost(self.controller), setter)(values)[rows]
        self._update += 1
        outcome: Outcome = self.controller.step(state, target, thrust_acceleration_m_s2)
        return outcome

    def wrap(self, engine: Any, inner: Native) -> Native:
        """Return the same around `inner` in the engine, for one flight of each controller from its start.

        The engine writes the answer to each adjustment into its element of the statuses.
        """
        compiled = innermost(self.controller)
        assert isinstance(compiled, CompiledController)
        records = ffi.new("engine_adjusted_t[]", self._n)
        kept: list[Any] = [self._status]
        for row in range(self._n):
            records[row].controller, records[row].memory = inner.step, inner.instance(row)
            own = [index for index, one in enumerate(self._adjustments) if one.row == row]
            due = ffi.new("engine_adjustment_t[]", len(own))
            for place, index in enumerate(own):
                one = self._adjustments[index]
                function, values = compiled.native_setter(one.setter, [one.values])
                due[place].update = one.update
                due[place].set = foreign("engine_setter_t", function)
                due[place].values = pointer("char *", values)
                due[place].status = pointer("int64_t *", self._status[index : index + 1])
                kept.append(values)
            records[row].adjustments, records[row].count = due, len(own)
            kept.append(due)
        return inner.wrapped(
            engine.engine_adjusted_step, records, ffi.sizeof("engine_adjusted_t"), tuple(kept)
        )
