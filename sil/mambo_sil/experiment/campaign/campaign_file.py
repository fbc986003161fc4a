"""Read campaign.toml: distributions of the parameters, flight and controllers.

A message names file, key, value, rule and fix; all errors of a file are reported together.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import (
    Field,
    PlainSerializer,
    PlainValidator,
    create_model,
    field_validator,
)
from pydantic_core import PydanticCustomError

from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import ArgumentError, FlightError
from mambo_sil.experiment.campaign.distributions import Distribution, parse
from mambo_sil.experiment.campaign.drawn_curves import located, spatial_curves, with_files
from mambo_sil.experiment.campaign.parameters import (
    OF_THE_CURVE,
    PARAMETERS,
    Draw,
    defaults_of,
    draw,
    scenario_values,
)
from mambo_sil.experiment.inputs import Entrant, File, FileSection, load_any_entrant, load_drone, read_as
from mambo_sil.flight.controllers.own_law import LawFile, OwnLaws
from mambo_sil.flight.names import DEFAULT_SENSORS, AltitudeName, SensorsName, Start
from mambo_sil.flight.scenario import Scenario, choose_sensors, flight_of, has_sensors

_LONGEST_LIST: Final = 10
_RARE: Final = 1e-9
"""A share of draws that no campaign meets."""


def _checked(name: str) -> PlainValidator:
    """Return what checks the distribution of a parameter."""

    def validate(value: Any) -> Distribution:
        try:
            return parse(value, PARAMETERS[name].domain)
        except ValueError as error:
            raise PydanticCustomError("draw", "{rule}", {"rule": str(error)}) from None

    return PlainValidator(validate)


_WRITTEN: Final = PlainSerializer(Distribution.document)


class FlightSection(FileSection):
    """Keys that all flights share, and the distributions of what they follow."""

    trajectory: Annotated[Distribution, _checked("trajectory"), _WRITTEN] = PARAMETERS["trajectory"]
    size_m: Annotated[Distribution, _checked("size_m"), _WRITTEN] = PARAMETERS["size_m"]
    rate_rad_s: Annotated[Distribution, _checked("rate_rad_s"), _WRITTEN] = PARAMETERS["rate_rad_s"]
    duration_s: float = Field(100.0, ge=1, le=3600)
    start: Start = "hover"
    vehicle: str = vehicle_toml.DEFAULT
    """A shipped drone, or its vehicle.toml."""
    sensors: SensorsName | None = None
    """None: the vehicle's own."""
    altitude_loop: AltitudeName = "stock"
    """What holds the height."""


_DRAWN: Final[dict[str, Any]] = {
    name: (Annotated[Distribution, _checked(name), _WRITTEN], default)
    for name, default in PARAMETERS.items()
    if name not in OF_THE_CURVE
}
Draws: Any = create_model("Draws", __base__=FileSection, **_DRAWN)


def distributions(flight: FlightSection, draws: FileSection) -> dict[str, Distribution]:
    """Return the distribution of every parameter from the sections [flight] and [draws]."""
    return dict(draws) | {name: getattr(flight, name) for name in OF_THE_CURVE}


class CampaignFile(FileSection):
    """The keys of campaign.toml; a missing key has its value in the default campaign."""

    seed: int = Field(0, ge=0, le=2**63 - 1)
    controllers: tuple[str, ...] = Field(("pd", "pd-feedforward", "mambo"), strict=False)
    flight: FlightSection = FlightSection()
    draws: Draws = Draws()

    @field_validator("controllers")
    @classmethod
    def _check_count(cls, controllers: tuple[str, ...]) -> tuple[str, ...]:
        if not 1 <= len(controllers) <= _LONGEST_LIST:
            raise PydanticCustomError(
                "controllers", f'must name 1 to {_LONGEST_LIST} controllers, as in ["pd", "mambo"]'
            )
        return controllers


@dataclass(frozen=True)
class Campaign:
    """A campaign; the other controllers are compared with the first one."""

    file: CampaignFile
    entrants: tuple[Entrant, ...]
    drone: VehicleFile

    @property
    def flight(self) -> dict[str, Any]:
        """The section [flight] as plain values, with all of the drone."""
        return self.file.flight.model_dump() | {"vehicle": self.drone.model_dump()}

    @property
    def spatial(self) -> bool:
        """Whether any flight may follow a course with a height."""
        return spatial_curves(self.file.flight.trajectory)

    def with_sensors(self, sensors: SensorsName) -> "Campaign":
        """Return the campaign with other sensors; raises InvalidSettingsError."""
        try:
            choose_sensors(sensors, self.drone)
        except FlightError as error:
            raise InvalidSettingsError((f"--{error}",)) from None
        flight = self.file.flight.model_copy(update={"sensors": sensors})
        return replace(self, file=self.file.model_copy(update={"flight": flight}))

    def draw(self, flight: int) -> Draw:
        """Return seed and parameters of flight number `flight`."""
        return draw(self.file.seed, flight, distributions(self.file.flight, self.file.draws))

    def document(self) -> dict[str, Any]:
        """Return everything that determines the result, as plain values."""
        document: dict[str, Any] = self.file.model_dump(mode="json")
        controllers = [entrant.document() for entrant in self.entrants]
        for one in controllers:
            one.get("law", {}).pop("named", None)  # the same wherever its file is
        files = {"controllers": controllers, "vehicle": self.drone.model_dump()}
        return with_files(document | files, self.file.flight.trajectory)

    def places(self) -> dict[str, Any]:
        """Return where the files of laws are, by the names of the controllers."""
        laws = {one.name: one.law.named for one in self.entrants if isinstance(one.law, LawFile)}
        return {"laws": laws} if laws else {}


def scenario(flight: dict[str, Any], drawn: Draw) -> Scenario:
    """Return one flight from `Campaign.flight` and from its draws."""
    drone = VehicleFile.model_validate(flight["vehicle"])
    return Scenario.model_validate(flight | scenario_values(drawn, drone) | {"vehicle": drone})


def default(vehicle: str | None = None) -> Campaign:
    """Return the default campaign, with another drone if one is named."""
    return _campaign(CampaignFile(), Path(), "the default campaign", vehicle)


def read(path: Path, vehicle: str | None = None) -> Campaign:
    """Read a campaign.toml; paths of controllers and drone are relative to its folder.

    `vehicle` replaces the drone and, where it has not the sensors of the file, these by its own.

    Raises UnreadableFileError for a file that is missing or not TOML, InvalidSettingsError with all errors of
    the file and of its controllers' files.
    """
    source = echo(str(path))
    return _campaign(read_as(CampaignFile, path), path.parent, source, vehicle)


def names_drone(path: Path) -> bool:
    """Return whether a campaign.toml itself names the drone that flies; raises as `read_as`."""
    return "vehicle" in read_as(CampaignFile, path).flight.model_fields_set


def _campaign(file: CampaignFile, folder: Path, source: str, vehicle: str | None) -> Campaign:
    """Load drone and controllers and check that each can be simulated."""
    file, drone = load_its_drone(file, folder, source, vehicle)
    entrants = tuple(load_any_entrant(name, folder, f"{source}: controllers") for name in file.controllers)
    demand_own_names([entrant.name for entrant in entrants], f"{source}: controllers")
    campaign = Campaign(file, entrants, drone)
    for entrant, named in zip(entrants, file.controllers, strict=True):
        place, drawn = f"{source}: controllers: {echo(named)}", campaign.draw(0)
        if isinstance(entrant.law, LawFile):
            _demand_command(entrant.law, campaign.flight, drawn, place)
        else:
            demand_flyable(entrant.settings, campaign.flight, drawn, place)
    return campaign


def demand_own_names(names: Sequence[str], place: str) -> None:
    """Raise InvalidSettingsError, which begins with `place`, for two controllers with the same columns."""
    for name, other in itertools.combinations(names, 2):
        if name == other:
            raise InvalidSettingsError((f"{place}: two are called {name}; give them different names",))
        if _stem(name) == _stem(other):
            raise InvalidSettingsError(
                (
                    f"{place}: results of {name} and {other} would have the same names; "
                    "give one a name that differs in more than case and _seen",
                )
            )


def _stem(name: str) -> str:
    """Return what must differ in the names of two controllers: columns and records are named after them.

    Columns of a database and files of some systems ignore case; estimated errors have the prefix `seen_`.
    """
    return name.casefold().removesuffix("_seen")


def demand_flyable(settings: Settings, flight: dict[str, Any], drawn: Draw, place: str) -> None:
    """Raise InvalidSettingsError, which begins with `place`, if a random flight cannot be simulated."""
    try:
        flight_of([scenario(flight, drawn)], settings.horizon.update_period_s)
    except FlightError as error:
        raise InvalidSettingsError((f"{place}: horizon.{error}",)) from None


def _demand_command(law: LawFile, flight: dict[str, Any], drawn: Draw, place: str) -> None:
    """Raise InvalidSettingsError unless a law can be copied, and commands at the start of a flight."""
    try:
        OwnLaws(law.load(), flight_of([scenario(flight, drawn)], law.update_period_s))
    except (ArgumentError, FlightError) as error:
        raise InvalidSettingsError((f"{place}: {error}",)) from None


def load_its_drone(file: File, folder: Path, source: str, vehicle: str | None) -> tuple[File, VehicleFile]:
    """Load the drone that `vehicle` or else the file names; return the file completed for it, and the drone.

    The file has the sections flight and draws.
    """
    content: Any = file
    drone = (
        load_drone(content.flight.vehicle, folder, f"{source}: flight.vehicle")
        if vehicle is None
        else vehicle_toml.load(vehicle)
    )
    return completed(file, drone, source, folder, replaced=vehicle is not None), drone


def completed(file: File, drone: VehicleFile, source: str, folder: Path = Path(), *, replaced: bool) -> File:
    """Return a file with what depends on the drone, which may be `replaced` by another than the file's.

    Curves of the user's own lie in `folder`.

    Raises InvalidSettingsError.
    """
    content: Any = file
    flight = _with_drone(content.flight, drone, source, replaced=replaced)
    trajectory = located(flight.trajectory, flight.duration_s, folder, f"{source}: flight.trajectory")
    flight = flight.model_copy(update={"trajectory": trajectory})
    given = content.draws.model_fields_set
    own = {name: found for name, found in defaults_of(drone).items() if name not in given}
    draws = content.draws.model_copy(update=own)
    _demand_mass(draws, source)
    return file.model_copy(update={"flight": flight, "draws": draws})


def _demand_mass(draws: Any, source: str) -> None:
    """Raise InvalidSettingsError if dropping the payload can leave no mass: of 10^9 flights one or more."""
    mass_kg, payload_kg = (one.quantile(_RARE) for one in (draws.mass_kg, draws.payload_kg))
    if mass_kg + payload_kg <= 0.0:
        raise InvalidSettingsError(
            (
                f"{source}: draws.payload_kg, down to {payload_kg:g}, must leave a positive mass of "
                f"draws.mass_kg, down to {mass_kg:g}; a negative payload is dropped",
            )
        )


def _with_drone(flight: FlightSection, drone: VehicleFile, source: str, *, replaced: bool) -> FlightSection:
    """Return the section [flight] with the drone's name and with sensors that it has.

    If the drone is `replaced`, its own sensors replace those that it has not. Raises InvalidSettingsError.
    """
    sensors = flight.sensors
    if sensors is None or (replaced and not has_sensors(drone, sensors)):
        sensors = DEFAULT_SENSORS[drone.sensors.kind]
    try:
        choose_sensors(sensors, drone)
    except FlightError as error:
        raise InvalidSettingsError((f"{source}: flight.{error}",)) from None
    return flight.model_copy(update={"vehicle": drone.name, "sensors": sensors})
