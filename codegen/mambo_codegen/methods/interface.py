"""What a method gives: the one interface between a controller's method and everything else."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.limits_constants import LEAST_SQUARE
from mambo_codegen.methods.shared.math import Real
from mambo_codegen.methods.shared.proofs import FIXED_PROOFS, with_limits
from mambo_codegen.port.row import BYTE, NUMBER, SUM
from mambo_codegen.settings.key import Refusal


class Step(Protocol):
    """The result of one step of n controllers: status (n,), command_rad (n, 2), and results of the method."""

    @property
    def status(self) -> NDArray[np.int64]:
        """A `Status` each."""

    @property
    def command_rad(self) -> Real:
        """Roll and pitch commands, in rad."""


class ReferenceController(Protocol):
    """n controllers in NumPy that compute the bits of the generated C.

    Every operation has the order and the brackets of the C templates, in the scalar type of the settings.
    `@`, `numpy.dot` and `numpy.sum` are not used in methods, because they may reorder additions.
    """

    memory: Any

    def step(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> Step:
        """Compute the next commands.

        state (n, 7): x, y (m), vx, vy (m/s), roll, pitch, yaw (rad), world frame, north-east-down.
        target (n, 4): x, y (m), vx, vy (m/s); (n, 9) with ax, ay and both 0.05 s later (m/s^2) and what is
            known of these (0, 1 or 2) where the target is observed.
        thrust_acceleration_m_s2 (n,): thrust over mass, up.

        With [height] state (n, 10) has height (m), climb (m/s) and contact with the floor (0 or 1) besides,
        up positive; target has height and climb besides, and where it is observed the climb's acceleration
        and that 0.05 s later; and there is no thrust, which the controller commands.
        """

    def reset(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Forget the past, and hold `command_rad` (n, 2), with [height] (n, 3): the thrust over mass too."""

    def frame_jumped(self, change: ArrayLike) -> NDArray[np.int64]:
        """Move what is known with jumps of the frame (n, 5): x, y (m), vx, vy (m/s), heading (rad).

        With [height] (n, 7): x, y, height, vx, vy, climb, heading.
        """

    @property
    def stored_limits(self) -> Real:
        """What follows from the limits (n, k), in the numbers of the C; k is 0 without limits."""

    @property
    def last_estimate(self) -> Real:
        """All numbers of nmpc_estimate_t (n, k), in the numbers of the C; k is 0 where there is none."""

    @property
    def deciding(self) -> NDArray[np.bool_]:
        """Which rows of its tables decided the last moves (n, k), or the last gradients of a search."""

    @property
    def has_estimate(self) -> NDArray[np.bool_]:
        """Whether the estimate is valid (n,)."""

    @property
    def outcome(self) -> Mapping[str, NDArray[Any]]:
        """What the last call left, in the numbers of the C."""


@dataclass(frozen=True)
class StepResult:
    """A result of a step in C, in the order of nmpc_outcome_t.

    quantities: of the numbers along the last axis, one for all of them; none for a count.
    shape:      for one controller.
    count_type: type of a count in the reference.
    """

    name: str
    quantities: tuple[str, ...] = ()
    shape: tuple[int, ...] = ()
    count_type: type = np.int64


@dataclass(frozen=True)
class LinearLaw:
    """A law that is linear in the state as long as no limit acts, and its observer, in SI units.

    gain:          (2, 3) command of roll and pitch per position error, velocity error and acceleration of the
                   disturbance less the target's.
    loops:         of roll and pitch, the transition of the states that act on the position, which is the
                   first of them, in a control step.
    observer_gain: (3, 2) corrections of position, velocity and disturbance by the innovations of position and
                   velocity.
    """

    gain: NDArray[np.float64]
    loops: tuple[NDArray[np.float64], NDArray[np.float64]]
    observer_gain: NDArray[np.float64]


class Method(Constants):
    """A method with its settings: the constants and all that other parts of the project ask a method for.

    folder:      the folder of its templates.
    step_type:   the class of its steps.
    sub_blocks:  the chapters of nmpc.c in the order of a control step, with a word on each.
    setter:      the C function, less its prefix, that sets what only this method has.
    digested:    what a step leaves that the self-test digest covers behind status and flags, in its order, as
                 far as there is.
    iterates:    whether it searches the moves by iterations over a horizon.
    unnamed:     sections and keys that the settings' digest leaves out at their defaults: what came later.
    """

    folder: ClassVar[str]
    step_type: ClassVar[type]
    sub_blocks: ClassVar[Mapping[str, str]]
    setter: ClassVar[str]
    digested: ClassVar[tuple[str, ...]]
    iterates: ClassVar[bool]
    unnamed: ClassVar[tuple[str, ...]]
    float_proofs: ClassVar[Mapping[str, tuple[str, ...]]]

    @property
    def chapters(self) -> tuple[tuple[str, str], ...]:
        """The chapters of nmpc.c with these settings, and a word on each."""
        presence = self.presence
        return tuple(item for item in self.sub_blocks.items() if presence.get(item[0], True))

    @abstractmethod
    def refusals(self) -> list[Refusal]:
        """Return why a controller cannot have the settings."""

    @abstractmethod
    def reference_controller(self, n: int = 1) -> ReferenceController:
        """Return n controllers in NumPy that compute the bits of the C."""

    @property
    @abstractmethod
    def results(self) -> tuple[StepResult, ...]:
        """The results of a step."""

    def make_step(self, results: Mapping[str, NDArray[Any]]) -> Any:
        """Return the step that has `results`, in SI units and with the types of the reference."""
        return self.step_type(
            **{
                one.name: self.numbers.to_si(results[one.name], *one.quantities)
                if one.quantities
                else results[one.name].astype(one.count_type)
                for one in self.results
            }
        )

    @property
    @abstractmethod
    def setter_quantities(self) -> tuple[str, ...]:
        """The quantities of the numbers that `setter` reads."""

    @property
    @abstractmethod
    def work(self) -> tuple[int, int]:
        """What a control step costs: predicted states per iteration, and iterations."""

    @property
    def instance_bytes(self) -> int:
        """The size of nmpc_t: its numbers, sums and single bytes, with padding."""
        number_bytes, sum_bytes = self.numbers.bytes
        numbers, sums, flags = (
            sum(1 for _ in self.port.kept("controller", kind)) for kind in (NUMBER, SUM, BYTE)
        )
        unit = sum_bytes if sums else number_bytes
        return _padded(_padded(numbers * number_bytes, unit) + (sums * sum_bytes) + flags, unit)

    @property
    @abstractmethod
    def context(self) -> dict[str, object]:
        """What only this method's templates insert."""

    @property
    def outage_steps(self) -> int | None:
        """Control steps without a good state over which the method flies on by an estimate; None without."""
        return None

    @property
    def least_square(self) -> float:
        """In floating point every square whose root the C takes is at least this, in the units of each."""
        return LEAST_SQUARE

    @property
    def proofs(self) -> Mapping[str, tuple[str, ...]]:
        """Options of Frama-C for each proof of the scalar type, by entry function."""
        if self.numbers.formats is not None:
            return FIXED_PROOFS
        return self.float_proofs if self.limiting is None else with_limits(self.float_proofs)

    @property
    def assumed_contracts(self) -> tuple[str, ...]:
        """Functions of the C whose contracts no proof proves: tests compute them for every float."""
        return ("inverse_root",) if self.limiting and self.numbers.formats is None else ()

    @property
    def linear_law(self) -> LinearLaw | None:
        """The law in control terms; None for a method whose commands are not linear in the state."""
        return None


def _padded(count: int, unit: int) -> int:
    """Return the next multiple of `unit`."""
    return -(-count // unit) * unit
