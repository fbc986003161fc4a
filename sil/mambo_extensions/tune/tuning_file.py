"""Read tune.toml: ranges of the searched settings, base controller and flights."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Final

from pydantic import Field

from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.controller_keys import KEYS
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.renamed_keys import OF_BEFORE
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.campaign.campaign_file import (
    Draws,
    FlightSection,
    demand_flyable,
    distributions,
    load_its_drone,
)
from mambo_sil.experiment.campaign.distributions import Distribution, Domain, parse
from mambo_sil.experiment.campaign.drawn_curves import with_files
from mambo_sil.experiment.campaign.parameters import Draw, draw
from mambo_sil.experiment.inputs import FileSection, format_value, load_settings, read_as

DEFAULT_SEARCH: Final[dict[str, dict[str, dict[str, Any]]]] = {
    "1-norm": {
        "horizon": {
            "prediction": {"choice": [6, 8, 10]},
            "control": {"choice": [1, 2]},
            "prediction_step_s": {"uniform": [0.03, 0.12]},
        },
        "model": {"roll_lag_s": {"uniform": [0.05, 0.5]}, "pitch_lag_s": {"uniform": [0.05, 0.5]}},
        "cost": {"effort_weight": {"log_uniform": [0.1, 10000.0]}},
        "optimizer": {
            "iterations": {"choice": [3, 4, 5]},
            "initial_step_rad": {"log_uniform": [0.0005, 0.05]},
        },
    },
    "quadratic": {
        "cost": {"response_time_s": {"uniform": [0.15, 0.3]}},
        "observer": {
            "disturbance_noise": {"log_uniform": [0.03, 3.0]},
            "position_noise": {"log_uniform": [0.001, 0.1]},
            "velocity_noise": {"log_uniform": [0.005, 0.5]},
        },
    },
}
"""The default search, by the method of the base.

With a 1-norm the base has the longest horizons and the most iterations, so no trial takes more computation
than it, and the tracking weight stays fixed, because only its ratio to the effort weight matters.
"""

_FIXED: Final = ("horizon.update_period_s", "cost.tracking_weight")
_MOST_KEYS: Final = 10


class TuningFlight(FlightSection):
    """Keys that all flights share; flights are shorter than in a campaign, because every trial flies them."""

    duration_s: float = Field(20.0, ge=1, le=3600)


class TuneFile(FileSection):
    """The keys of tune.toml; a missing key has its value in the default study.

    A missing search is the default one for the method of the base.
    """

    seed: int = Field(1, ge=0, le=2**63 - 1)
    base: str = "mambo"
    flights: int = Field(12, ge=1, le=1000)
    flight: TuningFlight = TuningFlight()
    draws: Draws = Draws()
    search: dict[str, dict[str, Any]] | None = None


@dataclass(frozen=True)
class Tuning:
    """A study: `search` has a range for each searched key, as cost.effort_weight; `base` has the others."""

    file: TuneFile
    base: Settings
    search: Mapping[str, Distribution]
    drone: VehicleFile

    @property
    def flight(self) -> dict[str, Any]:
        """The section [flight] as plain values, with all of the drone."""
        return self.file.flight.model_dump() | {"vehicle": self.drone.model_dump()}

    @property
    def start(self) -> dict[str, float]:
        """The base's values of the searched keys."""
        return {path: _value(self.base, path) for path in self.search}

    def settings(self, values: Mapping[str, float]) -> Settings:
        """Return the base with `values` of the searched keys, rounded to four digits.

        Raises InvalidSettingsError for a combination that breaks a rule.
        """
        document = self.base.model_dump()
        for path, value in values.items():
            whole = KEYS[path].kind == "whole number"
            document = controller_toml.with_value(document, path, int(value) if whole else round_value(value))
        return controller_toml.validate(document, "the search")

    def draw_flights(self) -> list[Draw]:
        """Return the draws of the flights that every trial flies."""
        found = distributions(self.file.flight, self.file.draws)
        return [draw(self.file.seed, flight, found) for flight in range(self.file.flights)]

    def document(self) -> dict[str, Any]:
        """Return everything that determines the trials, as plain values."""
        document: dict[str, Any] = self.file.model_dump(mode="json")
        search = {path: distribution.document() for path, distribution in self.search.items()}
        found = {"base": self.base.model_dump(), "search": search, "vehicle": self.drone.model_dump()}
        return with_files(document | found, self.file.flight.trajectory)


def round_value(value: float) -> float:
    """Return `value` rounded to four significant digits."""
    return float(f"{value:.4g}")


def default(vehicle: str | None = None) -> Tuning:
    """Return the default study, with another drone if one is named."""
    return _tuning(TuneFile(), Path(), "the default study", vehicle)


def read(path: Path, vehicle: str | None = None) -> Tuning:
    """Read a tune.toml; the paths of base and drone are relative to its folder.

    `vehicle` replaces the drone and, where it has not the sensors of the file, these by its own.

    Raises UnreadableFileError for a file that is missing or not TOML, InvalidSettingsError with the errors of
    the file and of the base's file.
    """
    return _tuning(read_as(TuneFile, path), path.parent, echo(str(path)), vehicle)


def _tuning(file: TuneFile, folder: Path, source: str, vehicle: str | None) -> Tuning:
    """Load drone and base; check that every combination of the ranges' ends is valid and can be simulated."""
    file, drone = load_its_drone(file, folder, source, vehicle)
    base = load_settings(file.base, folder, f"{source}: base")
    search = DEFAULT_SEARCH[base.controller.method] if file.search is None else file.search
    file = file.model_copy(update={"search": search})
    tuning = Tuning(file, base, _search(search, base, source), drone)
    demand_flyable(base, tuning.flight, tuning.draw_flights()[0], f"{source}: base")
    _demand_valid_corners(tuning, source)
    return tuning


def _search(
    sections: Mapping[str, Mapping[str, Any]], base: Settings, source: str
) -> dict[str, Distribution]:
    """Return the range of each searched key; raises InvalidSettingsError with all errors."""
    found: dict[str, Distribution] = {}
    faults: list[str] = []
    for section, values in sections.items():
        for name, value in values.items():
            path = f"{section}.{name}"
            try:
                found[path] = _range(path, value, base)
            except ValueError as error:
                faults.append(f"{source}: search.{echo(path)} = {format_value(value)} {error}")
    if not faults and not 1 <= len(found) <= _MOST_KEYS:
        faults.append(
            f"{source}: search must have 1 to {_MOST_KEYS} keys of a controller.toml in its sections"
        )
    if faults:
        raise InvalidSettingsError(tuple(faults))
    return found


def _range(path: str, value: Any, base: Settings) -> Distribution:
    """Return the range of one key; raises ValueError, "must ..." or "is now ..."."""
    if path in OF_BEFORE:
        raise ValueError(OF_BEFORE[path])
    key = KEYS.get(path)
    free = [one for one in KEYS if KEYS[one].low is not None and one not in _FIXED and base.uses(one)]
    if key is None or key.low is None or key.high is None or path not in free:
        raise ValueError(f"must name a number of a controller.toml that may be tuned: {', '.join(free)}")
    found = parse(value, Domain(key.low, key.high, whole=key.kind == "whole number"))
    if found.kind in ("constant", "normal"):
        raise ValueError("must be a range: uniform, log_uniform or choice")
    held, numbers = _value(base, path), found.numbers
    ranged = found.kind in ("uniform", "log_uniform")
    if not (numbers[0] <= held <= numbers[1] if ranged else held in numbers):
        raise ValueError(f"must include the base's {held:g}: the search starts there")
    return found


def _demand_valid_corners(tuning: Tuning, source: str) -> None:
    """Raise InvalidSettingsError unless every combination of the ranges' ends is valid."""
    ends = [(min(found.numbers), max(found.numbers)) for found in tuning.search.values()]
    for corner in product(*ends):
        try:
            tuning.settings(dict(zip(tuning.search, corner, strict=True)))
        except InvalidSettingsError as error:
            fault = error.faults[0].partition(": ")[2]
            raise InvalidSettingsError(
                (f"{source}: search: a combination of the ranges' ends is invalid: {fault}",)
            ) from None


def _value(settings: Settings, path: str) -> float:
    return float(settings.value(path))
