"""Controllers for programs: the generated C of some settings, compiled for this machine, for n drones."""

from pathlib import Path
from typing import Final, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods import Step, method_of
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings import controller_toml, presets
from mambo_codegen.settings.key import spell
from mambo_codegen.settings.model import Settings
from mambo_sil.arguments import is_whole, of_shape, require, require_kind, require_path
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.api.states import DroneState, TargetState
from mambo_sil.flight.controllers.compiled import CompiledController

LARGEST_N: Final = 1_000_000


class Controller:
    """n independent controllers with the same settings; the first call of `step` needs no past.

    The C is generated and compiled when the controller is made, and cached; that needs a C compiler.
    Raises BuildError and CacheError if it cannot be, ArgumentError for wrong arguments.
    """

    def __init__(self, settings: Settings, n: int = 1) -> None:
        require_kind("settings", settings, Settings, "Settings; from_preset and from_file read them")
        require(is_whole(n, 1, LARGEST_N), "n", n, f"be a whole number in 1..{LARGEST_N}")
        self.settings, self.n = settings, n
        self._compiled = CompiledController(settings, n)

    @classmethod
    def from_preset(cls, name: str, n: int = 1) -> Self:
        """Return controllers with the settings of a preset; raises SourceNotFoundError."""
        require_kind("name", name, str, f"one of {', '.join(presets.names())}")
        return cls(presets.preset(name), n)

    @classmethod
    def from_file(cls, path: str | Path, n: int = 1) -> Self:
        """Return controllers with the settings of a controller.toml.

        Raises UnreadableFileError, and InvalidSettingsError with all broken rules.
        """
        require_path("path", path, "a controller.toml")
        return cls(controller_toml.read(Path(path)), n)

    @property
    def update_period_s(self) -> float:
        """The time from one call of `step` to the next; a command holds until the next."""
        return self.settings.horizon.update_period_s

    def step(
        self,
        state: DroneState,
        target: TargetState,
        thrust_acceleration_m_s2: ArrayLike = GRAVITY_M_S2,
    ) -> Step:
        """Return the next commands of n drones; call it once in every update period.

        state, target: of n drones.
        thrust_acceleration_m_s2: thrust over mass (n,), or one value for all.

        The result has `command_rad` (n, 2), roll and pitch, never beyond the tilt limit, and `status` (n,):
        0, or why an input was refused, such as NaN or a position out of range
        (`mambo_codegen.methods.inputs.Status`).
        A quadratic cost adds `saturated`, a 1-norm `cost` and `plan_rad`.
        Raises ArgumentError for records of another number of drones, for other shapes, and for targets
        without acceleration where the settings have `target.acceleration = "given"`.
        """
        require_kind("state", state, DroneState, "a DroneState")
        require_kind("target", target, TargetState, "a TargetState")
        for name, record in (("state", state), ("target", target)):
            if len(record.position_m) != self.n:
                raise ArgumentError(
                    f"{name}: has {len(record.position_m)} drones; the controller was made for {self.n}"
                )
        aims = [target.position_m, target.velocity_m_s]
        if self.settings.target.acceleration == "given":
            if target.acceleration_m_s2 is None:
                raise ArgumentError(
                    'target: acceleration_m_s2 is missing; the settings have target.acceleration = "given"'
                )
            aims.append(target.acceleration_m_s2)
        thrusts = of_shape("thrust_acceleration_m_s2", thrust_acceleration_m_s2, (), (self.n,))
        outcome: Step = self._compiled.step(
            np.concatenate([state.position_m, state.velocity_m_s, state.attitude_rad], axis=1),
            np.concatenate(aims, axis=1),
            np.broadcast_to(thrusts, (self.n,)),
        )
        return outcome

    def reset(self, command_rad: ArrayLike = (0.0, 0.0)) -> NDArray[np.int64]:
        """Forget the past; the drones hold the attitudes of `command_rad`, (n, 2) or one pair for all.

        Call it before the first step after a pause. Returns a status (n,), 0 unless a command is refused.
        """
        return self._compiled.reset(self._commands(command_rad))

    def set_command(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Tell that `command_rad`, (n, 2) or one pair for all, was sent in place of the last commands.

        Returns a status (n,). Raises ArgumentError for a 1-norm, whose C has no such function.
        """
        if method_of(self.settings).setter != "set_command":
            norm = self.settings.cost.norm
            raise ArgumentError(
                f'set_command needs cost.norm = "quadratic"; that of the controller is {spell(norm)}'
            )
        return self._compiled.set_command(self._commands(command_rad))

    def _commands(self, command_rad: ArrayLike) -> NDArray[np.float64]:
        return np.broadcast_to(of_shape("command_rad", command_rad, (2,), (self.n, 2)), (self.n, 2))
