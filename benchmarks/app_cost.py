"""Instructions of a call of the Crazyflie's app, one every millisecond, and its largest frame.

    python -m benchmarks.app_cost

prints them for settings by `design` and for preset `crazyflie`, by function. The app is compiled with the
firmware's flags and emulated; `app_cost.c` surrounds it. Wants arm-none-eabi-gcc and unicorn.
"""

import bisect
import re
import subprocess
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.app_sizes import COMPILER, FLAGS
from benchmarks.markdown import table
from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse
from mambo_codegen.settings.model import Settings
from mambo_sil.board.emulation.machine import start
from mambo_sil.board.firmware.elf import load
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_flight import chosen_text

SURROUNDINGS: Final = Path(__file__).with_name("app_cost.c")
CORE: Final = "cortex-m4"
HOSTED: Final = (
    *(flag for flag in FLAGS if flag != "-ffreestanding"),
    "-fno-tree-loop-distribute-patterns",
)
"""The firmware's flags; functions of the C library in `app_cost.c` must not become calls of themselves."""
SETTLING_CALLS, COUNTED_CALLS = 400, 600
LINK: Final = ("-nostdlib", "-static", "-Wl,-Ttext=0x10000", "-Wl,-e,cost_start", "-Wl,-u,cost_move")
CALLED: Final = ("cost_start", "cost_move", "cost_call")


SURROUND: Final = ("cost_call", "controllerPid")
"""Functions of `app_cost.c` that stand for what is not the app's."""


@dataclass(frozen=True)
class CallCost:
    """Instructions of a call, in the mean and at most, and in the mean by function.

    frames_bytes: the largest frame of the app's functions, and of the controller's.
    """

    mean: float
    most: int
    by_function: dict[str, float]
    frames_bytes: tuple[int, int]


def call_cost(settings: Settings) -> CallCost:
    """Compile, emulate and count an app on a circle; without the PID controller that it calls."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path, text in render_target(settings, find_target("crazyflie")).items():
            (folder / Path(path).name).write_text(text, "utf-8")
        program, frames_bytes = _build(folder)
        machine = start(program, CORE, counting=True)
        machine.call("cost_start")
        functions = _functions(program)
        counts: list[Counter[str]] = []
        for call in range(SETTLING_CALLS + COUNTED_CALLS):
            machine.call("cost_move")
            machine.take_executed()
            machine.call("cost_call")
            executed = machine.take_executed()
            if call >= SETTLING_CALLS:
                counts.append(_by_function(executed.times, functions))
    together = sum(counts, Counter())
    by_function = {one: number / COUNTED_CALLS for one, number in together.most_common()}
    totals = [sum(one.values()) for one in counts]
    return CallCost(sum(totals) / COUNTED_CALLS, max(totals), by_function, frames_bytes)


def _build(folder: Path) -> tuple[Path, tuple[int, int]]:
    """Compile and link; return the program, and the largest frames of app and controller."""
    objects: list[str] = []
    frames = {"nmpc_app": [0], "nmpc": [0]}
    for source in (*sorted(folder.glob("*.c")), SURROUNDINGS):
        compiled = folder / f"{source.stem}.o"
        command = [COMPILER, *HOSTED, f"-I{folder}", "-fstack-usage", "-c", str(source), "-o", str(compiled)]
        subprocess.run(command, check=True)
        objects.append(str(compiled))
        part = "nmpc_app" if source.stem.startswith("nmpc_app") else source.stem
        if part in frames:
            usage = compiled.with_suffix(".su").read_text("utf-8")
            frames[part] += [int(size) for size in re.findall(r"\t(\d+)\tstatic", usage)]
    program = folder / "app.elf"
    flags = [flag for flag in FLAGS if flag.startswith("-m")]
    kept = [f"-Wl,-u,{name}" for name in CALLED]
    subprocess.run([COMPILER, *flags, *LINK, *kept, *objects, "-lgcc", "-o", str(program)], check=True)
    return program, (max(frames["nmpc_app"]), max(frames["nmpc"]))


def _functions(program: Path) -> list[tuple[int, str]]:
    """Return where each function begins, in order."""
    return sorted(
        (symbol.address, symbol.name) for symbol in load(program).symbols if symbol.kind == "function"
    )


def _by_function(times: Counter[int], functions: list[tuple[int, str]]) -> Counter[str]:
    """Return instructions by function, without those of the surroundings."""
    starts = [start for start, _ in functions]
    found: Counter[str] = Counter()
    for address, number in times.items():
        name = functions[bisect.bisect_right(starts, address) - 1][1]
        if name not in SURROUND:
            found[name] += number
    return found


def main() -> None:
    """Print the tables."""
    derived = parse(chosen_text(vehicle_toml.preset("crazyflie"), "crazyflie"), "design crazyflie")
    for title, settings in (("design crazyflie", derived), ("preset crazyflie", presets.preset("crazyflie"))):
        cost = call_cost(settings)
        app_bytes, controller_bytes = cost.frames_bytes
        print(f"{title}: {cost.mean:.0f} instructions in the mean, {cost.most} at most;")
        print(f"largest frame {app_bytes} B of the app, {controller_bytes} B of the controller\n")
        rows = [
            {"function": one, "instructions": f"{number:.1f}"} for one, number in cost.by_function.items()
        ]
        print(table(rows))


if __name__ == "__main__":
    main()
