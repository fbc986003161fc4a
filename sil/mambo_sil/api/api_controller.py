"""Controllers for programs: the generated C of some settings, compiled for this machine, for n drones."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Self, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods import method_of
from mambo_codegen.numbers.gravity import GRAVITY_M_S2, hover_thrust
from mambo_codegen.numbers.representation import THRUST
from mambo_codegen.settings import controller_toml, presets
from mambo_codegen.settings.key import spell
from mambo_codegen.settings.model import Settings
from mambo_sil.api.options import ControllerOptions, with_options
from mambo_sil.api.set_points import Heading, HeightHold
from mambo_sil.arguments import (
    as_numbers,
    is_whole,
    of_shape,
    require,
    require_choice,
    require_kind,
    require_path,
)
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import PlacedSensors
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.controllers.compiled import CompiledController, empty_outcome
from mambo_sil.flight.controllers.controller_library import generator_digest
from mambo_sil.flight.names import (
    ALTITUDE_NAMES,
    SENSORS_KINDS,
    SensorsKind,
)
from mambo_sil.flight.states import DroneState, StepOutcome, TargetState
from mambo_sil.model.derive.derived_flight import chosen_text

LARGEST_N: Final = 1_000_000
Lever = tuple[float, float, float]

_RETURNED: Final = ("command_rad", "status", "saturated", "cost", "plan_rad", "active_limits", "thrust_m_s2")
"""The results of a step in C that a program gets."""


class Controller:
    """n independent controllers with the same settings; the first call of `step` needs no past.

    The C is generated and compiled when the controller is made, and cached; that needs a C compiler.
    Pickling, `copy.deepcopy` too, saves settings and state, and refuses the state of other C.
    Raises BuildError and CacheError if it cannot be, ArgumentError for wrong arguments.
    """

    def __init__(self, settings: Settings, n: int = 1, height: HeightHold | None = None) -> None:
        require_kind("settings", settings, Settings, "Settings; from_preset and from_file read them")
        require(is_whole(n, 1, LARGEST_N), "n", n, f"be a whole number in 1..{LARGEST_N}")
        self.settings, self.n = settings, n
        self._compiled = CompiledController(settings, n)
        self._method = method_of(settings)
        self._results = {result.name: result for result in self._method.results}
        self._outcome = empty_outcome(self._method, n, np.intc)
        self._inputs = self._empty_inputs()
        self._step = self._compiled.stepper(self._inputs, self._outcome)
        self._height = height
        self._heading = Heading(self._compiled)
        self._lever_m: Lever | None = None

    def __repr__(self) -> str:
        """Return the settings id, how many drones there are, and what is commanded."""
        settings, drones = self.settings, "1 drone" if self.n == 1 else f"{self.n} drones"
        has_thrust = settings.height is not None or self._height is not None
        commands = "roll, pitch and thrust" if has_thrust else "roll and pitch"
        return (
            f"Controller(settings {settings.short_digest}, {settings.controller.method} cost: {commands} "
            f"of {drones} every {settings.horizon.update_period_s:g} s)"
        )

    @classmethod
    def from_vehicle(
        cls,
        vehicle: str | Path | Vehicle,
        n: int = 1,
        *,
        sensors: SensorsKind | None = None,
        **options: Unpack[ControllerOptions],
    ) -> Self:
        """Return controllers with the settings that `design` derives from a drone.

        vehicle: a name, a vehicle.toml, or a Vehicle.
        sensors: what measures, in place of the sensors in the file; "true" for the state of a simulator.

        Raises ArgumentError for sensors of another name, SourceNotFoundError, UnreadableFileError, and
        InvalidSettingsError with all broken rules, also for sensors that the file has no figures of.
        """
        drone = vehicle.drone if isinstance(vehicle, Vehicle) else _read_vehicle(vehicle)
        if sensors is not None:
            require_choice("sensors", sensors, SENSORS_KINDS)
            drone = drone.with_sensors(sensors)
        settings = controller_toml.parse(chosen_text(drone, drone.name), f"settings for {drone.name}")
        return cls._made(settings, n, drone, options)

    @classmethod
    def from_preset(
        cls, name: str, n: int = 1, *, vehicle: str | Path | None = None, **options: Unpack[ControllerOptions]
    ) -> Self:
        """Return controllers with the settings of a preset; raises SourceNotFoundError.

        vehicle: the drone of the altitude loop that `height` names; without `height` it has no use.
        height:  only where the settings have no `[height]`.
        """
        require_kind("name", name, str, f"one of {', '.join(presets.names())}")
        return cls._made(
            presets.preset(name), n, None if vehicle is None else _read_vehicle(vehicle), options
        )

    @classmethod
    def from_file(
        cls,
        path: str | Path,
        n: int = 1,
        *,
        vehicle: str | Path | None = None,
        **options: Unpack[ControllerOptions],
    ) -> Self:
        """Return controllers with the settings of a controller.toml.

        vehicle, height: as for `from_preset`.
        Raises UnreadableFileError, and InvalidSettingsError with all broken rules.
        """
        require_path("path", path, "a controller.toml")
        drone = None if vehicle is None else _read_vehicle(vehicle)
        return cls._made(controller_toml.read(Path(path)), n, drone, options)

    @classmethod
    def _made(cls, settings: Settings, n: int, drone: VehicleFile | None, options: ControllerOptions) -> Self:
        """Return controllers with options; raises ArgumentError."""
        changed = with_options(settings, options)
        name = options.get("height")
        if name is not None:
            require_choice("height", name, ALTITUDE_NAMES)
            rule = "be left out: the settings have [height], so the controller itself commands the thrust"
            require(changed.height is None, "height", name, rule)
        controller = cls(changed, n)
        if drone is not None and isinstance(drone.sensors, PlacedSensors) and any(drone.sensors.lever_m):
            controller._lever_m = drone.sensors.lever_m
        if name is not None:
            if drone is None:
                raise ArgumentError(
                    f"height = {name!r} must have a vehicle beside it, whose thrust it commands"
                )
            controller._height = HeightHold(name, drone, changed, n)
        return controller

    @property
    def update_period_s(self) -> float:
        """The time from one call of `step` to the next; a command holds until the next."""
        return self.settings.horizon.update_period_s

    def step(
        self, state: DroneState, target: TargetState, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> StepOutcome:
        """Return the next commands of n drones; call it once in every update period.

        state, target: in batches of the same shape, of n drones together.
        thrust_acceleration_m_s2: thrust over mass, of the shape of the batch or one value for all; without it
                                  9.81. With `[height]` in the settings, or `height`, it is commanded.

        Raises ArgumentError for records of another number of drones, for other shapes, and for
        states or targets without z where the thrust is commanded.
        """
        batch = self._batch(state, target)
        if self._lever_m is not None:
            state = state.at_centre(self._lever_m)
        flies_height = self._method.has_height or self._height is not None
        if flies_height:
            left_out, rule = thrust_acceleration_m_s2 is None, "be left out: the step commands it"
            require(left_out, "thrust_acceleration_m_s2", thrust_acceleration_m_s2, rule)
            _require_z(state, target)
        aims = self._aims(target)
        found: dict[str, Any] = {}
        if self._height is not None:
            thrusts = self._height.step(state, target)
            found["thrust_m_s2"] = thrusts.reshape(batch)
        else:
            given = GRAVITY_M_S2 if thrust_acceleration_m_s2 is None else thrust_acceleration_m_s2
            thrusts = of_shape("thrust_acceleration_m_s2", given, (), batch).reshape(-1)
        states, targets, *thrust_numbers = self._inputs
        with np.errstate(over="ignore"):  # infinity, which the C refuses
            self._write(states, self._method.state, self._places(state))
            self._write(targets, self._method.target, aims)
            for numbers in thrust_numbers:
                numbers[:] = self._method.numbers.quantize(thrusts[:, np.newaxis], THRUST)[:, 0]
        self._step()
        found |= {name: self._in_si(name, batch) for name in _RETURNED if name in self._outcome}
        if flies_height:
            wanted_rad = None if target.yaw_rad is None else target.yaw_rad.reshape(-1)
            yaws = self._heading.turn(state.attitude_rad[..., 2].reshape(-1), wanted_rad)
            found["yaw_rad"] = yaws.reshape(batch)
        return StepOutcome(**found)

    def reset(
        self,
        command_rad: ArrayLike = (0.0, 0.0),
        which: ArrayLike | None = None,
        *,
        thrust_m_s2: ArrayLike | None = None,
    ) -> NDArray[np.int64]:
        """Forget the past; the drones hold the attitudes of `command_rad`, one pair for all or (..., 2).

        Call it before the first step after a pause. `which` chooses drones by truth values, of the shape of a
        batch. `thrust_m_s2`, one value for all or (...), is the thrust over mass that the drones have, with
        `[height]` only; without it the thrust of hover. Returns a status (n,), 0 unless a command is refused.
        """
        if thrust_m_s2 is None and self._method.has_height:
            thrust_m_s2 = hover_thrust(self.settings)
        commands, chosen = self._commands(command_rad, thrust_m_s2), self._chosen(which)
        saved = self._compiled.instances.copy()
        status = self._compiled.reset(commands)
        self._compiled.instances[~chosen] = saved[~chosen]
        if self._height is not None:
            self._height.reset(chosen)
        self._heading.reset(chosen)
        return np.where(chosen, status, 0)

    def report_command(
        self, command_rad: ArrayLike, thrust_m_s2: ArrayLike | None = None
    ) -> NDArray[np.int64]:
        """Tell that `command_rad`, one pair for all or (..., 2), was sent in place of the last commands.

        With `[height]` in the settings `thrust_m_s2`, one value for all or (...), was sent beside it; without
        it the thrust is what it was. Returns a status (n,). Raises ArgumentError for a 1-norm, whose C has no
        such function, and for a thrust that has no use.
        """
        if self._method.setter != "report_command":
            method = spell(self.settings.controller.method)
            raise ArgumentError(f'report_command needs controller.method = "quadratic", not {method}')
        if thrust_m_s2 is None and self._method.has_height:
            thrust_m_s2 = self._compiled.last_thrust_m_s2
        return self._compiled.report_command(self._commands(command_rad, thrust_m_s2))

    def report_thrust(self, thrust_m_s2: ArrayLike) -> NDArray[np.int64]:
        """Tell that the drones got another thrust over mass than the last step commanded, as a mixer caps it.

        One value for all or (...); NaN for a drone that got its command. Returns a status (n,), not 0 with
        NaN or out of range. Raises ArgumentError without `[height]` in the settings.
        """
        if not self._method.has_height:
            raise ArgumentError("report_thrust needs settings with [height]")
        return self._compiled.report_thrust(self._one_each("thrust_m_s2", thrust_m_s2))

    def frame_jumped(
        self,
        position_change_m: ArrayLike,
        velocity_change_m_s: ArrayLike | None = None,
        heading_change_rad: ArrayLike = 0.0,
    ) -> NDArray[np.int64]:
        """Tell that the frame of the states has jumped, as when an estimator learns that it was wrong.

        A drone that has not moved is now measured farther, faster and at another heading by these changes:
        vectors (2,) or (3,), one for all, or (..., 2) or (..., 3), z down, which counts with `[height]` only;
        no change of the velocity by default. Call it between two steps, and move the targets likewise, turned
        about the drone: the commands do not jump. Limits stay in the frame. Returns a status (n,), not 0 with
        NaN or out of range. Raises ArgumentError for other shapes, and without z where the height needs it.
        """
        position = self._changes("position_change_m", position_change_m)
        velocity = np.zeros_like(position)
        if velocity_change_m_s is not None:
            velocity = self._changes("velocity_change_m_s", velocity_change_m_s)
        heading = self._one_each("heading_change_rad", heading_change_rad)
        status = self._compiled.frame_jumped(np.column_stack([position, velocity, heading]))
        self._heading.shift(np.where(status == 0, heading, 0.0))
        return status

    @property
    def disturbance_m_s2(self) -> FloatArray:
        """The learnt acceleration (n, 2), x and y, that tilt and drag do not explain, such as that of wind.

        It ends at `observer.disturbance_limit_m_s2` on each axis: a stronger push moves the drone away.
        Raises ArgumentError for a 1-norm, which learns none.
        """
        if self._method.setter != "report_command":
            raise ArgumentError('disturbance_m_s2 needs controller.method = "quadratic"')
        return self._compiled.last_disturbance_m_s2

    def set_position_measured(self, is_measured: ArrayLike) -> NDArray[np.int64]:
        """Tell whether a position is measured, as by cameras: one truth value for all or (...).

        While none is, as over a flow deck, the observer takes coarser gains. Returns a status (n,), always 0.
        Raises ArgumentError without `[guard]` in the settings.
        """
        if self.settings.guard is None:
            raise ArgumentError("set_position_measured needs settings with [guard]")
        measured = np.broadcast_to(np.asarray(is_measured, np.bool_).reshape(-1), self.n)
        return self._compiled.set_position_measured(measured)

    def __getstate__(self) -> dict[str, Any]:
        return {
            "settings": self.settings,
            "n": self.n,
            "height": self._height,
            "lever_m": self._lever_m,
            "yaw_rad": self._heading.yaw_rad,
            "generator": generator_digest(),
            "instances": self._compiled.instances.tobytes(),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        Controller.__init__(self, state["settings"], state["n"], state["height"])
        self._lever_m = state["lever_m"]
        instances = self._compiled.instances
        if (state["generator"], len(state["instances"])) != (generator_digest(), instances.nbytes):
            raise ArgumentError("state: was saved by another version, whose C may keep other numbers")
        instances[:] = np.frombuffer(state["instances"], np.uint8).reshape(instances.shape)
        self._heading.yaw_rad = state["yaw_rad"]

    def _batch(self, state: DroneState, target: TargetState) -> tuple[int, ...]:
        """Return the shape of the batch; raises ArgumentError for records that do not fit."""
        require_kind("state", state, DroneState, "a DroneState")
        require_kind("target", target, TargetState, "a TargetState")
        batch = state.batch
        for name, shape in (("state", batch), ("target", target.batch)):
            if (drones := math.prod(shape)) != self.n:
                raise ArgumentError(f"{name}: has {drones} drones; the controller was made for {self.n}")
        if target.batch != batch and self.n > 1:
            raise ArgumentError(f"target: has a batch of shape {target.batch}; that of the state is {batch}")
        return batch

    def _places(self, state: DroneState) -> list[FloatArray]:
        """Return the columns of states, the height's upwards; raises ArgumentError for a member too few."""
        return self._columns_of("state", state, _STATE)

    def _aims(self, target: TargetState) -> list[FloatArray]:
        """Return the columns of targets; raises ArgumentError if the controller is not told enough."""
        if self._method.has_height:
            for name in ("acceleration_m_s2", "ahead_m_s2"):
                values = getattr(target, name)
                if values is not None and values.shape[-1] != 3:
                    raise ArgumentError(f"target: {name} has no z; [height] wants x, y, z (..., 3)")
        return self._columns_of("target", target, _TARGET)

    def _columns_of(
        self, record: str, given: Any, sources: Mapping[str, Callable[[Any], list[FloatArray]]]
    ) -> list[FloatArray]:
        """Return the columns of the members of a record, from their sources or of the same name."""
        columns = list[FloatArray]()
        for row in self._method.port.rows(record):
            if row.member in sources:
                columns += sources[row.member](given)
            elif (values := getattr(given, row.member, None)) is None:
                raise ArgumentError(f"{record}: {row.member} is missing; the settings want it")
            else:
                flat = np.reshape(values, (self.n, -1)).astype(np.float64)
                columns += [flat[:, axis] for axis in range(self._method.port.count(row))]
        return columns

    def _empty_inputs(self) -> list[NDArray[Any]]:
        """Return the arrays that the C reads: states and targets (n, k), thrusts (n,) without `[height]`."""
        shapes = (self.n, len(self._method.state)), (self.n, len(self._method.target)), (self.n,)
        used = shapes[:2] if self._method.has_height else shapes
        return [np.empty(shape, self._method.numbers.scalar) for shape in used]

    def _write(self, numbers: NDArray[Any], quantities: Sequence[str], columns: list[FloatArray]) -> None:
        """Write columns (n,) in SI units into numbers (n, k) of the C."""
        if self._method.numbers.bits is not None:
            numbers[:] = self._method.numbers.quantize(np.stack(columns, axis=-1), quantities)
            return
        for number, column in enumerate(columns):  # faster than all at once
            numbers[:, number] = column

    def _in_si(self, name: str, batch: tuple[int, ...]) -> NDArray[Any]:
        """Return a copy of a result of the last step, in SI units and with the shape of a batch."""
        numbers, result = self._outcome[name], self._results[name]
        values = self._method.numbers.to_si(numbers, *result.quantities) if result.quantities else numbers
        owned = values.astype(values.dtype if result.quantities else result.count_type)
        return owned.reshape((*batch, *result.shape))

    def _commands(self, command_rad: ArrayLike, thrust_m_s2: ArrayLike | None) -> FloatArray:
        """Return commands (n, 2), with `[height]` (n, 3), of one or of a batch; raises ArgumentError."""
        array = as_numbers("command_rad", command_rad)
        if array.shape == (2,):
            array = np.broadcast_to(array, (self.n, 2))
        elif array.shape[-1:] != (2,) or array.size != 2 * self.n:
            raise ArgumentError(f"command_rad: has shape {array.shape}; it must be (2,) or {(self.n, 2)}")
        angles = array.reshape(self.n, 2)
        if not self._method.has_height:
            left_out, rule = thrust_m_s2 is None, "be left out: the settings have no [height]"
            require(left_out, "thrust_m_s2", thrust_m_s2, rule)
            return angles
        return np.column_stack([angles, self._one_each("thrust_m_s2", thrust_m_s2)])

    def _changes(self, name: str, values: ArrayLike) -> FloatArray:
        """Return changes (n, 2) of vectors, with `[height]` (n, 3), up; raises ArgumentError."""
        array = as_numbers(name, values)
        axes = array.shape[-1] if array.ndim else 0
        if axes not in (2, 3) or (array.ndim > 1 and array.size != axes * self.n):
            rule = f"it must be (2,), (3,), {(self.n, 2)} or {(self.n, 3)}"
            raise ArgumentError(f"{name}: has shape {array.shape}; {rule}")
        vectors = np.broadcast_to(array.reshape(-1, axes), (self.n, axes))
        if not self._method.has_height:
            return vectors[:, :2]
        if axes == 2:
            raise ArgumentError(f"{name}: has no z; the height wants x, y, z (..., 3)")
        return vectors * (1.0, 1.0, -1.0)

    def _one_each(self, name: str, values: ArrayLike | None) -> FloatArray:
        """Return numbers (n,) of one for all drones, or of a batch; raises ArgumentError."""
        array = as_numbers(name, values)
        if array.ndim and array.size != self.n:
            raise ArgumentError(f"{name}: has shape {array.shape}; it must be () or {(self.n,)}")
        return np.broadcast_to(array.reshape(-1), self.n)

    def _chosen(self, which: ArrayLike | None) -> NDArray[np.bool_]:
        """Return which drones (n,) are meant; raises ArgumentError."""
        if which is None:
            return np.ones(self.n, np.bool_)
        array = np.asarray(which)
        good = array.dtype == np.bool_ and array.size == self.n
        require(good, "which", which, f"be {self.n} truth values, one for each drone")
        return array.reshape(self.n)


def _columns(*batches: FloatArray, count: int = 2) -> list[FloatArray]:
    """Return the first columns (n,) of each of several batches of vectors."""
    flat = [values.reshape(-1, values.shape[-1]) for values in batches]
    return [values[:, column] for values in flat for column in range(count)]


def _heights(*batches: FloatArray) -> list[FloatArray]:
    """Return minus z (n,) of each of several batches of vectors: up is positive in the C."""
    return [-values[..., 2].reshape(-1) for values in batches]


_STATE: Final[Mapping[str, Callable[[DroneState], list[FloatArray]]]] = {
    "position_m": lambda state: _columns(state.position_m),
    "velocity_m_s": lambda state: _columns(state.velocity_m_s),
    "roll_rad": lambda state: _columns(state.attitude_rad, count=3)[:1],
    "pitch_rad": lambda state: _columns(state.attitude_rad, count=3)[1:2],
    "yaw_rad": lambda state: _columns(state.attitude_rad, count=3)[2:],
    "height_m": lambda state: _heights(state.position_m),
    "climb_m_s": lambda state: _heights(state.velocity_m_s),
    "on_ground": lambda state: [state.on_ground.reshape(-1).astype(np.float64)],
}
_TARGET: Final[Mapping[str, Callable[[Any], list[FloatArray]]]] = {
    "position_m": lambda target: _columns(target.position_m),
    "velocity_m_s": lambda target: _columns(target.velocity_m_s),
    "acceleration_m_s2": lambda target: _columns_if_known(target, target.acceleration_m_s2),
    "ahead_m_s2": lambda target: _columns_if_known(target, target.ahead_m_s2),
    "known": lambda target: [np.full(math.prod(target.batch), float(target.known))],
    "height_m": lambda target: _heights(target.position_m),
    "climb_m_s": lambda target: _heights(target.velocity_m_s),
    "climb_acceleration_m_s2": lambda target: _heights_if_known(target, target.acceleration_m_s2),
    "climb_ahead_m_s2": lambda target: _heights_if_known(target, target.ahead_m_s2),
}
"""Where the columns of members come from: axes are x, y, z with z down."""


def _columns_if_known(target: TargetState, vectors: FloatArray | None) -> list[FloatArray]:
    """Return the columns of accelerations along x and y, zeros of what is not known."""
    return _columns(np.zeros((*target.batch, 2)) if vectors is None else vectors)


def _heights_if_known(target: TargetState, vectors: FloatArray | None) -> list[FloatArray]:
    """Return the column of accelerations upwards, zeros of what is not known."""
    return _heights(np.zeros((*target.batch, 3)) if vectors is None else vectors)


def _require_z(state: DroneState, target: TargetState) -> None:
    """Raise ArgumentError unless positions and velocities have z."""
    for record, kind in ((state, "state"), (target, "target")):
        for name in ("position_m", "velocity_m_s"):
            if getattr(record, name).shape[-1] != 3:
                raise ArgumentError(f"{kind}: {name} has no z; the height wants x, y, z (..., 3)")


def _read_vehicle(vehicle: str | Path) -> VehicleFile:
    """Return the drone of a name or file, as `design` does; raises ArgumentError for what is neither."""
    require_path("vehicle", vehicle, f"a vehicle.toml, or one of {', '.join(vehicle_toml.names())}")
    return vehicle_toml.read(vehicle) if isinstance(vehicle, Path) else vehicle_toml.load(vehicle)
