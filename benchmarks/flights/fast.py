"""What it is worth on quick curves to know more of a target, and what noise in it costs.

A Crazyflie through motion capture. Prints a table in Markdown and draws the eight at 1.2 rad/s into the
folder that is named. Random drones with wind: mass 0.97 to 1.12, inertia 0.85 to 1.15, rotor lag 0.8 to 1.2,
drag 0.5 to 1.5 times that of the file. A program sends what its column says of a target: position and
velocity, with them the acceleration, and with that the one 0.05 s later. Noise is white: in the velocities
along x, y and the height, with a tenth of it in m in the positions; and in the accelerations.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from benchmarks.markdown import table
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.columns import TARGET
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import height_error_m, measure
from mambo_sil.flight.names import CurveName
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.model.derive.derived_flight import chosen_text
from mambo_sil.results.pictures import save
from mambo_sil.results.style import BLUE, BROAD, PAGE_INCHES, VERMILION, style
from mambo_sil.results.style import TARGET as TARGET_COLOUR

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


@dataclass(frozen=True)
class Sender:
    """What a program knows of its targets."""

    words: str
    known: int


SENDERS: Final = (
    Sender("velocity", 0),
    Sender("acceleration", 1),
    Sender("one ahead", 2),
)
NOISES_M_S: Final = (0.01, 0.04)
ACCELERATION_NOISE_M_S2: Final = 0.1
NOISY: Final = (CASES[1], CASES[3])
"""The curves that are flown with noise too."""
_OF_SPEED: Final = ("velocity_m_s", "climb_m_s")
_OF_PLACE: Final = ("position_m", "height_m")
_OF_ACCELERATION: Final = ("acceleration_m_s2", "ahead_m_s2", "climb_acceleration_m_s2", "climb_ahead_m_s2")


@dataclass(frozen=True)
class Sent(Flight):
    """Flights whose program knows this much of its targets, and says it with noise."""

    known: int = 2
    noise_m_s: float = 0.0
    noise_m_s2: float = 0.0

    @cached_property
    def targets_in_space(self) -> FloatArray:
        """The targets (k, n, 13) as they are sent."""
        sent = np.array(super().targets_in_space)
        random = np.random.default_rng(0)
        sizes = {
            _OF_SPEED: self.noise_m_s,
            _OF_PLACE: self.noise_m_s / 10,
            _OF_ACCELERATION: self.noise_m_s2,
        }
        for names, size in sizes.items():
            for name in names:
                sent[..., TARGET[name]] += size * random.standard_normal(sent[..., TARGET[name]].shape)
        sent[..., TARGET["known"]] = self.known
        return sent


def settings() -> Settings:
    """Return the settings of `design`."""
    return controller_toml.parse(chosen_text(DRONE, "crazyflie"), "derived")


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


def sent(flight: Flight, known: int, noise: tuple[float, float] = (0.0, 0.0)) -> Sent:
    """Return flights with what their program knows, and with noise in m/s and m/s^2."""
    values = {field.name: getattr(flight, field.name) for field in fields(flight)}
    return Sent(**values, known=known, noise_m_s=noise[0], noise_m_s2=noise[1])


def cell(case: QuickFlight, chosen: Settings, known: int, noise: tuple[float, float]) -> str:
    """Return IAE, median and 95 %, in m s; change of the commands, in rad; height, in m; and crashes.

    The change is the mean sum of roll and pitch from step to step, the height 95 % of its largest errors.
    """
    iae, change, lost, crashes = [], [], [], 0
    for seed in SEEDS:
        flight = drawn(case, seed)
        trace = fly(sent(flight, known, noise), CompiledController(chosen, DRONES))
        trace = replace(trace, target=flight.traced_targets)
        crashed = detect_crashes(trace, DRONE)
        crashes += int(crashed.sum())
        iae.append(np.where(crashed, np.inf, measure(trace).iae_m_s))
        change.append(np.abs(np.diff(trace.command_rad, axis=0)).sum(axis=2).mean(axis=0))
        lost.append(np.max(np.abs(height_error_m(trace)), axis=0))
    found = np.concatenate(iae)
    high = np.quantile(found, 0.95, method="higher")
    words = f"{np.median(found):.3g}, {high:.3g} ({np.median(np.concatenate(change)):.2g})"
    height = np.quantile(np.concatenate(lost), 0.95)
    return f"{words}; {height:.2g}" + (f", {crashes} crash" if crashes else "")


def rows() -> Iterator[dict[str, str]]:
    """Fly everything and yield the rows of the table, those with noise last."""
    chosen, acceleration = settings(), f"{ACCELERATION_NOISE_M_S2:g} m/s² in the acceleration"
    noisy = [(f"{1e3 * size:g} mm/s", (size, 0.0)) for size in NOISES_M_S]
    noisy += [(acceleration, (0.0, ACCELERATION_NOISE_M_S2))]
    flown = [(case, case.words, (0.0, 0.0)) for case in CASES]
    flown += [(case, f"{case.words}, {words}", noise) for case in NOISY for words, noise in noisy]
    for case, words, noise in flown:
        yield {
            "flight": words,
            **{
                one.words: "-" if noise[1] and not one.known else cell(case, chosen, one.known, noise)
                for one in SENDERS
            },
        }


def draw_eight(stem: Path) -> None:
    """Draw the eight at 1.2 rad/s as flown by who knows least of its targets, and by who knows most."""
    chosen, flight = settings(), drawn(CASES[2], SEEDS[0])
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 2.4), layout="constrained")
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        senders = SENDERS[0], SENDERS[-1]
        for axes, sender, colour in zip(panels, senders, (VERMILION, BLUE), strict=True):
            trace = fly(sent(flight, sender.known), CompiledController(chosen, DRONES))
            late = trace.time_s > DURATION_S / 2.0
            target = trace.target[late, 0]
            axes.plot(target[:, 0], target[:, 1], color=TARGET_COLOUR, linewidth=BROAD, label="target")
            axes.plot(*trace.position_m[late, 0, :2].T, color=colour, label="drone")
            axes.set(xlabel="x, m", aspect="equal", title=sender.words)
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
