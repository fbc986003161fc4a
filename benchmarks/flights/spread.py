"""How much a flight's IAE depends on chance: the same flight from twelve starts within a millimetre.

A small change of the start changes the last bits of every state, later the sign of a slope, and then a whole
step of RPROP. A figure of one flight is therefore one draw of a distribution; this prints median and range.
"""

from typing import Any, Final

import numpy as np

from benchmarks.markdown import table
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import PdController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.scenario import Scenario, flight_of

STARTS: Final = 12
RADIUS_M: Final = 0.001

CASES: Final[dict[str, dict[str, Any]]] = {
    "Table II case": {},
    "yaw 0.8 rad": {"yaw_rad": 0.8},
    "push 0.5 m/s^2 along x": {"push_m_s2": (0.5, 0.0)},
    "push 0.5 m/s^2 along y": {"push_m_s2": (0.0, 0.5)},
    "motor lag 0.03 s": {"motor_lag_s": 0.03},
    "circle, 1 m, 1 rad/s": {"trajectory": "circle", "size_m": 1.0, "rate_rad_s": 1.0},
    "circle, 1 m, 1.5 rad/s": {"trajectory": "circle", "size_m": 1.0, "rate_rad_s": 1.5},
}
CONTROLLERS: Final = (
    ("pd", ""),
    *(
        (preset, scalar)
        for preset in ("mambo", "mambo-1norm", "table1")
        for scalar in ("float32", "float64", "fixed")
    ),
)


def offsets() -> FloatArray:
    """Return the starts (12, 2): drawn evenly from a disc."""
    rng = np.random.default_rng(0)
    radius, angle = RADIUS_M * np.sqrt(rng.random(STARTS)), 2.0 * np.pi * rng.random(STARTS)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def iae(case: dict[str, Any], preset: str, scalar: str) -> FloatArray:
    """Return the IAE (12,) of a case from every start."""
    settings = presets.load("mambo" if preset == "pd" else preset)
    flights = [Scenario(start_offset_m=(x, y, 0.0), **case) for x, y in offsets().tolist()]
    flight = flight_of(flights, settings.horizon.update_period_s)
    if preset == "pd":
        return measure(fly(flight, PdController())).iae_m_s
    chosen = with_option(settings, "code.scalar", scalar)
    return measure(fly(flight, CompiledController(chosen, STARTS))).iae_m_s


def main() -> None:
    """Print a table in Markdown: median, least and largest IAE by case and controller."""
    rows = []
    for name, case in CASES.items():
        row = {"IAE, m s": name}
        for preset, scalar in CONTROLLERS:
            found = iae(case, preset, scalar)
            row[f"{preset} {scalar}".strip()] = (
                f"{np.median(found):.3g} ({found.min():.3g}..{found.max():.3g})"
            )
        rows.append(row)
    print(table(rows))


if __name__ == "__main__":
    main()
