"""Sizes of the Crazyflie's app: every source by the firmware's flags, with stand-ins for its headers.

    python -m benchmarks.app_sizes

prints the table, for settings by `design` and for preset `crazyflie`. Wants arm-none-eabi-gcc.
"""

import subprocess
import tempfile
from pathlib import Path
from typing import Final

from benchmarks.evidence.sources import ROOT
from benchmarks.markdown import table
from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_flight import chosen_text

COMPILER: Final = "arm-none-eabi-gcc"
FLAGS: Final = (
    *("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16", "-fconserve-stack"),
    *("-Os", "-std=gnu11", "-fno-math-errno", "-fno-strict-aliasing", "-fno-strict-overflow"),
    *(
        "-fomit-frame-pointer",
        "-ffunction-sections",
        "-fdata-sections",
        "-ffp-contract=off",
        "-ffreestanding",
    ),
    f"-I{ROOT / 'sil/mambo_extensions/crazyflie/desk/stand_ins'}",
    f"-I{ROOT / 'tests/support/crazyflie_libc'}",
)
LIBRARY: Final = {"nmpc.c": "controller, `nmpc.c`", "nmpc_self_test.c": "self-test"}
APP: Final = "the app, with the instance of the controller"
SUM: Final = "together"


def sizes(settings: Settings) -> dict[str, tuple[int, int]]:
    """Return flash and RAM in bytes of controller, self-test, the rest of the app, and together."""
    found = dict.fromkeys((*LIBRARY.values(), APP, SUM), (0, 0))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path, text in render_target(settings, find_target("crazyflie")).items():
            (folder / Path(path).name).write_text(text, "utf-8")
        for source in folder.glob("*.c"):
            flash, ram = _sizes_of(source)
            for part in (LIBRARY.get(source.name, APP), SUM):
                found[part] = found[part][0] + flash, found[part][1] + ram
    return found


def _sizes_of(source: Path) -> tuple[int, int]:
    """Compile a file; return its flash and RAM in bytes."""
    compiled = str(source.with_suffix(".o"))
    subprocess.run([COMPILER, *FLAGS, "-c", str(source), "-o", compiled], check=True)
    command = ["arm-none-eabi-size", compiled]
    printed = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
    code, data, zeros = map(int, printed.splitlines()[1].split()[:3])
    return code + data, data + zeros


def main() -> None:
    """Print the table."""
    derived = chosen_text(vehicle_toml.preset("crazyflie"), "crazyflie")
    columns = {
        "`design crazyflie`": sizes(parse(derived, "design crazyflie")),
        "preset `crazyflie`": sizes(presets.preset("crazyflie")),
    }
    rows = [
        {"part": part}
        | {
            f"{title}: {kind}, B": str(found[part][number])
            for title, found in columns.items()
            for number, kind in enumerate(("flash", "RAM"))
        }
        for part in (*LIBRARY.values(), APP, SUM)
    ]
    print(table(rows))


if __name__ == "__main__":
    main()
