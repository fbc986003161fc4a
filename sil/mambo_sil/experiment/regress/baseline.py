"""Baselines: the recorded metrics of a suite with one controller, in a file that users commit.

The file `<suite>.<controller>.baseline.json` has one line per flight, so that a difference of two versions
shows which flights changed. A baseline is compared only with the flights from which it was recorded.
"""

import hashlib
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict, ValidationError, field_validator

from mambo_codegen import __version__
from mambo_codegen.atomic import put
from mambo_codegen.errors import FileExistsRefusedError, InvalidSettingsError, echo, echo_value
from mambo_codegen.plain_file import find_obstacle
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.experiment.campaign.campaign_flights import DIGEST, INDICES, Row
from mambo_sil.experiment.campaign.store import convert_os_errors
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.experiment.regress.suite_file import FlightSuite
from mambo_sil.flight.scenario import Scenario
from mambo_sil.results.folders import GENERATOR

SCENARIO: Final = "scenario"
_UPDATE: Final = "record it anew with --update"
_MARK: Final = f'"generator": "{GENERATOR}'.encode()

Recorded = dict[str, float | str | None]
"""Recorded metrics of a flight (None for one that was lost), `SCENARIO`, and `DIGEST` for the same bits."""


class Baseline(BaseModel):
    """The recorded metrics of a suite with one controller."""

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True, allow_inf_nan=False)

    generator: str
    suite: str
    controller: str
    settings: str
    """Settings digest of the controller."""
    flights: dict[str, Recorded]

    @field_validator("flights")
    @classmethod
    def _check_kinds(cls, flights: dict[str, Recorded]) -> dict[str, Recorded]:
        for name, held in flights.items():
            for key, value in held.items():
                if isinstance(value, str) != (key in (SCENARIO, DIGEST)):
                    rule = "text" if key in (SCENARIO, DIGEST) else "a number or null"
                    raise ValueError(f"{echo(name)}: {echo(key)} = {echo_value(value)} must be {rule}")
        return flights


def baseline_path(suite: FlightSuite, controller: str) -> Path:
    """Return where the baseline of a suite with a controller is, recorded or not."""
    return suite.folder / f"{suite.name}.{controller}.baseline.json"


def read_baseline(suite: FlightSuite, controller: str) -> Baseline | None:
    """Read the baseline of a suite with a controller; None if none was recorded.

    Raises InvalidSettingsError if it cannot be read or was recorded from other flights.
    """
    path = baseline_path(suite, controller)
    if not path.exists():
        return None
    name = echo(str(path))
    try:
        found = Baseline.model_validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        reason = error.strerror if isinstance(error, OSError) else _first_fault(error)
        raise InvalidSettingsError((f"{name}: is no baseline of mambo-nmpc: {reason}; {_UPDATE}",)) from None
    changes = _changes(suite, found)
    if changes:
        raise InvalidSettingsError((f"{name}: was recorded from other flights: {changes}; {_UPDATE}",))
    return found


def _first_fault(error: ValidationError) -> str:
    """Return place and rule of the first fault of a file."""
    fault = error.errors()[0]
    place = ".".join(map(str, fault["loc"])) or "file"
    return f"{echo(place)}: {fault['msg'].removeprefix('Value error, ')}"


def _changes(suite: FlightSuite, found: Baseline) -> str:
    """Return a phrase on how the flights of a suite differ from a baseline's, empty if they do not."""
    needed = {SCENARIO, *suite.tolerances, *([DIGEST] if suite.same_bits else [])}
    ours = {flight.name: flight.scenario for flight in suite.flights}
    kinds = {
        "new": [name for name in ours if name not in found.flights],
        "gone": [name for name in found.flights if name not in ours],
        "changed": [
            name
            for name, held in found.flights.items()
            if name in ours and held.get(SCENARIO) != _scenario_digest(ours[name])
        ],
        "without a value to compare": [
            name for name, held in found.flights.items() if name in ours and not needed <= held.keys()
        ],
    }
    return ", ".join(f"{len(names)} {kind} ({echo(names[0])})" for kind, names in kinds.items() if names)


def demand_replaceable(path: Path) -> None:
    """Raise FileExistsRefusedError if `path` exists and does not begin as a baseline, damaged or not."""
    name = echo(str(path))
    if obstacle := "a link" if path.is_symlink() else find_obstacle(path):
        raise FileExistsRefusedError(f"{name}: is {obstacle}, not a plain file; move it away")
    with convert_os_errors(path):
        if path.exists() and _MARK not in path.read_bytes()[:1000]:
            raise FileExistsRefusedError(f"{name}: exists and is no baseline of mambo-nmpc; move it away")


def record_baseline(suite: FlightSuite, entrant: Entrant, rows: Sequence[Row]) -> Path:
    """Write the baseline of a flown suite, whole or not at all; return its path. Raises UnwritableError."""
    path = baseline_path(suite, entrant.name)
    head = {
        "generator": f"{GENERATOR}{__version__}",
        "suite": suite.name,
        "controller": entrant.name,
        "settings": entrant.settings.digest,
    }
    lines = [f"  {json.dumps(key)}: {json.dumps(value)}," for key, value in head.items()]
    recorded = {
        flight.name: _record(flight.scenario, row, same_bits=suite.same_bits)
        for flight, row in zip(suite.flights, rows, strict=True)
    }
    flights = [f"    {json.dumps(name)}: {json.dumps(held)}" for name, held in recorded.items()]
    text = "\n".join(["{", *lines, '  "flights": {', ",\n".join(flights), "  }", "}", ""])
    with convert_os_errors(path):
        put(path, text.encode())
    return path


def _record(scenario: Scenario, row: Row, *, same_bits: bool) -> Recorded:
    """Return what a baseline holds of one flight; metrics have six digits."""
    recorded: Recorded = {SCENARIO: _scenario_digest(scenario)}
    for metric in INDICES:
        value = float(row[metric])
        recorded[metric] = float(f"{value:.6g}") if math.isfinite(value) else None
    return recorded | ({DIGEST: str(row[DIGEST])} if same_bits else {})


def _scenario_digest(scenario: Scenario) -> str:
    """Return a digest of the keys of a flight that differ from the defaults, which its drone has."""
    defaults = Scenario(vehicle=scenario.vehicle)
    same = {key for key in Scenario.model_fields if getattr(scenario, key) == getattr(defaults, key)}
    if scenario.vehicle != NOMINAL:
        same.remove("vehicle")
    return hashlib.sha256(scenario.model_dump_json(exclude=same).encode()).hexdigest()[:16]
