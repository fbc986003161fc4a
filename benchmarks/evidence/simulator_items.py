"""The evidence that wants simulators of others.

`simulators`, `adapters` and `downwash` need crazyflow, RotorPy and gym-pybullet-drones, `pyflyt` PyFlyt,
which wants NumPy 1, `motors` Drake and MuJoCo. Any value of the environment variables SIMULATORS, PYFLYT and
MOTORS says that they are installed.
"""

from typing import Final

from benchmarks.evidence.item import RESULTS, Item
from benchmarks.evidence.simulator_pictures import (
    DRAWN,
    FLOWN,
    draw_adapters,
    draw_motors,
    draw_simulators,
    read_adapters,
)
from benchmarks.evidence.simulator_tables import SIMULATORS, every_controller, one_flight, quick, summary
from benchmarks.evidence.sources import HERE, STYLE
from benchmarks.evidence.tables import printed, read_figures, read_printed

OF_SIMULATORS: Final = (
    Item(
        name="adapters",
        commands=(f"python -m benchmarks.simulators.adapters {RESULTS}/adapters/flights",),
        controllers=("design crazyflie --sensors true", "design crazyflie-l250 --sensors true"),
        paths=(
            *("sil/mambo_nmpc/adapters", "sil/mambo_sil/api", "sil/mambo_sil/flight/altitude_loops.py"),
            *("benchmarks/simulators/adapters.py", f"{HERE}/simulator_pictures.py", STYLE),
        ),
        read=read_adapters,
        tables={},
        pictures={f"adapters-{name}.png": f"adapters-{name}.png" for name in FLOWN},
        draw=draw_adapters,
        variable="SIMULATORS",
    ),
    Item(
        name="simulators",
        commands=tuple(
            f"python -m benchmarks.simulators {name} {RESULTS}/simulators/{name}" for name in SIMULATORS
        ),
        controllers=(
            "crazyflie",
            *(f"design crazyflie{kind}" for kind in ("-l250", "-brushless")),
            *("design cf2x-pybullet", "design hummingbird", "design x500"),
        ),
        paths=(
            *("sil/mambo_nmpc/adapters", "sil/mambo_sil/api", "sil/mambo_sil/flight/altitude_loops.py"),
            *("sil/mambo_sil/drone/sensors", "sil/mambo_sil/model"),
            *("benchmarks/simulators", f"{HERE}/simulator_pictures.py", STYLE),
        ),
        read=read_figures(*SIMULATORS),
        tables={"simulators-summary": summary, "simulators-all": every_controller},
        pictures={f"simulators-{name}.png": f"simulators-{name}.png" for name in DRAWN},
        draw=draw_simulators,
        variable="SIMULATORS",
    ),
    Item(
        name="quick",
        commands=(f"python -m benchmarks.simulators quick {RESULTS}/quick/quick",),
        controllers=tuple(
            f"design {drone}" for drone in ("crazyflie-l250", "crazyflie-brushless", "x500", "hummingbird")
        ),
        paths=("sil/mambo_sil/api", "sil/mambo_sil/model", "benchmarks/simulators"),
        read=read_figures("quick"),
        tables={"quick": quick},
        variable="SIMULATORS",
    ),
    Item(
        name="truth",
        commands=(f"python -m benchmarks.simulators truth {RESULTS}/truth/truth",),
        controllers=tuple(
            f"design {drone} --sensors true" for drone in ("crazyflie-l250", "crazyflie-brushless", "x500")
        ),
        paths=("sil/mambo_sil/api", "sil/mambo_sil/model", "benchmarks/simulators"),
        read=read_figures("truth"),
        tables={"truth-summary": summary},
        variable="SIMULATORS",
    ),
    Item(
        name="downwash",
        commands=("python -m benchmarks.simulators.downwash",),
        controllers=("design cf2x-pybullet",),
        paths=(
            *("sil/mambo_nmpc/adapters/gym_pybullet_drones.py", "sil/mambo_sil/api"),
            *(f"benchmarks/simulators/{name}.py" for name in ("downwash", "pybullet_flights")),
        ),
        read=read_printed,
        tables={"downwash": printed},
        variable="SIMULATORS",
    ),
    Item(
        name="motors",
        commands=(f"python -m benchmarks.simulators motors {RESULTS}/motors/motors",),
        controllers=tuple(f"design examples/{name}.toml --sensors true" for name in ("drake", "quad")),
        paths=(
            *("sil/mambo_nmpc/adapters", "sil/mambo_sil/api", "sil/mambo_sil/model", "benchmarks/simulators"),
            *("examples/drake.toml", "examples/quad.toml", f"{HERE}/simulator_pictures.py", STYLE),
        ),
        read=read_figures("motors"),
        tables={"motors-all": one_flight},
        pictures={"simulators-drake.png": "simulators-drake.png"},
        draw=draw_motors,
        variable="MOTORS",
    ),
    Item(
        name="pyflyt",
        commands=(f"python -m benchmarks.simulators pyflyt {RESULTS}/pyflyt/pyflyt",),
        controllers=("design cf2x-pyflyt --sensors true",),
        paths=("sil/mambo_nmpc/adapters", "sil/mambo_sil/api", "benchmarks/simulators"),
        read=read_figures("pyflyt"),
        tables={"pyflyt-summary": summary, "pyflyt-all": every_controller},
        variable="PYFLYT",
    ),
)
