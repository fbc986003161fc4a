"""The manoeuvre to identify a drone with: a figure of eight with a sum of sines on top, as a file to fly.

The figure tilts the drone by some degrees, which shows the gain; the sines, which move it by a centimetre but
tilt it by one degree, separate lag and dead time.
"""

import math
from pathlib import Path
from typing import Final

import jinja2
import numpy as np

from mambo_codegen.atomic import put
from mambo_codegen.errors import FileExistsRefusedError, UnwritableError, echo
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import TrajectoryError
from mambo_sil.model.identify.signals import DEGREE

SIZE_M: Final = 0.8
HEIGHT_M: Final = 0.28
"""Half-widths of the figure along x and along y, which the drone follows twice as often."""
RATE_RAD_S: Final = 1.2
DURATION_S: Final = 44.0
RAMP_S: Final = 4.0
"""Time over which the figure grows from a point, and shrinks to one at the end."""

SINES_HZ: Final = (0.5, 0.9, 1.6, 2.6, 3.7, 5.1)
SINES_RAD: Final = DEGREE
"""Rms of the tilt that the sum of sines needs."""

PERIOD_S: Final = 0.01
"""Time between two waypoints: an update of the controller, so that its target accelerates evenly."""

_SCRIPT: Final = "crazyflie.py.j2"


def sines() -> list[tuple[float, float, float, float]]:
    """Return frequency in Hz, amplitude in m, and phases along x and y of each sine.

    All need the same tilt. The phases are Schroeder's (1970), which keep the peaks low.
    """
    tilt_rad = SINES_RAD * math.sqrt(2.0 / len(SINES_HZ))
    found = []
    for number, hz in enumerate(SINES_HZ):
        amplitude_m = GRAVITY_M_S2 * tilt_rad / (2.0 * math.pi * hz) ** 2
        phase = math.pi * number * number / len(SINES_HZ)
        found.append((hz, float(f"{amplitude_m:.3g}"), round(phase, 3), round(phase + 0.5 * math.pi, 3)))
    return found


def reference_m(time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x and y (k,) at times (k,) from 0 to `DURATION_S`; the manoeuvre starts and ends at 0, 0."""
    share = np.clip(np.minimum(time_s, DURATION_S - time_s) / RAMP_S, 0.0, 1.0)
    grown = share * share * (3.0 - 2.0 * share)
    x = SIZE_M * np.sin(RATE_RAD_S * time_s)
    y = HEIGHT_M * np.sin(2.0 * RATE_RAD_S * time_s)
    for hz, amplitude_m, phase_x, phase_y in sines():
        x = x + amplitude_m * np.sin(2.0 * math.pi * hz * time_s + phase_x)
        y = y + amplitude_m * np.sin(2.0 * math.pi * hz * time_s + phase_y)
    return grown * x, grown * y


def write_manoeuvre(path: Path) -> str:
    """Write the manoeuvre to a new file, as waypoints or script by its ending; return what to do with it.

    Raises TrajectoryError for another ending, FileExistsRefusedError and UnwritableError.
    """
    name = echo(str(path))
    forms = {".csv": waypoints_csv, ".py": crazyflie_script}
    form = forms.get(path.suffix.lower())
    if form is None:
        raise TrajectoryError(f"--manoeuvre {name} must end in .csv for waypoints, or in .py for a Crazyflie")
    if path.exists():
        raise FileExistsRefusedError(f"{name}: exists; name another file")
    try:
        put(path, form().encode())
    except OSError as error:
        raise UnwritableError(f"{name}: cannot be written: {error.strerror or error}") from error
    room = f"{2.0 * SIZE_M + 1.0:.1f} m by {2.0 * HEIGHT_M + 1.0:.1f} m"
    if form is waypoints_csv:
        return (
            f"{name}: {DURATION_S:g} s of waypoints (time_s, x_m, y_m) in {room}; fly them, and log the "
            "commanded and measured angles at 100 Hz"
        )
    return f"{name}: in {room} of free space run: python {name} radio://0/80/2M/E7E7E7E7E7 flight.csv"


def waypoints_csv() -> str:
    """Return the manoeuvre as the waypoints that `fly --trajectory` reads."""
    time_s = PERIOD_S * np.arange(round(DURATION_S / PERIOD_S) + 1, dtype=np.float64)
    rows = zip(time_s.tolist(), *(each.tolist() for each in reference_m(time_s)), strict=True)
    lines = [f"{time:.2f},{x + 0.0:.7f},{y + 0.0:.7f}" for time, x, y in rows]
    return "\n".join(["time_s,x_m,y_m", *lines]) + "\n"


def crazyflie_script() -> str:
    """Return a script that flies the manoeuvre on a Crazyflie, and logs it."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("mambo_templates", "manoeuvre"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=False,
        keep_trailing_newline=True,
    )
    numbers = {
        "size_m": SIZE_M,
        "height_m": HEIGHT_M,
        "rate_rad_s": RATE_RAD_S,
        "duration_s": DURATION_S,
        "ramp_s": RAMP_S,
    }
    return environment.get_template(_SCRIPT).render(**numbers, sines=sines())
