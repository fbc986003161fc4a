"""Campaigns for programs: random flights of several laws, each of them in the same drones and winds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from mambo_sil.api.api_controller import Controller
from mambo_sil.api.flights import as_curve
from mambo_sil.arguments import is_whole, require, require_kind
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.experiment.campaign.campaign_file import (
    CampaignFile,
    completed,
    demand_own_names,
    distributions,
    scenario,
)
from mambo_sil.experiment.campaign.campaign_flights import (
    CRASHED,
    FAILURE,
    MOST_TOGETHER,
    columns,
    fly_scenarios,
)
from mambo_sil.experiment.campaign.drawn_curves import spatial_curves
from mambo_sil.experiment.campaign.parameters import OF_THE_CURVE, PARAMETERS, TRAJECTORY, Draw, draw
from mambo_sil.experiment.inputs import NAME, Entrant, as_sections
from mambo_sil.flight.controllers.own_law import Law
from mambo_sil.flight.names import SensorsName
from mambo_sil.flight.scenario import LARGEST_SEED, flight_of
from mambo_sil.flight.trajectories import Trajectory, is_spatial, is_trajectory
from mambo_sil.results.blocks import ResultTable
from mambo_sil.results.number_format import distance
from mambo_sil.results.terminal import table as in_lines

MOST_FLIGHTS: Final = 1_000_000
_SOURCE: Final = "campaign"


@dataclass(frozen=True, eq=False, repr=False)
class CampaignFlights:
    """Random flights of several laws; `print` shows how close each flew.

    names:      of the laws.
    table:      columns by name, each a list with a value for each flight, as pandas.DataFrame takes them:
                those of flights.csv, the seed and the parameters that were drawn, and of each law
                NAME_crashed, NAME_iae_m_s and other metrics.
    failures:   of laws of one's own, when and why they failed, by the number of the flight.
    duration_s: of each flight.
    """

    names: tuple[str, ...]
    table: dict[str, list[Any]]
    failures: dict[str, dict[int, str]]
    duration_s: float

    def mean_error_m(self, name: str) -> list[float]:
        """Return the mean distance of a law from its target in each flight; infinite where it crashed."""
        crashed, iae_m_s = self.table[f"{name}_{CRASHED}"], self.table[f"{name}_iae_m_s"]
        return [
            float("inf") if lost else iae / self.duration_s
            for lost, iae in zip(crashed, iae_m_s, strict=True)
        ]

    def __repr__(self) -> str:
        """Return the table that `print` shows."""
        shown = self._shown()
        return "\n".join([*in_lines(shown.heads, shown.rows, shown.text_columns), *self._reasons()])

    def _repr_markdown_(self) -> str:
        """Return the same for a notebook."""
        return "\n\n".join([self._shown().markdown(), *self._reasons()])

    def _reasons(self) -> list[str]:
        """Return a sentence for each law that failed: how often, and why at first."""
        return [
            f"{name} failed in {len(reasons)} of {len(self.table['seed'])}, as in flight {min(reasons)}, "
            f"{reasons[min(reasons)]}"
            for name, reasons in self.failures.items()
        ]

    def _shown(self) -> ResultTable:
        rows = []
        for name in self.names:
            errors_m = np.array(self.mean_error_m(name))
            median_m, most_m = np.quantile(errors_m, (0.5, 0.95), method="inverted_cdf").tolist()
            crashed = f"{int(np.isinf(errors_m).sum())} of {len(errors_m)}"
            rows.append((name, distance(median_m), distance(most_m), distance(errors_m.max()), crashed))
        return ResultTable(("mean distance", "median", "95 %", "worst", "crashed"), rows)


def campaign(
    laws: Mapping[str, Controller | Law],
    vehicle: Vehicle,
    *,
    flights: int = 100,
    seed: int = 0,
    trajectory: str | Mapping[str, Any] | Trajectory = "bernoulli",
    size_m: float | Mapping[str, Any] = 2.0,
    rate_rad_s: float | Mapping[str, Any] = 0.5,
    duration_s: float = 20.0,
    sensors: SensorsName | None = None,
    draws: Mapping[str, Any] | None = None,
) -> CampaignFlights:
    """Fly each law in the same random flights: drawn drones, winds, delays, headings.

    laws:       by name, the settings of controllers, or laws of your own as for `fly`.
    vehicle:    the drone round which others are drawn, as its file has it.
    trajectory, size_m, rate_rad_s: the curve, or what it is drawn from, such as {"uniform": [0.5, 1.5]}; or a
                curve of your own, an object as for `fly`, which has neither size nor rate.
    sensors:    what measures; None for the drone's own.
    draws:      values and distributions of section [draws] of campaign.toml; the others have its defaults.

    Flight number k has the draws that flight k of the command has with that seed. Raises ArgumentError for a
    wrong argument, InvalidSettingsError for wrong draws or names, FlightError for an update period that is no
    whole number of the drone's ticks, BuildError if there is no compiler.
    """
    require_kind("laws", laws, Mapping, "a mapping of names to controllers and laws")
    require(len(laws) > 0, "laws", laws, "have a controller or a law")
    demand_own_names([str(name) for name in laws], "laws")
    for name, law in laws.items():
        good = isinstance(name, str) and NAME.fullmatch(name) is not None
        require(good, "laws", name, "have names of at most 40 letters, digits, - and _")
        has_step = callable(getattr(law, "step", None))
        require(has_step, f"laws[{name!r}]", law, "be a Controller or an object with the method step")
    section: dict[str, Any] = {"size_m": size_m, "rate_rad_s": rate_rad_s, "duration_s": duration_s}
    if not (is_own := is_trajectory(trajectory)):
        section["trajectory"] = trajectory
    file = _file(vehicle, section | ({} if sensors is None else {"sensors": sensors}), draws)
    own = as_curve(trajectory, 0.0, 0.0, duration_s) if is_own else None
    drawn = _draws(file, flights, seed)
    flight = file.flight.model_dump() | {"vehicle": vehicle.drone.model_dump()}
    entrants = [_entrant(name, law) for name, law in laws.items()]
    rows: list[dict[str, Any]] = []
    for first in range(0, len(drawn), MOST_TOGETHER):
        part = drawn[first : first + MOST_TOGETHER]
        flown = fly_scenarios(entrants, [scenario(flight, one) for one in part], curve=own)
        rows += [one | row for one, row in zip(part, flown, strict=True)]
    spatial = spatial_curves(file.flight.trajectory) if own is None else is_spatial(own)
    parameters = list(PARAMETERS)
    if own is not None:
        rows = [row | {TRAJECTORY: type(own).__name__} for row in rows]
        parameters = [name for name in PARAMETERS if name == TRAJECTORY or name not in OF_THE_CURVE]
    titles = "seed", *parameters, *columns(tuple(laws), sensed=flight["sensors"] != "true", spatial=spatial)
    failed = {name: _failures(rows, name) for name in laws}
    return CampaignFlights(
        names=tuple(laws),
        table={name: [row[name] for row in rows] for name in titles},
        failures={name: reasons for name, reasons in failed.items() if reasons},
        duration_s=duration_s,
    )


def draw_vehicles(
    vehicle: Vehicle, flights: int, seed: int = 0, *, draws: Mapping[str, Any] | None = None
) -> Vehicle:
    """Return n drones round a vehicle as one whose mass, inertia, thrust, drag and lags are arrays (n,).

    `fly` takes it with as many seeds. Flight number k of `campaign` has the k-th with
    that seed. draws: as for `campaign`. Raises ArgumentError and InvalidSettingsError.
    """
    file = _file(vehicle, {"duration_s": 1.0}, draws)
    flight = file.flight.model_dump() | {"vehicle": vehicle.drone.model_dump()}
    scenarios = [scenario(flight, one) for one in _draws(file, flights, seed)]
    return flight_of(scenarios, vehicle.drone.step_s).vehicle


def _file(vehicle: Vehicle, flight: Mapping[str, Any], draws: Mapping[str, Any] | None) -> CampaignFile:
    """Return what a campaign.toml with these sections says; raises ArgumentError and InvalidSettingsError."""
    require_kind("vehicle", vehicle, Vehicle, "a Vehicle")
    require(draws is None or isinstance(draws, Mapping), "draws", draws, "be a mapping of names to draws")
    document = {"flight": dict(flight), "draws": dict(draws or {})}
    return completed(as_sections(CampaignFile, document, _SOURCE), vehicle.drone, _SOURCE, replaced=False)


def _draws(file: CampaignFile, flights: int, seed: int) -> list[Draw]:
    """Return the draws of the first flights; raises ArgumentError."""
    require(is_whole(flights, 1, MOST_FLIGHTS), "flights", flights, f"be a whole number in 1..{MOST_FLIGHTS}")
    require(is_whole(seed, 0, LARGEST_SEED), "seed", seed, f"be a whole number in 0..{LARGEST_SEED}")
    found = distributions(file.flight, file.draws)
    return [draw(seed, number, found) for number in range(flights)]


def _entrant(name: str, law: Controller | Law) -> Entrant:
    """Return a controller, whose settings fly, or a law as the campaign flies it."""
    if isinstance(law, Controller):
        return Entrant(name, "nmpc", law.settings)
    return Entrant(name, "law", law=law)


def _failures(rows: Sequence[Mapping[str, Any]], name: str) -> dict[int, str]:
    """Return when and why a law failed, by the number of the flight."""
    key = f"{name}_{FAILURE}"
    return {number: row[key] for number, row in enumerate(rows) if key in row}
