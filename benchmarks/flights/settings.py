"""What single settings of preset `mambo` are worth: near it, without parts, with one move, and of a study.

    python -m benchmarks.flights.settings TUNED FOLDER

TUNED is the result of `mambo-nmpc tune`; figures.json in FOLDER gets the figures. Takes ten minutes.
"""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.flights.limits import overshoot_m
from benchmarks.margins.flights import SLOW_MOTORS, settings_of
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.presets import load, preset
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.campaign import campaign_file
from mambo_sil.experiment.campaign.campaign_file import Campaign, scenario
from mambo_sil.experiment.campaign.campaign_flights import fly_scenarios
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.trajectories import Circle, PositionStep, Trajectory
from mambo_sil.results.folders import finite

Change = dict[str, float | str]

DRAWN, BATCH = 300, 20
RESPONSE: Final = "cost.response_time_s"
TIMES_S: Final = (0.12, 0.15, 0.18, 0.215, 0.25, 0.3, 0.4)
NOISES: Final = ("disturbance", "acceleration", "position", "velocity")
PARTS: Final[dict[str, Change]] = {
    "nothing": {},
    "disturbance": {"observer.disturbance_limit_m_s2": 0.0},
    "predicted attitude: the measured one instead": {"model.start_attitude": "measured"},
    "integrator of the attitude loop": {"model.roll_integral_1_s": 0.0, "model.pitch_integral_1_s": 0.0},
    "rate feedback": {"damping.roll_rate_feedback_s": 0.0},
    "drag": {"model.drag_1_s": 0.0},
    "second move": {"horizon.ramp_s": 0.0},
}
CASES: Final[dict[str, dict[str, Any]]] = {
    "eight": {},
    "yaw 0.8": {"yaw_rad": 0.8},
    "push": {"push_m_s2": (0.5, 0.0)},
    "motor lag": {"motor_lag_s": 0.03},
}
MOVES: Final = {"one": 0.0, "two": 0.4}
"""Seconds of the ramp to a second move."""
CIRCLES_RAD_S, STEPS_M = (1.8, 2.0, 2.2), (2.0, 3.0, 5.0)
HEADINGS, HEADINGS_OF_A_STUDY, OTHER_DRAWS = 33, 64, 100


def near() -> dict[str, Change]:
    """Return the changes of one setting by the title of their row."""
    noises = {
        f"{name}_noise, {size}": {key: factor * getattr(preset("mambo").observer, f"{name}_noise")}
        for name in NOISES
        for key in [f"observer.{name}_noise"]
        for size, factor in (("a quarter", 0.25), ("four times", 4.0))
    }
    return {f"response_time_s {time_s:g}": {RESPONSE: time_s} for time_s in TIMES_S} | noises


def quantile(values: FloatArray, share: float) -> float:
    """Return a quantile of values of which some may be infinite: one of them."""
    return float(np.quantile(values, share, method="inverted_cdf"))


def drawn(settings: Settings, campaign: Campaign, flights: int) -> dict[str, Any]:
    """Fly random drones of a campaign; a crash counts as an infinite error."""
    rows: list[dict[str, Any]] = []
    for first in range(0, flights, BATCH):
        batch = range(first, min(first + BATCH, flights))
        scenarios = [scenario(campaign.flight, campaign.draw(number)) for number in batch]
        rows += fly_scenarios([Entrant("c", "nmpc", settings)], scenarios)
    lost = np.array([row["c_crashed"] for row in rows]) > 0
    values = {
        name: np.where(lost, np.inf, np.array([row[f"c_{key}"] for row in rows], np.float64))
        for name, key in (
            ("iae_m_s", "iae_m_s"),
            ("seen_m_s", "seen_iae_m_s"),
            ("variation_rad", "command_variation_rad"),
        )
    }
    return {"crashed": int(lost.sum())} | {
        f"{name}_{title}": quantile(one, share)
        for name, one in values.items()
        for title, share in (("median", 0.5), ("most", 0.95))
    }


def known(settings: Settings, cases: Sequence[dict[str, Any]]) -> tuple[FloatArray, FloatArray]:
    """Return IAE and variation (n,) of flights of the Table II case whose state is known, changed so."""
    flights = [Scenario(**case) for case in cases]
    flight = flight_of(flights, settings.horizon.update_period_s)
    found = measure(fly(flight, CompiledController(settings, len(cases))))
    return found.iae_m_s, found.command_variation_rad


def at_headings(settings: Settings, trajectory: Trajectory, duration_s: float) -> Any:
    """Fly at HEADINGS headings round the circle, with the state known."""
    flight = Flight(
        trajectory,
        duration_s=duration_s,
        flights=HEADINGS,
        yaw_rad=np.linspace(0, 2 * np.pi, HEADINGS, endpoint=False),
        update_period_s=settings.horizon.update_period_s,
    )
    return fly(flight, CompiledController(settings, HEADINGS))


def spread(values: FloatArray) -> list[float]:
    """Return median, least and largest value."""
    return [float(np.median(values)), float(values.min()), float(values.max())]


def part(change: Change, campaigns: dict[str, Campaign]) -> dict[str, Any]:
    """Return what preset mambo flies without a part."""
    settings = settings_of(change)
    iae, variation = known(settings, list(CASES.values()))
    return {
        "cases": dict(zip(CASES, iae.tolist(), strict=True)),
        "variation_rad": float(variation[0]),
        "drawn": drawn(settings, campaigns["default"], 200),
        "slow": drawn(settings, campaigns["slow"], DRAWN),
    }


def moves(ramp_s: float) -> dict[str, Any]:
    """Return IAE on circles and overshoots of steps, each at all headings."""
    settings = settings_of({"horizon.ramp_s": ramp_s})
    circles = {
        f"{rate:g}": measure(at_headings(settings, Circle(1.0, rate), 100.0)).iae_m_s
        for rate in CIRCLES_RAD_S
    }
    steps = {
        f"{size:g}": overshoot_m(at_headings(settings, PositionStep(size, 0.0), 20.0)) for size in STEPS_M
    }
    return {
        "circles": {name: spread(one) for name, one in circles.items()},
        "steps": {name: spread(one) for name, one in steps.items()},
    }


def studied(tuned: Path, campaign: Campaign) -> dict[str, Any]:
    """Return what the base and the result of a study have on other draws, and with the state known."""
    chosen = json.loads((tuned / "summary.json").read_text("utf-8"))["chosen"]
    yaws_rad = np.linspace(0, 2 * np.pi, HEADINGS_OF_A_STUDY, endpoint=False).tolist()
    return {
        title: {
            "values": values,
            "drawn": drawn(settings, campaign, OTHER_DRAWS),
            "known_iae_m_s": spread(known(settings, [{"yaw_rad": yaw} for yaw in yaws_rad])[0]),
        }
        for title, values, settings in (
            ("base", {}, preset("mambo")),
            (f"trial {chosen['number']}", chosen["values"], load(str(tuned / "controller.toml"))),
        )
    }


def main(arguments: list[str]) -> None:
    """Measure everything."""
    tuned, folder = map(Path, arguments)
    folder.mkdir(parents=True, exist_ok=True)
    campaigns = {"default": campaign_file.default(), "slow": campaign_file.read(SLOW_MOTORS)}
    figures = {
        "near": {
            title: {name: drawn(settings_of(change), one, DRAWN) for name, one in campaigns.items()}
            for title, change in near().items()
        },
        "parts": {title: part(change, campaigns) for title, change in PARTS.items()},
        "moves": {name: moves(ramp_s) for name, ramp_s in MOVES.items()},
        "study": studied(tuned, campaigns["default"]),
    }
    (folder / "figures.json").write_text(json.dumps(finite(figures), indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
