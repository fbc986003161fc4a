"""Our controller and a plain roll-out of it, with the interface of the peers: `run(error, last, moves)`.

If `last` is the command of the previous call, the controller continues, warm start included; any other value
resets it to that command.
"""

import math
from importlib import resources
from pathlib import Path
from typing import Final

from benchmarks import peers_setups as problem
from benchmarks.peers_programs import HEAD, Program
from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.literals import real
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.codegen.settings.model import Settings

_GLUE: Final = (
    '#include "nmpc.h"\n\nstatic nmpc_t controller;\nstatic float given[2];\nstatic int is_set;\n\n'
    + HEAD
    + """{
    nmpc_state_t state = {{0, 0}, {0, 0}, 0, 0, 0};
    const nmpc_target_t target = {{0, 0}, {0, 0}};
    nmpc_command_t command;
    int i;

    if (!is_set) {
        nmpc_init(&controller);
        is_set = 1;
    }
    state.position_m[0] = (nmpc_real_t)(error[0] * %(position)s);
    state.velocity_m_s[0] = (nmpc_real_t)(error[1] * %(velocity)s);
    state.position_m[1] = (nmpc_real_t)(error[2] * %(position)s);
    state.velocity_m_s[1] = (nmpc_real_t)(error[3] * %(velocity)s);
    state.roll_rad = command.roll_rad = (nmpc_real_t)(last[0] * %(angle)s);
    state.pitch_rad = command.pitch_rad = (nmpc_real_t)(last[1] * %(angle)s);
    if (last[0] != given[0] || last[1] != given[1]) {
        nmpc_reset(&controller, &command);
    }
    nmpc_step(&controller, &state, &target, (nmpc_real_t)(9.81f * %(thrust)s), &command);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)controller.plan_rad[i] / %(angle)s;
    }
    given[0] = moves[0];
    given[1] = moves[1];
}
"""
)
_ROLLOUT: Final = """/* Constants of benchmarks/rollout.c that nmpc_config.h does not have. */
#define ROLLOUT_HAS_LAG {has_lag}
#define ROLLOUT_KEEPS_PLAN {keeps_plan}
#define ROLLOUT_DECAY {{{decay}}}
#define ROLLOUT_SPEED_LACK {{{speed_lack}}}
#define ROLLOUT_SHIFT_LACK {{{shift_lack}}}
"""


def peers_model() -> Settings:
    """Return the settings of the peers' problem: preset table1 with their prediction step."""
    return with_option(presets.load("table1"), "horizon.prediction_step_s", problem.STEP_S)


def bundle_program(title: str, settings: Settings) -> Program:
    """Return the program of the bundle of `settings`."""
    bits = Design(settings).numbers.bits or {}
    quantities = ("position", "velocity", "angle", "thrust")
    factors = {name: real(math.ldexp(1, bits.get(name, 0)), "float32") for name in quantities}
    return Program(
        "ours", title, "1-norm", settings.code.scalar, ("src/*.c",), ("include", "src"), _GLUE % factors
    )


def rollout_program(title: str, settings: Settings) -> Program:
    """Return the program of the plain roll-out with the model and optimizer of `settings`."""
    glue = resources.files("benchmarks").joinpath("rollout.c").read_text("utf-8")
    return Program("rollout", title, "1-norm", settings.code.scalar, (), (".", "include"), glue)


def place_bundle(settings: Settings, folder: Path) -> None:
    """Write the bundle of `settings` into `folder`."""
    for path, text in render(settings).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, "utf-8")


def place_rollout(settings: Settings, folder: Path) -> None:
    """Write the headers of the roll-out, which supports only rprop+ and the exact position update."""
    place_bundle(settings, folder)
    step_s, model = settings.horizon.prediction_step_s, settings.model
    decay, speed_lack, shift_lack = [], [], []
    for lag_s in (model.roll_lag_s, model.pitch_lag_s):
        decay.append(math.exp(-step_s / lag_s) if lag_s else 0.0)
        speed_lack.append(lag_s * (1 - decay[-1]))
        shift_lack.append(lag_s * (step_s - speed_lack[-1]))
    header = _ROLLOUT.format(
        has_lag=int(model.roll_lag_s > 0 or model.pitch_lag_s > 0),
        keeps_plan=int(settings.optimizer.warm_start == "plan"),
        decay=_pair(decay, settings),
        speed_lack=_pair(speed_lack, settings),
        shift_lack=_pair(shift_lack, settings),
    )
    (folder / "rollout.h").write_text(header, "utf-8")


def _pair(values: list[float], settings: Settings) -> str:
    return ", ".join(real(value, settings.code.scalar) for value in values)
