"""Fly the Crazyflie's firmware on the desk with the generated app inside, beside its own controllers."""

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Final

from benchmarks.firmware.build import TESTED, NoFirmwareError
from benchmarks.firmware.pictures import draw
from benchmarks.firmware.suites import fly_everything
from mambo_codegen.errors import BuildError
from mambo_sil.results.folders import finite

VARIABLE: Final = "CRAZYFLIE_FIRMWARE"
"""Environment variable that names the clone where the option does not."""


def main(arguments: list[str]) -> int:
    """Fly, and write summary.json and pictures into a folder; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.firmware", description=__doc__)
    parser.add_argument(
        "--firmware",
        type=Path,
        default=os.environ.get(VARIABLE),
        help=f"clone of the firmware of Bitcraze, tested with {TESTED}; default: ${VARIABLE}",
    )
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("build/firmware"), help="folder for the results"
    )
    given = parser.parse_args(arguments)
    if given.firmware is None:
        parser.error(f"no firmware: clone it and name it by --firmware or {VARIABLE}")
    try:
        figures, paths = fly_everything(given.firmware, print)
    except (NoFirmwareError, BuildError) as error:
        print(error, file=sys.stderr)
        return 2
    given.output.mkdir(parents=True, exist_ok=True)
    text = json.dumps(finite(figures), indent=1, allow_nan=False)
    (given.output / "summary.json").write_text(text + "\n", "utf-8")
    draw(paths, given.output)
    print(f"{given.output}: summary.json, firmware-paths.png, firmware-events.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
