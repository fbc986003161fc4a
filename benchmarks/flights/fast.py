"""What the thrust vector is worth on quick curves: a Crazyflie through motion capture, with and without it.

Prints a table in Markdown and draws the eight at 1.2 rad/s into the folder that is given. Random drones with
wind: mass 0.97 to 1.12, inertia 0.85 to 1.15, rotor lag 0.8 to 1.2, drag 0.5 to 1.5 times that of the file.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from benchmarks.markdown import table
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import height_error_m, measure
from mambo_sil.flight.names import CurveName, TargetAcceleration
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import Trace
from mambo_sil.model.derive.derived_flight import chosen_text
from mambo_sil.results.pictures import save
from mambo_sil.results.style import BLUE, BROAD, PAGE_INCHES, TARGET, VERMILION, style

DRONE: Final = vehicle_toml.load("crazyflie")
SEEDS: Final = (101, 102, 103)
DRONES: Final = 16
"""Of each seed."""
DURATION_S: Final = 20.0


@dataclass(frozen=True)
class QuickFlight:
    """A curve, and by how much the rotors are slower than the file says."""

    words: str
    curve: CurveName
    size_m: float
    rate_rad_s: float
    slower: float = 1.0


CASES: Final = (
    QuickFlight("eight 0.5 rad/s", "bernoulli", 2.0, 0.5),
    QuickFlight("eight 1.0 rad/s", "bernoulli", 2.0, 1.0),
    QuickFlight("eight 1.2 rad/s", "bernoulli", 2.0, 1.2),
    QuickFlight("circle 1.5 rad/s", "circle", 1.0, 1.5),
    QuickFlight("circle 2.0 rad/s", "circle", 1.0, 2.0),
    QuickFlight("circle 2.4 rad/s", "circle", 1.0, 2.4),
    QuickFlight("rotors 1.5 times slower: eight 1.2 rad/s", "bernoulli", 2.0, 1.2, 1.5),
    QuickFlight("rotors 1.5 times slower: circle 2.4 rad/s", "circle", 1.0, 2.4, 1.5),
    QuickFlight("rotors twice as slow: circle 2.4 rad/s", "circle", 1.0, 2.4, 2.0),
)


def settings() -> dict[str, Settings]:
    """Return what is compared, by the words of the table."""

    def derived(acceleration: TargetAcceleration) -> Settings:
        text = chosen_text(DRONE, "crazyflie", acceleration=acceleration)
        return controller_toml.parse(text, "derived")

    given = derived("given")
    return {
        "tracked: small angles": derived("tracked"),
        "tracked: thrust vector": controller_toml.with_option(
            controller_toml.with_option(given, "target.acceleration", "tracked"), "target.tracker_gain", 0.3
        ),
        "given": given,
    }


def drawn(case: QuickFlight, seed: int) -> Flight:
    """Return the flights of random drones on the curve of a case."""
    rng, base = np.random.default_rng(seed), Scenario(vehicle=DRONE)

    def times(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    flights = [
        Scenario(
            vehicle=DRONE,
            seed=seed * 1000 + number,
            trajectory=case.curve,
            size_m=case.size_m,
            rate_rad_s=case.rate_rad_s,
            duration_s=DURATION_S,
            yaw_rad=times(-3, 3),
            sensors="mocap",
            mass_kg=base.mass_kg * times(0.97, 1.12),
            inertia_kg_m2=tuple(inertia * times(0.85, 1.15) for inertia in base.inertia_kg_m2),
            motor_lag_s=base.motor_lag_s * times(0.8, 1.2) * case.slower,
            drag_1_s=base.drag_1_s * times(0.5, 1.5),
            wind_speed_m_s=times(0, 1.5),
            wind_direction_rad=times(-3, 3),
        )
        for number in range(DRONES)
    ]
    return flight_of(flights, 0.01)


def flown(case: QuickFlight, chosen: Settings, seed: int) -> Trace:
    """Return the flights of a case with settings."""
    return fly(drawn(case, seed), CompiledController(chosen, DRONES))


def cell(case: QuickFlight, chosen: Settings) -> str:
    """Return IAE, median and 95 %, in m s, 95 % of the largest errors of the height, in m, and crashes."""
    iae, height, crashes = [], [], 0
    for seed in SEEDS:
        trace = flown(case, chosen, seed)
        crashed = detect_crashes(trace, DRONE)
        crashes += int(crashed.sum())
        iae.append(np.where(crashed, np.inf, measure(trace).iae_m_s))
        height.append(np.max(np.abs(height_error_m(trace)), axis=0))
    found = np.concatenate(iae)
    high = np.quantile(found, 0.95, method="higher")
    largest = np.quantile(np.concatenate(height), 0.95)
    lost = f", {crashes} crash" if crashes else ""
    return f"{np.median(found):.3g}, {high:.3g}; {largest:.2g}{lost}"


def rows() -> Iterator[dict[str, str]]:
    """Fly everything and yield the rows of the table."""
    compared = settings()
    for case in CASES:
        yield {
            "flight": case.words,
            **{words: cell(case, chosen) for words, chosen in compared.items()},
        }


def draw_eight(stem: Path) -> None:
    """Draw the eight at 1.2 rad/s as flown with and without the thrust vector."""
    compared, case = settings(), CASES[2]
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 2.4), layout="constrained")
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes, words, colour in zip(panels, list(compared)[::2], (VERMILION, BLUE), strict=True):
            trace = flown(case, compared[words], SEEDS[0])
            late = trace.time_s > DURATION_S / 2.0
            target = trace.target[late, 0]
            axes.plot(target[:, 0], target[:, 1], color=TARGET, linewidth=BROAD, label="target")
            axes.plot(*trace.position_m[late, 0, :2].T, color=colour, label="drone")
            axes.set(xlabel="x, m", aspect="equal", title=words)
        panels[0].set_ylabel("y, m")
        save(figure, stem)


def main(arguments: list[str]) -> None:
    """Print the table, and draw the picture into the folder that `arguments` name."""
    print(table(list(rows())), flush=True)
    folder = Path(arguments[0])
    folder.mkdir(parents=True, exist_ok=True)
    draw_eight(folder / "fast-eight")


if __name__ == "__main__":
    main(sys.argv[1:])
