"""Result folders of every command, small: written as the records that the commands write."""

import contextlib
import copy
import importlib
import json
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from mambo_codegen import __version__, boards
from mambo_codegen.settings.model import Settings
from mambo_sil.board.firmware.sizes import Added, Parts, SectionBytes
from mambo_sil.board.footprint import footprint_report
from mambo_sil.board.footprint.measure import Footprint
from mambo_sil.board.footprint.sweep import Axis, Point, budgets
from mambo_sil.board.footprint.sweep_report import SweepSummary
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.experiment.campaign.campaign_report import CampaignSummary, Drawn, WorstFlight
from mambo_sil.experiment.campaign.statistics import Distributions, Improvement, Proportion
from mambo_sil.experiment.campaign.store import FlightStore
from mambo_sil.experiment.compare.compared_flights import EightAnswer, StepAnswer
from mambo_sil.experiment.compare.diff_report import ControllerFigures, DiffSummary, SettingDifference
from mambo_sil.experiment.faults.fault_flights import End, Verdict
from mambo_sil.experiment.faults.faults_report import FaultsSummary
from mambo_sil.experiment.margins.axis_margins import AXES, AxisMargins, AxisName, NoiseGain, Poles
from mambo_sil.experiment.margins.loop_margins import LoopMargins
from mambo_sil.experiment.margins.margins_record import (
    RESPONSES,
    ManyDrones,
    MarginSpread,
    MarginsSummary,
)
from mambo_sil.experiment.margins.response_file import Curve, write_responses
from mambo_sil.experiment.regress.flight_limits import Check, JudgedFlight
from mambo_sil.experiment.regress.regress_report import RegressSummary
from mambo_sil.experiment.table2.sensed import SensedRow, SensedSummary
from mambo_sil.experiment.table2.table2 import CASES, Claim, Table2Row, Table2Summary
from mambo_sil.flight import flight_report
from mambo_sil.flight.controllers.pd import PdController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.flight_report import FlySummary, RepeatSummary
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import PD, PD_NAMES, PD_TITLES
from mambo_sil.flight.scenario import Scenario
from mambo_sil.flight.traces import Trace, write_npz
from mambo_sil.model.identify.curves import Curves, curves_csv
from mambo_sil.model.identify.identify_record import AxisResult, IdentifySummary, LogResult, Noise
from mambo_sil.model.identify.motion import Motion
from mambo_sil.model.identify.response import AxisParameters, Interval
from mambo_sil.verify import verify_report
from mambo_sil.verify.check import CHECKS, CheckOutcome

HOSTILE: Final = '<img src=x onerror="alert(1)">&</script>\'.toml'
"""A name of a file that is markup, the end of a script, and quotes."""

DURATION_S: Final = 4.0


@lru_cache
def _flown() -> Trace:
    return fly(Flight(next(iter(CASES.values())), duration_s=DURATION_S), PdController())


def trace(*, lost: bool = False) -> Trace:
    """Return the PD on the figure of eight; if `lost`, without a second half."""
    flown = copy.deepcopy(_flown())
    if lost:
        for array in (flown.position_m, flown.velocity_m_s, flown.euler_rad):
            array[len(array) // 2 :] = np.nan
    return flown


def fly_folder(folder: Path, *, lost: bool = False) -> None:
    """Write a flight of a controller with a hostile name."""
    flown = trace(lost=lost)
    write_npz(flown, folder / "trace.npz")
    scenario = Scenario(duration_s=DURATION_S, wind_speed_m_s=3.0)
    FlySummary(
        controller="nmpc",
        board="crazyflie",
        same_bits_as_host=True,
        source=HOSTILE,
        settings=Settings().digest,
        update_period_s=0.01,
        trajectory_sha256=None,
        **scenario.model_dump(include=set(FlySummary.model_fields)) | {"trajectory": HOSTILE},
        **flight_report.judge(flown, Settings(), NOMINAL) | {"refusals": [HOSTILE]},
    ).write(folder)


def repeat_folder(folder: Path) -> None:
    """Write a recorded flight flown again, not bit for bit."""
    flown = trace()
    write_npz(flown, folder / "trace.npz")
    RepeatSummary(
        repeat=HOSTILE,
        same_bits_as_recorded=False,
        same_bits_as_host=None,
        controller="pd",
        scenario=Scenario(),
        settings=Settings().digest,
        **flight_report.judge(flown, Settings(), NOMINAL),
    ).write(folder)


def sensed_folder(folder: Path) -> None:
    """Write Table II through sensors, with one row."""
    row = SensedRow(HOSTILE, "mambo", 20, 1, (7.123, 0.5, 40.0, np.nan), (6.0, 0.4, 30.0, 900.0), 8.5, 0.77)
    SensedSummary(scalar=None, rows=[row]).write(folder)


def table2_folder(folder: Path) -> None:
    """Write Table II with the laws without a model, a preset and made-up rows."""
    flown = trace()
    for name in (*PD_NAMES, "mambo"):
        write_npz(flown, folder / f"{name}.npz")
    rows = [
        Table2Row(
            case, name, (7.123, 0.5, 40.0, 1234.5), None if name == PD else (2.5, 3.0, 4.0, 5.0), 0.0174
        )
        for case in CASES
        for name in (*PD_TITLES.values(), "mambo", HOSTILE)
    ]
    claims = [Claim(f"holds, says {HOSTILE}", True, "as shown"), Claim("does not", False, "as shown")]
    Table2Summary(scalar=None, cases=list(CASES), rows=rows, claims=claims).write(folder)


def footprint_folder(folder: Path) -> None:
    """Write the footprint on two boards, one without stack and time, over its flash."""
    measured = [
        Footprint(
            board=boards.load(name),
            compiler=HOSTILE,
            optimisation="-O2",
            scalar="float32",
            added=Added(
                SectionBytes({}, {}), Parts(flash, 0, 0, 0), Parts(120, 0, 0, 0), {"nmpc_step": flash}, {}
            ),
            instance_bytes=120,
            stack=None,
            counts=None,
            uncounted="there is no emulator",
            forbidden=(),
            update_period_s=0.01,
        )
        for name, flash in (("crazyflie", 3000), ("mega", 10**6))
    ]
    footprint_report.summarise(measured, HOSTILE, Settings()).write(folder)


def sweep_folder(folder: Path) -> None:
    """Write a sweep of six points, one of which did not fly, and one of which is refused."""
    keys = ("horizon.prediction", "horizon.control")
    axes = [Axis(keys[0], (1, 5, 10, 15)), Axis(keys[1], (1, 2))]
    flown = ((prediction, control) for prediction in (5, 10) for control in (1, 2))
    points = [
        Point(dict(zip(keys, (np_, nc), strict=True)), 3000 + np_, 100, 200, 4000, 0.1, 3.0 / np_, nc < 2)
        for np_, nc in flown
    ]
    points.append(Point(dict(zip(keys, (15, 1), strict=True)), 3015, 100))
    points.append(Point(dict(zip(keys, (1, 2), strict=True)), refusal=HOSTILE))
    SweepSummary(
        source=HOSTILE,
        settings=Settings().digest,
        board=HOSTILE,
        budget=budgets(boards.load("crazyflie"), Settings(), axes),
        axes=axes,
        points=points,
        closest_fit=points[2],
    ).write(folder)


def faults_folder(folder: Path) -> None:
    """Write two faults on two courses, one of which crashes."""
    verdicts = [
        Verdict(course, fault, False, ("OK", "BAD_STATE"), True, 0.35, 0.3, error, 0.07, 0.25, back, end)
        for course in ("eight", "hover")
        for fault, error, back, end in (
            (HOSTILE, 0.06, 0.0, End.RECOVERED),
            ("state NaN to the end", 2376.5, np.nan, End.CRASHED),
        )
    ]
    FaultsSummary(source=HOSTILE, settings=Settings().digest, flights=verdicts).write(folder)


def verify_folder(folder: Path) -> None:
    """Write a verification of which one check passed and one could not run."""
    ended = (
        (CheckOutcome.PASSED, f"nothing but {HOSTILE}"),
        (CheckOutcome.INCOMPLETE, "cppcheck is missing"),
    )
    found = [
        verify_report.Verified(entry.name, entry.about, outcome, evidence, {}, {})
        for entry, (outcome, evidence) in zip(CHECKS, ended, strict=False)
    ]
    verify_report.summarise(found, HOSTILE, Settings()).write(folder)


def campaign_folder(folder: Path, *, finished: bool = True) -> None:
    """Write a campaign of four flights, one of which crashes with the second controller."""
    flight = Scenario().model_dump(include={"trajectory", "size_m", "rate_rad_s", "duration_s", "sensors"})
    document = {"seed": 7, "flight": flight, "controllers": [{"name": "pd"}, {"name": "mambo"}]}
    identity = {"generator": f"mambo-nmpc {__version__}", "command": "campaign", **document}
    (folder / "campaign.json").write_text(json.dumps(identity), "utf-8")
    columns = [f"{name}_{key}" for name in ("pd", "mambo") for key in ("crashed", "iae_m_s", "trace_sha256")]
    cells = [(0, 60.0 + flight, "ab", int(flight == 3), 4.0 + flight, "cd") for flight in range(4)]
    with contextlib.closing(FlightStore(folder, columns, "")) as store:
        store.add({flight: dict(zip(columns, row, strict=True)) for flight, row in enumerate(cells)})
    if not finished:
        return

    def share(count: int) -> Proportion:
        return Proportion(count, 4, count / 4, 0.0, 0.6)

    def found(crashed: int) -> Distributions:
        return Distributions(share(crashed), share(0), {"iae_m_s": quantiles})

    quantiles = {"0.05": 4.0, "0.5": 5.0, "0.95": 6.0, "1": np.inf}
    CampaignSummary(
        campaign=Drawn.model_validate(document),
        flights=4,
        controllers={"pd": found(0), "mambo": found(1)},
        improvements=[Improvement("mambo", "iae_m_s", 4, 12.0, 11.0, 13.0, share(3))],
        worst={"mambo": [WorstFlight(3, True, np.nan, 9.5, f"flights/{HOSTILE}")]},
    ).write(folder)


def regress_folder(folder: Path) -> None:
    """Write a suite of two flights, one of which was lost; the other was recorded."""

    def check(now: float, then: float | None) -> Check:
        return Check("iae_m_s", now, 5.0, then, 5.0 if then is None else 2.2, now <= 2.2)

    good = JudgedFlight(
        "eight", "eight/yaw_rad=0", {"iae_m_s": 1.5, "saturated_share": 0.01}, [check(1.5, 2.0)], True, None
    )
    lost = JudgedFlight(
        "circle",
        HOSTILE,
        {"iae_m_s": np.nan, "saturated_share": 0.5},
        [check(np.nan, None)],
        False,
        f"flights/{HOSTILE}",
    )
    RegressSummary(
        suite=HOSTILE,
        controller="mambo",
        settings=Settings().digest,
        baseline=HOSTILE,
        settings_then="",
        better=1,
        flights=[good, lost],
    ).write(folder)


def identify_folder(folder: Path) -> None:
    """Write an identification that refused one axis."""

    def known(value: float) -> Interval:
        return Interval(value, 0.02)

    fit = AxisParameters(known(0.83), known(0.14), known(0.05), known(0.09), None)
    roll = AxisResult("good", [], 0.1, 0.99, 0.002, 0.002, fit, fit, 0.001, 0.0005)
    pitch = AxisResult("refused", ["too calm"], 0.01, np.nan, np.nan, np.nan, None, None, np.nan, 0.0005)
    motion = Motion(known(0.87), known(0.15), (known(0.01), known(0.0)), True, known(0.03), 0.95, 0.06)
    wave = np.sin(np.arange(500.0) / 20.0)
    tilt = np.stack([wave, wave])
    curves = Curves(0.01 * np.arange(500.0), tilt, 0.8 * tilt, np.stack([0.8 * wave, np.full(500, np.nan)]))
    (folder / "fit.csv").write_text(curves_csv(curves), "utf-8")
    IdentifySummary(
        logs=[LogResult(HOSTILE, 5.0, {"roll_rad": HOSTILE})],
        duration_s=5.0,
        split_s=2.5,
        roll=roll,
        pitch=pitch,
        motion=motion,
        noise=Noise(np.nan, 0.01),
        model={},
        remarks=[HOSTILE],
    ).write(folder)


def margins_folder(folder: Path) -> None:
    """Write margins of a drone that is unstable in pitch, and of two drones."""
    loop = LoopMargins(
        gain_up=2.125,
        gain_down=0.0,
        phase_deg=31.0,
        crossover_rad_s=3.9,
        delay_s=0.1375,
        delay_updates=13.75,
        sensitivity=2.39,
        sensitivity_rad_s=5.9,
        complementary=1.9,
        bandwidth_rad_s=np.nan,
    )

    def axis(name: AxisName, growth_1_s: float) -> AxisMargins:
        stable = growth_1_s < 0.0
        return AxisMargins(
            axis=name,
            stable=stable,
            command=loop if stable else None,
            motors=None,
            poles=Poles(
                least_damping=0.5, least_damped_rad_s=6.0, slowest_s=-1.0 / growth_1_s, growth_1_s=growth_1_s
            ),
            gust_to_place_s2=0.25 if stable else np.inf,
            gust_to_command_rad_s2_m=0.25,
            noise={
                "position": NoiseGain(to_place=0.1, to_command=0.5),
                "velocity": NoiseGain(to_place=0.2, to_command=0.25),
                "angle": NoiseGain(to_place=0.05, to_command=0.75),
            },
            sensed_variation_rad=None,
        )

    spread = MarginSpread(
        axis="roll", place="command", figure="delay margin", worst=0.1, median=0.125, drone=1
    )
    rad_s = np.geomspace(0.1, 300.0, 50)
    curves = [Curve(name, "command", rad_s, 1j * rad_s / (1.0 + 1j * rad_s)) for name in AXES]
    write_responses(curves, folder / RESPONSES)
    MarginsSummary(
        source=HOSTILE,
        settings=Settings().digest,
        vehicle=HOSTILE,
        sensors="true",
        update_period_s=0.01,
        axes=[axis("roll", -1.0), axis("pitch", 0.5)],
        many=ManyDrones(
            origin=f"drawn by {HOSTILE}",
            drones=2,
            unstable=1,
            spreads=[spread],
            worst_drone=1,
            worst_values={"mass_kg": 0.07},
        ),
    ).write(folder)


def diff_folder(folder: Path) -> None:
    """Write two controllers that differ in one setting."""
    step = StepAnswer(settling_s=1.125, overshoot=0.02, iae_m_s=0.5)

    def figures(iae_m_s: float) -> ControllerFigures:
        return ControllerFigures(
            instance_bytes=156,
            law=None,
            observer=None,
            margins=None,
            step=(step, step),
            eight=EightAnswer(iae_m_s=iae_m_s, max_error_m=0.1, command_variation_rad=0.002, crashed=False),
        )

    DiffSummary(
        a="mambo",
        b=HOSTILE,
        settings_a=Settings().digest,
        settings_b="0" * 64,
        vehicle=NOMINAL,
        differences=[SettingDifference(key="limits.tilt_rad", a=0.35, b=0.4, meaning="Tilt limit")],
        figures_a=figures(1.0),
        figures_b=figures(105.0),
    ).write(folder)


FOLDERS: Final[dict[str, Callable[[Path], None]]] = {
    "fly": fly_folder,
    "repeat": repeat_folder,
    "table2": table2_folder,
    "sensed": sensed_folder,
    "footprint": footprint_folder,
    "sweep": sweep_folder,
    "faults": faults_folder,
    "verify": verify_folder,
    "campaign": campaign_folder,
    "regress": regress_folder,
    "identify": identify_folder,
    "margins": margins_folder,
    "diff": diff_folder,
}
"""A folder of every command of the core."""


def of_extensions() -> Iterator[Any]:
    """Yield the modules `support.results` of the tests of extensions, each with a folder of its command."""
    for path in sorted(Path(__file__).parents[1].glob("extensions/*/support/results.py")):
        yield importlib.import_module(f"tests.extensions.{path.parts[-3]}.support.results")


def all_folders() -> dict[str, Callable[[Path], None]]:
    """Return what makes a folder of every command that there is."""
    return FOLDERS | {one.COMMAND: one.write_folder for one in of_extensions()}
