"""The Crazyflie's app, compiled with stubs of the firmware, and called as the firmware calls it."""

import math
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cffi
import numpy as np

from mambo_extensions.crazyflie import desk
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.thrust_controller import Applied
from tests.support.shell import shell
from tests.support.tools import require

STAND_INS: Final = Path(desk.__file__).parent / "stand_ins"
"""Headers in the place of the firmware's."""
HOST: Final = Path(__file__).parent.parent / "crazyflie_host.c"
FIRMWARE_FLAGS: Final = (
    *("-Os", "-std=gnu11", "-fno-math-errno", "-fno-strict-aliasing", "-fno-strict-overflow"),
    *("-fomit-frame-pointer", "-ffunction-sections", "-fdata-sections"),
    *("-Wall", "-Wdouble-promotion", "-Werror"),
)
"""Flags of the firmware that any gcc takes."""

LIBRARY: Final = ("nmpc", "nmpc_self_test")
"""Sources beside the app's."""

TICKS_PER_UPDATE: Final = 10
"""Ticks of the firmware's loop, 1 ms each, in an update period."""
DEGREES: Final = 180.0 / math.pi

TURNED: Final = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -math.pi / 6.0])
"""A state at rest in the origin, heading to the left by 30 degrees."""

_TYPES = "".join(
    line for line in (STAND_INS / "stabilizer_types.h").read_text("utf-8").splitlines(True) if line[0] != "#"
)
_INTERFACE: Final = cffi.FFI()
_INTERFACE.cdef(
    _TYPES
    + """
    struct variable { const char *type; const char *name; void *address; };
    extern setpoint_t host_flown;
    extern int host_pid_calls;
    extern char host_console[1000];
    extern uint32_t host_time_ms;
    extern bool host_is_flying;
    extern float host_variances[6];
    extern bool host_has_variances;
    extern int host_scheduled;
    extern const struct variable host_logged[];
    extern const struct variable host_parameters[];
    const struct variable *host_find(const struct variable *table, const char *name);
    void controllerOutOfTreeInit(void);
    bool controllerOutOfTreeTest(void);
    void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors,
                             const state_t *state, const stabilizerStep_t step);
    """
)


def compile_host(source: Path, output: Path, *flags: str) -> Path:
    """Compile a source for this machine with the firmware's flags and `flags`; return the object."""
    shell(
        *(require("gcc", "gcc"), *FIRMWARE_FLAGS, *flags, f"-I{STAND_INS}", f"-I{source.parent}", "-fPIC"),
        *("-c", source, "-o", output),
    )
    return output


def link(objects: Sequence[Path], output: Path) -> Any:
    """Link objects as a shared library, and load it."""
    shell(require("gcc", "gcc"), "-shared", *objects, "-lm", "-o", output)
    return _INTERFACE.dlopen(str(output))


class Crazyflie:
    """One drone's app: `tick` is a millisecond, `update` ten of them."""

    def __init__(self, library: Any) -> None:
        self.host = library
        state: Any = _INTERFACE.new("state_t *")
        self.setpoint: Any = _INTERFACE.new("setpoint_t *")
        self.state: Any = state
        self.time_ms = self.ticks = 1000
        self.output: Any = _INTERFACE.new("control_t *")
        self._sensors = _INTERFACE.new("sensorData_t *")
        state.position.z = 1.0
        library.host_is_flying = True
        library.host_variances = [0.0] * 6
        library.controllerOutOfTreeInit()

    @property
    def flown(self) -> Any:
        """The set-point that the PID controller got last."""
        return self.host.host_flown

    @property
    def console(self) -> str:
        """What the app printed."""
        return _INTERFACE.string(self.host.host_console).decode()  # type: ignore[union-attr] # bytes

    def modes(self, mode: str) -> None:
        """Set the modes of x, y and z."""
        self.setpoint.mode.x = self.setpoint.mode.y = self.setpoint.mode.z = getattr(self.host, mode)

    def logged(self, name: str) -> Any:
        """Return the value of a logged variable."""
        found = self.host.host_find(self.host.host_logged, name.encode())
        return self._pointer(found)[0]

    def set_parameter(self, name: str, value: float) -> None:
        """Set a parameter."""
        found = self.host.host_find(self.host.host_parameters, name.encode())
        self._pointer(found)[0] = value

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter."""
        return self._pointer(self.host.host_find(self.host.host_parameters, name.encode()))[0]

    def _pointer(self, variable: Any) -> Any:
        kind = _INTERFACE.string(variable.type).decode()  # type: ignore[union-attr] # bytes
        return _INTERFACE.cast(f"{kind} *", variable.address)

    def tick(self) -> tuple[float, float]:
        """Call the app for the next millisecond; return roll and pitch of what flies, in degrees."""
        self.host.host_time_ms = self.time_ms
        self.host.controllerOutOfTree(self.output, self.setpoint, self._sensors, self.state, self.ticks)
        self.time_ms += 1
        self.ticks += 1
        return self.flown.attitude.roll, self.flown.attitude.pitch

    def place(self, state: FloatArray) -> None:
        """Set the state from [x, y, vx, vy, roll, pitch, yaw], north-east-down."""
        self.state.position.x, self.state.position.y = state[0], -state[1]
        self.state.velocity.x, self.state.velocity.y = state[2], -state[3]
        attitude = self.state.attitude
        attitude.roll, attitude.pitch, attitude.yaw = (
            DEGREES * state[4],
            DEGREES * state[5],
            -DEGREES * state[6],
        )

    def aim(self, target: FloatArray) -> None:
        """Send a set-point with [x, y, vx, vy, ax, ay], north-east-down, in millimetres as cflib does."""
        setpoint = self.setpoint
        values = [int(1000 * value) / 1000 for value in target]
        setpoint.position.x, setpoint.position.y = values[0], -values[1]
        setpoint.velocity.x, setpoint.velocity.y = values[2], -values[3]
        setpoint.acceleration.x, setpoint.acceleration.y = values[4], -values[5]
        setpoint.timestamp = self.time_ms

    def update(self, state: FloatArray) -> tuple[float, float]:
        """Run the ticks of an update with one state, [x, y, vx, vy, roll, pitch, yaw]; return what flies.

        The state is NaN in all ticks but the first, in which the app shall read it.
        """
        self.place(state)
        command = self.tick()
        self.place(np.full(7, np.nan))
        held = {self.tick() for _ in range(TICKS_PER_UPDATE - 1)}
        assert held == {command}, "the command is held between updates"
        return command


class Fleet:
    """A position controller of the closed loop: one app a flight.

    updates_per_setpoint: every how many updates a set-point comes, by radio.
    """

    def __init__(self, apps: Sequence[Crazyflie], updates_per_setpoint: int = 1) -> None:
        self.apps, self._updates = apps, 0
        self._updates_per_setpoint = updates_per_setpoint
        for app in apps:
            app.modes("modeAbs")

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Run the ticks of an update; states (n, 7) and targets (n, 9) as in `PositionController`."""
        del thrust_acceleration_m_s2
        if self._updates % self._updates_per_setpoint == 0:
            for app, one in zip(self.apps, target, strict=True):
                app.aim(one)
        self._updates += 1
        commands = [app.update(one) for app, one in zip(self.apps, state, strict=True)]
        return Applied(np.array(commands) / DEGREES, np.array([app.logged("status") for app in self.apps]))


def app_sources(folder: Path) -> list[Path]:
    """Return the sources of the app in the target's `folder`, without the controller's."""
    return sorted((folder / "src").glob("nmpc_app*.c"))


@dataclass(frozen=True)
class Built:
    """A folder of the target, its objects by the name of their source, and the library that they make."""

    folder: Path
    objects: dict[str, Path]
    library: Path

    def host(self) -> Any:
        """Load a copy of the library: no two drones share the app's variables."""
        with tempfile.TemporaryDirectory(prefix="app-") as folder:
            return _INTERFACE.dlopen(shutil.copy(self.library, folder))

    def app(self) -> Crazyflie:
        """Return a drone with the app as it is."""
        return Crazyflie(self.host())

    def mutant(self, name: str, right: str, wrong: str) -> Crazyflie:
        """Return a drone with an app in which `right`, found once in one of its files, reads `wrong`."""
        texts = {source: source.read_text("utf-8") for source in app_sources(self.folder)}
        assert sum(text.count(right) for text in texts.values()) == 1, f"the template moved on: {right}"
        changed = next(source for source, text in texts.items() if right in text)
        source = changed.with_name(f"mutant_{name.replace(' ', '_')}.c")
        source.write_text(texts[changed].replace(right, wrong), "utf-8")
        compiled = compile_host(source, source.with_suffix(".o"), "-ffp-contract=off")
        objects = self.objects | {changed.stem: compiled}
        return Crazyflie(link([*objects.values()], source.with_suffix(".so")))


def build(folder: Path) -> Built:
    """Compile the target in `folder`."""
    sources = [folder / "src" / f"{name}.c" for name in LIBRARY] + app_sources(folder)
    objects = {
        source.stem: compile_host(source, folder / f"{source.stem}.o", "-ffp-contract=off")
        for source in sources
    } | {"host": compile_host(HOST, folder / "host.o")}
    link([*objects.values()], folder / "app.so")
    return Built(folder, objects, folder / "app.so")


def send(app: Crazyflie, x: float, speed: float = 0.0, acceleration: float = 0.0) -> None:
    """Send a set-point along x."""
    app.aim(np.array([x, 0.0, speed, 0.0, acceleration, 0.0]))


def content(setpoint: Any) -> list[Any]:
    """Return the members of a set-point that the app could change."""
    mode, attitude = setpoint.mode, setpoint.attitude
    values = [mode.x, mode.y, mode.z, mode.roll, mode.pitch, mode.yaw, attitude.roll, attitude.pitch]
    return [*values, setpoint.position.x, setpoint.velocity.x, setpoint.thrust]


def flown_since(app: Crazyflie, state: FloatArray, updates: int) -> list[tuple[float, float]]:
    """Return what flies in the next updates, in a state that does not change."""
    return [app.update(state) for _ in range(updates)]
