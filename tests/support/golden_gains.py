"""The constants of two controllers with a quadratic cost, which must be the same on every processor.

python -m tests.support.golden_gains             print them as JSON, every number with all its digits
python -m tests.support.golden_gains --write     write them to the golden file; read the diff
"""

import json
import sys
from pathlib import Path
from typing import Any, Final

import numpy as np

from mambo_codegen.methods.quadratic.method import Quadratic
from tests.support.quadratic import ONE_MOVE, TWO_MOVES, settings_of

GOLDEN: Final = Path(__file__).with_name("golden_gains.json")
CONTROLLERS: Final = {
    "one move": ONE_MOVE
    | {"model.drag_1_s": 0.067, "observer.measurement_age_s": 0.013, "model.roll_trim_rad": 0.017},
    "two moves": TWO_MOVES | {"model.pitch_gain": 0.93, "model.acceleration_per_tilt": 1.07},
}
_MACHINES: Final = "spectral_radius"
"""Of no effect but the refusal of a loop that is unstable: LAPACK rounds it as the processor does."""


def constants() -> dict[str, dict[str, Any]]:
    """Return the constants of each controller by their names."""
    found: dict[str, dict[str, Any]] = {}
    for name, values in CONTROLLERS.items():
        method = Quadratic(settings_of(values))
        records = (method.law, method.observer, method.attitude)
        joint = {key: value for record in records for key, value in vars(record).items() if key != _MACHINES}
        found[name] = {
            key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in joint.items()
        }
    return found


def _lines(found: dict[str, Any]) -> str:
    """Return constants as JSON, a line each."""
    return "{\n" + ",\n".join(f'  "{key}": {json.dumps(value)}' for key, value in found.items()) + "\n }"


if __name__ == "__main__":
    text = "{\n" + ",\n".join(f' "{name}": {_lines(found)}' for name, found in constants().items()) + "\n}"
    if sys.argv[1:] == ["--write"]:
        GOLDEN.write_text(text + "\n", "utf-8")
    else:
        print(text)
