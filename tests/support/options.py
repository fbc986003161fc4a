"""The table options x consumers: each option of the settings, and what every consumer makes of it.

An option is a choice, an optional section, a text, or a number that 0 switches off. **Who adds one to the
settings adds a row to `OPTIONS`**, else tests/test_options.py fails. Who adds a consumer adds its name to
`CONSUMERS`, `TARGETS` or `COMMANDS`, that of an extension also to `EXTENSIONS`, a mark to the strings of
marks, and a function to tests/support/option_consumers.py or option_commands.py. A row has what is set, on
top of the values of its base, and a mark for each consumer, in their order:

    =   flown, with the bits of the reference controller, or of the C that another consumer flies
    +   flown or written, where there are no bits to compare
    A-Z refused, in the words of `REFUSALS`
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mambo_codegen.settings.model import Settings
from tests.support.quadratic import settings_of
from tests.support.strategies import Values

CONSUMERS: Final = (
    "fly",  # the C in the engine
    "wrapped",  # faults, held and late commands, limits or weights set in flight: in the engine, and in NumPy
    "campaign",
    "told",  # all that is told between steps: reset, frame_jumped, report_command, set_limits, ...
    "api",  # Controller, from a file
    "height",  # Controller with an altitude loop
    "replay",
    "playground",
    "rotorpy",
    "pilot",  # of a simulated PX4
)
TARGETS: Final = ("arduino", "crazyflie", "espidf", "fmu", "mambo", "pil", "platformio", "px4")
COMMANDS: Final = (
    "port",  # fly --port, with a board behind a serial line
    "faults",
    "fly",
    "reference",  # fly --controller reference
    "numpy",  # fly, in NumPy
    "board",  # fly --on a board that is emulated
    "app",  # fly --app, with the Crazyflie's app
    "campaign",
    "margins",
    "diff",
    "tune",
    "regress",
    "sweep",
    "check-bits",
    "footprint",
    "verify",
)
"""What the command line does besides."""
EXTENSIONS: Final = {
    "app": "crazyflie",
    "pilot": "mavlink",
    "playground": "playground",
    "port": "pil",
    "tune": "tune",
    **{name: name for name in ("crazyflie", "fmu", "pil", "px4")},
}
"""The extension of a consumer that is none of the core's."""


def installed(columns: Iterable[str]) -> list[str]:
    """Return the consumers without those whose extension's folder is not there."""
    folder = Path(__file__).parents[1] / "extensions"
    return [one for one in columns if one not in EXTENSIONS or (folder / EXTENSIONS[one]).is_dir()]


REFUSALS: Final = {
    "H": r"be left out: the settings have \[height\]",
    "N": r"the settings have no \[height\].* derive settings",
    "L": r"wants settings with \[height\],.* derive them",
}
"""The sentence with which a consumer refuses an option, and says what to do."""

Base = Values
PAPER: Final[Base] = {}
"""The paper's controller: a 1-norm."""
LEVEL: Final[Base] = {
    "controller.method": "quadratic",
    "model.roll_lag_s": 0.28,
    "model.pitch_lag_s": 0.154,
    "model.roll_delay_s": 0.045,
    "model.pitch_delay_s": 0.06,
}
"""A quadratic cost, for the Mambo."""
SPACE: Final[Base] = {
    "controller.method": "quadratic",
    "cost.response_time_s": 0.15,
    "model.roll_lag_s": 0.1347,
    "model.pitch_lag_s": 0.1347,
    "height.lag_s": 0.072,
    "height.thrust_max_m_s2": 15.2,
    "limits.tilt_rad": 0.5,
}
"""A controller of the height, for the Crazyflie."""
ALL: Final[Base] = SPACE | {
    "model.tilt": "exact",
    "limits.tilt_rad": 0.8,
    "limits.speed_m_s": 1.5,
    "limits.fence.x_max_m": 0.6,
    "limits.fence.ceiling_m": 1.2,
    "observer.tilt_gain": "learnt",
    "guard.tilt_budget_rad_s": 1.0,
    "horizon.ramp_s": 0.4,
}
"""What there is of a quadratic cost, at once."""


@dataclass(frozen=True)
class Option:
    """A row: what is set, on top of which base, and the marks of the consumers, targets and commands."""

    base: Base
    values: Values
    marks: str

    @property
    def settings(self) -> Settings:
        """The settings with the option."""
        return settings_of(self.base | self.values)

    def mark(self, columns: tuple[str, ...], name: str) -> str:
        """Return what a consumer makes of it; `columns` is the tuple that has its name."""
        return self.marks.split()[(CONSUMERS, TARGETS, COMMANDS).index(columns)][columns.index(name)]


# fly wrapped campaign told api height replay playground rotorpy pilot; targets; commands
_BY_COMMAND: Final = " =+====+++++++=+="
_PAPER: Final = "=======+=N +++++++L" + _BY_COMMAND
_LEVEL: Final = "=======+=N +++++++L" + _BY_COMMAND
_SPACE: Final = "=====H=+=+ ++++++++" + _BY_COMMAND
"""Those of a controller of the height with limits, which PX4 wants."""

_LIMITS: Final[Values] = {
    "limits.speed_m_s": 1.5,
    "limits.braking_m_s2": 2.0,
    "limits.fence.x_min_m": -0.7,
    "limits.fence.x_max_m": 0.8,
    "limits.fence.y_min_m": -0.7,
    "limits.fence.y_max_m": 0.8,
}

OPTIONS: Final[dict[str, Option]] = {
    # The first row is in the quick tests.
    "height": Option(SPACE, {"height.lag_s": 0.072}, _SPACE),
    "1-norm": Option(PAPER, {"controller.method": "1-norm"}, _PAPER),
    "1-norm, tracked": Option(PAPER, {"target.acceleration": "tracked"}, _PAPER),
    "1-norm, limits": Option(PAPER, _LIMITS, _PAPER),
    "1-norm, lags": Option(PAPER, {"model.roll_lag_s": 0.28, "model.pitch_lag_s": 0.154}, _PAPER),
    "1-norm, damping": Option(
        PAPER,
        {"model.roll_lag_s": 0.28, "model.pitch_lag_s": 0.154}
        | {"damping.roll_rate_feedback_s": 0.05, "damping.pitch_rate_feedback_s": 0.02},
        _PAPER,
    ),
    "printed position update": Option(PAPER, {"model.position_update": "printed"}, _PAPER),
    "printed yaw convention": Option(PAPER, {"model.yaw_convention": "printed"}, _PAPER),
    "thrust of hover": Option(PAPER, {"model.thrust": "hover"}, _PAPER),
    "irprop-": Option(PAPER, {"optimizer.variant": "irprop-"}, _PAPER),
    "warm start by the plan": Option(PAPER, {"optimizer.warm_start": "plan"}, _PAPER),
    "no tolerance, no effort": Option(
        PAPER | {"cost.tracking_weight": 5.0},
        {"optimizer.tolerance": 0.0, "cost.effort_weight": 0.0},
        _PAPER,
    ),
    "1-norm, float64": Option(PAPER, {"code.scalar": "float64"}, _PAPER),
    "1-norm, fixed": Option(PAPER, {"code.scalar": "fixed"}, _PAPER),
    "quadratic": Option(LEVEL, {"controller.method": "quadratic"}, _LEVEL),
    "predicted attitude": Option(LEVEL, {"model.start_attitude": "predicted"}, _LEVEL),
    "learnt gain": Option(LEVEL, {"observer.tilt_gain": "learnt"}, _LEVEL),
    "ramp": Option(LEVEL, {"horizon.ramp_s": 0.4}, _LEVEL),
    "attitude model": Option(
        LEVEL,
        {"model.roll_delay_s": 0.03, "model.pitch_delay_s": 0.0}
        | {"model.roll_integral_1_s": 1.0, "model.pitch_integral_1_s": 0.77}
        | {"model.roll_trim_rad": 0.02, "model.pitch_trim_rad": -0.01, "model.drag_1_s": 0.1},
        _LEVEL,
    ),
    "damping": Option(
        LEVEL,
        {"damping.roll_rate_feedback_s": 0.05, "damping.pitch_rate_feedback_s": 0.02},
        _LEVEL,
    ),
    "age, velocity weight": Option(
        LEVEL, {"observer.measurement_age_s": 0.02, "cost.velocity_weight_s": 0.1}, _LEVEL
    ),
    "no outage, no disturbance": Option(
        LEVEL, {"observer.outage_s": 0.0, "observer.disturbance_limit_m_s2": 0.0}, _LEVEL
    ),
    "limits": Option(LEVEL, _LIMITS, _LEVEL),
    "guard": Option(LEVEL, {"guard.tilt_budget_rad": 0.02, "guard.tilt_budget_rad_s": 0.1}, _LEVEL),
    "float64": Option(LEVEL, {"code.scalar": "float64"}, _LEVEL),
    "fixed": Option(LEVEL, {"code.scalar": "fixed"}, _LEVEL),
    "prefix": Option(LEVEL, {"code.prefix": "own"}, _LEVEL),
    "exact tilt": Option(SPACE, {"model.tilt": "exact", "limits.tilt_rad": 0.8}, _SPACE),
    "acceleration learnt": Option(SPACE, {"height.learnt": "acceleration"}, _SPACE),
    "acceleration learnt, no limit": Option(
        SPACE, {"height.learnt": "acceleration", "height.learnt_acceleration_limit_m_s2": 0.0}, _SPACE
    ),
    "nothing learnt": Option(SPACE, {"height.learnt": "none"}, _SPACE),
    "height, delay, no weight, no limit": Option(
        SPACE,
        {"height.delay_s": 0.02, "height.velocity_weight_s": 0.0, "height.learnt_gain_limit": 0.0},
        _SPACE,
    ),
    "height, limits": Option(
        SPACE,
        {"limits.speed_m_s": 1.5, "limits.fence.floor_m": 0.8, "limits.fence.ceiling_m": 1.1},
        _SPACE,
    ),
    "height, guard": Option(
        SPACE, {"guard.thrust_budget_m_s2": 1.0, "guard.thrust_budget_m_s3": 10.0}, _SPACE
    ),
    "all, float32": Option(ALL, {"code.scalar": "float32"}, _SPACE),
    "all, float64": Option(ALL, {"code.scalar": "float64"}, _SPACE),
    "all, fixed": Option(ALL, {"code.scalar": "fixed"}, _SPACE),
}
"""The table, a row an option; what a row sets that its base has too is what the option is about."""
