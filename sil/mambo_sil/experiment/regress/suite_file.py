"""Read a suite: groups of flights with bounds on their metrics, and tolerances against recorded metrics.

A list of values of a key multiplies the flights of its group. All errors of a file are reported together.
"""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import as_file
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import Field, PlainValidator, ValidationError, create_model
from pydantic_core import PydanticCustomError

from mambo_codegen.errors import InvalidSettingsError, echo, echo_value
from mambo_codegen.settings.toml_file import ShippedFiles
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.campaign.campaign_flights import INDICES, OF_LIMITS
from mambo_sil.experiment.inputs import FileSection, load_drone, read_as
from mambo_sil.flight.names import DEFAULT_SENSORS
from mambo_sil.flight.scenario import Scenario, has_sensors

SUITES: Final = ShippedFiles(
    "suites",
    "a shipped suite",
    "shipped suites",
    "docs/how-to/regress.md shows how to write one",
    "mambo_sil.experiment.regress",
)
MOST_FLIGHTS: Final = 2000
MOST_VALUES: Final = 1000
DEFAULT_TOLERANCE: Final = 0.05
"""Tolerance of the IAE in a suite without the section [baseline]: a share of the recorded value."""

_GROUP_NAME: Final = re.compile(r"[A-Za-z0-9_-]{1,40}")
_RANGE: Final = "{ from = first, to = last, count = number }"

VEHICLE: Final = "vehicle"
_DEFAULTS: Final = Scenario()

Values = tuple[Any, ...]
"""The values of a key, one flight each."""


def _values_of(key: str, written: Any) -> Values:
    """Return the values of a key of a flight from its TOML value; raises ValueError, "must ..."."""
    vector = isinstance(getattr(_DEFAULTS, key), tuple)
    if isinstance(written, dict):
        items = _spread(written)
    elif isinstance(written, list) and (not vector or any(isinstance(one, list) for one in written)):
        items = written
    else:
        items = [written]
    if not 1 <= len(items) <= MOST_VALUES:
        raise ValueError(f"must have 1 to {MOST_VALUES} values")
    values = tuple(_value_of(key, item, alone=item is written) for item in items)
    if len(set(values)) < len(values):
        raise ValueError("must have different values; every value is a flight of its own")
    return values


def _value_of(key: str, item: Any, *, alone: bool) -> Any:
    """Return one value of a key, checked as in a record of a flight; raises ValueError, "must ..."."""
    if key == VEHICLE:
        if not isinstance(item, str):
            raise ValueError(f"must be the name of a vehicle or its file; {echo_value(item)} is not")
        return item
    try:
        return getattr(_OneKey.model_validate_json(json.dumps({key: item}, default=str), strict=True), key)
    except ValidationError as error:
        default = getattr(_DEFAULTS, key)
        rule = error.errors()[0]["msg"].replace("Input should", "must")
        if isinstance(default, tuple):
            rule = f"must be a vector of {len(default)} finite numbers, or a list of such vectors"
        raise ValueError(rule if alone else f"{rule}; {echo_value(item)} is not") from None


def _spread(written: dict[str, Any]) -> list[Any]:
    """Return evenly spaced values, both ends included; raises ValueError, "must ..."."""
    first: Any = written.get("from")
    last: Any = written.get("to")
    count = written.get("count")
    numbers = all(type(one) in (int, float) and math.isfinite(one) for one in (first, last))
    if not numbers or type(count) is not int or len(written) != 3:
        raise ValueError(f"must be a value, a list of values, or {_RANGE}")
    if not 2 <= count <= MOST_VALUES:
        raise ValueError(f"must have a count of 2 to {MOST_VALUES}")
    whole = isinstance(first, int) and isinstance(last, int) and (last - first) % (count - 1) == 0
    if whole:
        return [first + (last - first) // (count - 1) * step for step in range(count)]
    steps = ((first * (count - 1 - step) + last * step) / (count - 1) for step in range(count))
    return [float(f"{value:.6g}") for value in steps]


def _key_field(key: str) -> Any:
    """Return type and default of a key of a flight in a group."""

    def validate(written: Any) -> Values:
        try:
            return _values_of(key, written)
        except ValueError as error:
            raise PydanticCustomError("values", "{rule}", {"rule": str(error)}) from None

    return Annotated[Any, PlainValidator(validate)], None


def _metric_field(largest: int) -> Any:
    """Return type and default of a number for a metric."""
    return float | None, Field(None, ge=0, le=largest)


_PLAIN: Final[dict[str, Any]] = {
    key: (
        Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation,
        getattr(_DEFAULTS, key),
    )
    for key, field in Scenario.model_fields.items()
}
_OneKey: Any = create_model("OneKey", __config__=Scenario.model_config, **_PLAIN)
"""A flight without the rules between keys, to check one key."""


class _BoundsBase(FileSection):
    crashed: bool = False
    refused_updates: int | None = Field(None, ge=0, le=10**9)


class _BaselineBase(FileSection):
    same_bits: bool = False


Bounds: Any = create_model(
    "Bounds", __base__=_BoundsBase, **{metric: _metric_field(10**12) for metric in (*INDICES, *OF_LIMITS)}
)
"""Largest allowed value of each metric; `crashed` says whether a flight may crash."""

BaselineSection: Any = create_model(
    "BaselineSection", __base__=_BaselineBase, **{metric: _metric_field(100) for metric in INDICES}
)
"""How far a metric may rise above its recorded value, as a share of it; whether traces must be equal."""


class _GroupBase(FileSection):
    bounds: Bounds = Bounds()


GroupSection: Any = create_model(
    "GroupSection", __base__=_GroupBase, **{key: _key_field(key) for key in Scenario.model_fields}
)
"""The keys of a flight, each with all its values, and the bounds on its metrics."""


class SuiteFile(FileSection):
    """The keys of a suite's file."""

    baseline: BaselineSection = BaselineSection.model_validate({"iae_m_s": DEFAULT_TOLERANCE})
    flight: GroupSection = GroupSection()
    """Keys and bounds of every group that has none of its own."""
    flights: dict[str, GroupSection] = Field(default_factory=dict)


@dataclass(frozen=True)
class SuiteFlight:
    """One flight of a suite: `values` names what distinguishes it from others of its group."""

    group: str
    values: str
    scenario: Scenario
    bounds: Mapping[str, float]

    @property
    def name(self) -> str:
        """The name of the flight, which no other flight of the suite has."""
        return f"{self.group}/{self.values}" if self.values else self.group


@dataclass(frozen=True)
class FlightSuite:
    """A suite; `folder` is where its baselines are."""

    name: str
    folder: Path
    flights: tuple[SuiteFlight, ...]
    tolerances: Mapping[str, float]
    same_bits: bool


def load_suite(named: str, vehicle: str | None = None, of_settings: str | None = None) -> FlightSuite:
    """Load a shipped suite or a file; `envelope` is the suite, `./envelope` a file.

    `vehicle` replaces the drone of all flights and, where it has not the sensors of a flight, these by its
    own; another one than the Mambo is part of the suite's name. Without it `of_settings`, the drone of the
    controller's settings, replaces that of a shipped suite, and of a file that names none. The baselines of
    a shipped suite are in the working directory. Raises SourceNotFoundError if there is neither,
    UnreadableFileError for a file that is not TOML, InvalidSettingsError with all its errors.
    """
    found = SUITES.own_file(named)
    if found is None:
        with as_file(SUITES.file(named)) as path:
            return _suite(read_as(SuiteFile, path), named, Path(), f"suite {named}", vehicle or of_settings)
    file = read_as(SuiteFile, found)
    if vehicle is None and not any(getattr(one, VEHICLE) for one in (file.flight, *file.flights.values())):
        vehicle = of_settings
    return _suite(file, found.stem, found.parent, echo(named), vehicle)


def _suite(file: SuiteFile, name: str, folder: Path, source: str, vehicle: str | None) -> FlightSuite:
    """Return the suite with all its flights; raises InvalidSettingsError with all errors."""
    flights: list[SuiteFlight] = []
    faults: list[str] = []
    count = 0
    drone = None if vehicle is None else vehicle_toml.load(vehicle)
    for group, section in file.flights.items():
        if not _GROUP_NAME.fullmatch(group):
            faults.append(f"flights.{echo(group)} must have a name of at most 40 letters, digits, - and _")
        values = {key: getattr(section, key) or getattr(file.flight, key) for key in Scenario.model_fields}
        values = {key: found for key, found in values.items() if found is not None}
        if drone is not None:
            values = _replace_drone(values, drone)
        elif VEHICLE in values:
            place = f"{source}: flights.{group}.{VEHICLE}"
            values[VEHICLE] = tuple(load_drone(named, folder, place) for named in values[VEHICLE])
        count += math.prod(map(len, values.values()))
        if count <= MOST_FLIGHTS:
            try:
                flights += _flights(group, values, _bounds(file.flight.bounds, section.bounds))
            except ValueError as error:
                faults.append(f"flights.{group}: {error}")
    if not 1 <= count <= MOST_FLIGHTS:
        faults.append(
            f"flights = {count} must be 1 to {MOST_FLIGHTS}; [flights.name] begins a group of flights, and "
            "the numbers of values of its keys multiply"
        )
    if faults:
        raise InvalidSettingsError(tuple(f"{source}: {fault}" for fault in faults))
    if drone is not None and drone != NOMINAL:
        name = f"{name}.{drone.name}"
    tolerances = file.baseline.model_dump(exclude={"same_bits"}, exclude_none=True)
    return FlightSuite(name, folder, tuple(flights), tolerances, file.baseline.same_bits)


def _replace_drone(values: Mapping[str, Values], drone: VehicleFile) -> dict[str, Values]:
    """Return the values of a group's keys with another drone, and its own sensors for those it has not."""
    own = DEFAULT_SENSORS[drone.sensors.kind]
    sensors = (one if has_sensors(drone, one) else own for one in values.get("sensors", ("true",)))
    return {VEHICLE: (drone,), **values} | {VEHICLE: (drone,), "sensors": tuple(dict.fromkeys(sensors))}


def _bounds(common: FileSection, own: FileSection) -> dict[str, float]:
    """Return the bounds of a group by metric, in the order of the metrics."""
    given = common.model_dump(exclude_unset=True) | own.model_dump(exclude_unset=True)
    whole = Bounds(**given).model_dump(exclude_none=True)
    return {metric: float(bound) for metric, bound in whole.items()}


def _flights(group: str, values: Mapping[str, Values], bounds: Mapping[str, float]) -> list[SuiteFlight]:
    """Return the flights of a group: all combinations of the values; raises ValueError, the broken rule."""
    flights: list[SuiteFlight] = []
    varied = [key for key, found in values.items() if len(found) > 1]
    for combination in product(*values.values()):
        chosen = dict(zip(values, combination, strict=True))
        try:
            scenario = Scenario(**chosen)
        except ValidationError as error:
            raise ValueError(error.errors()[0]["msg"].removeprefix("Value error, ")) from None
        named = ",".join(f"{key}={_spell(chosen[key])}" for key in varied)
        flights.append(SuiteFlight(group, named, scenario, bounds))
    return flights


def _spell(value: Any) -> str:
    """Spell a value in the name of a flight: shortest form that no other value has."""
    match value:
        case VehicleFile():
            return value.name
        case tuple():
            return ";".join(map(_spell, value))
        case float() if float(f"{value:g}") == value:
            return f"{value:g}"
        case _:
            return str(value)
