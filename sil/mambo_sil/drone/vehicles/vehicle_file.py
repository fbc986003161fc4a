"""A drone as data: the content of a vehicle.toml, the rules between its sections, and its JSON schema."""

import math
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, Final, Self, get_args

from pydantic import BaseModel, Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.key import Form, Key, key_of, spell
from mambo_sil.drone.vehicles.vehicle_sections import (
    AltitudeGains,
    AnyAttitude,
    AnySensors,
    AutopilotSensors,
    Body,
    FirmwareName,
    FirstOrderAttitude,
    FlowDeckSensors,
    MamboSensors,
    MocapSensors,
    RotorFigures,
    ThrustResponse,
    TrueState,
    Uncertainty,
    VehicleSection,
)

SENSORS_HZ: Final = 200
"""Rate at which the Mambo's sensors and estimators run."""

KINDS: Final = frozenset({"attitude", "sensors"})
"""Sections whose key `kind` decides which others they have."""

_THRUST_OF_A_ROTOR: Final = (
    "thrust_factor_n_s2",
    "speed_squared_per_command_rad2_s2",
    "command_max",
)
"""Keys of [rotors] whose product is the largest thrust of one."""
_LARGEST: Final = 1e9
"""Bound of most numbers in the sections."""
_INERTIA: Final = ("inertia_x_kg_m2", "inertia_y_kg_m2", "inertia_z_kg_m2")


def _number(document: Mapping[str, Any], section: str, key: str, default: float) -> float:
    """Return a positive number in a document that is not checked yet, or a default."""
    found = document.get(section)
    value = found.get(key) if isinstance(found, Mapping) else None
    return value if isinstance(value, int | float) and 0.0 < value <= _LARGEST else default


class VehicleFile(VehicleSection):
    """A drone (vehicle.toml): body, rotors, inner loops and sensors; its name is the stem of its file."""

    name: str = Field(description="The stem of the file.")
    body: Body = Field(description="Mass, inertia and drag.")
    rotors: RotorFigures | None = Field(None, description="Four equal rotors in X configuration.")
    attitude: AnyAttitude = Field(description="The attitude loop, with yaw.")
    altitude: AltitudeGains = Field(description="The altitude loop.")
    thrust: ThrustResponse | None = Field(
        None, description="The response of the thrust of a drone without rotors."
    )
    sensors: AnySensors = Field(TrueState(), description="The sensors that --sensors switches on.")
    uncertainty: Uncertainty | None = Field(None, description="How well a log has shown these values.")

    @model_validator(mode="before")
    @classmethod
    def _with_altitude(cls, document: Any) -> Any:
        """Give a drone without an altitude loop one of 10 1/s^2 and 5 1/s, and the thrust of its rotors.

        Without rotors it delivers twice its weight for the largest demand.
        """
        if not isinstance(document, Mapping) or "altitude" in document:
            return document
        # A fault of one of these values is reported by its own section.
        mass_kg = min(_number(document, "body", "mass_kg", 1.0), 1e6)
        thrust_max_n = 2.0 * mass_kg * GRAVITY_M_S2 / _number(document, "thrust", "gain", 1.0)
        if isinstance(document.get("rotors"), Mapping):
            figures = [_number(document, "rotors", key, 0.0) for key in _THRUST_OF_A_ROTOR]
            thrust_max_n = min(4.0 * math.prod(figures), _LARGEST) or thrust_max_n
        gains = {"p_n_m": 10.0 * mass_kg, "d_n_s_m": 5.0 * mass_kg, "thrust_max_n": thrust_max_n}
        return {**document, "altitude": gains}

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        faults = [*self._missing(), *self._broken_rules()]
        if faults:
            raise ValidationError.from_exception_data("VehicleFile", faults)
        return self

    def _missing(self) -> Iterator[InitErrorDetails]:
        """Yield the keys that this kind of attitude loop needs, besides its own."""
        if not isinstance(self.attitude, FirstOrderAttitude):
            for key in _INERTIA:
                if getattr(self.body, key) is None:
                    yield InitErrorDetails(type="missing", loc=("body", key), input={})
            if self.rotors is None:
                yield InitErrorDetails(type="missing", loc=("rotors",), input={})

    def _broken_rules(self) -> Iterator[InitErrorDetails]:
        """Yield the faults of keys that depend on others."""
        kind = f"attitude.kind = {spell(self.attitude.kind)}"
        if isinstance(self.attitude, FirstOrderAttitude):
            for key in _INERTIA:
                if getattr(self.body, key) is not None:
                    yield self._fault("body", key, f"must be left out: {kind} has no torques")
            if self.rotors is not None:
                yield self._fault("attitude", "kind", "has no rotors: leave out [rotors]")
        elif self.thrust is not None:
            yield self._fault(
                "attitude", "kind", "has rotors, whose thrust lags by rotors.lag_s: leave out [thrust]"
            )
        if self.rotors is not None and self.rotors.command_min >= self.rotors.command_max:
            least = f"{self.rotors.command_min:g} (rotors.command_min)"
            yield self._fault("rotors", "command_max", f"must be more than {least}")
        if self.largest_thrust_n <= self.weight_n:
            weight = f"{self.hover_demand_n:.4g}, the weight of body.mass_kg"
            over = "" if self.thrust is None else " over thrust.gain"
            source = "" if self.rotors is None else "; without [altitude] it is that of the four rotors"
            yield self._fault("altitude", "thrust_max_n", f"must be more than {weight}{over}{source}")
        rate_hz = self.attitude.rate_hz
        if isinstance(self.sensors, MocapSensors) and rate_hz % self.sensors.position_rate_hz != 0:
            yield self._fault(
                "sensors", "position_rate_hz", f"must be a divisor of {rate_hz} (attitude.rate_hz)"
            )
        if isinstance(self.sensors, MamboSensors) and rate_hz != SENSORS_HZ:
            rule = f"needs attitude.rate_hz = {SENSORS_HZ}, at which its estimators run"
            yield self._fault("sensors", "kind", rule)

    def _fault(self, section: str, key: str, rule: str) -> InitErrorDetails:
        found = getattr(self, section)
        return InitErrorDetails(
            type=PydanticCustomError("vehicle", "{rule}", {"rule": rule}),
            loc=(section, found.kind, key) if section in KINDS else (section, key),
            input=getattr(found, key),
        )

    @property
    def knows_sensors(self) -> bool:
        """Whether the file says what measures, if only that the true state is known."""
        return "sensors" in self.model_fields_set

    def with_sensors(self, kind: str) -> Self:
        """Return the drone with a kind of sensors.

        Raises InvalidSettingsError if its file has no figures of them.
        """
        if kind == self.sensors.kind and self.knows_sensors:
            return self
        plain = {"true": TrueState(), "flow-deck": FlowDeckSensors(), "autopilot": AutopilotSensors()}
        if kind not in plain:
            rule = f"needs its figures, [sensors], in the file of vehicle {echo(self.name)}"
            raise InvalidSettingsError((f"sensors = {spell(kind)} {rule}",))
        return self.model_copy(update={"sensors": plain[kind]})

    @property
    def firmware(self) -> FirmwareName | None:
        """The firmware whose estimator measures, as far as the sensors say it."""
        if isinstance(self.sensors, FlowDeckSensors):
            return "crazyflie"
        return self.sensors.estimator if isinstance(self.sensors, MocapSensors) else None

    @property
    def weight_n(self) -> float:
        """The weight, which the altitude loop adds to its demand."""
        return float(self.body.mass_kg * GRAVITY_M_S2)

    @property
    def thrust_gain(self) -> float:
        """Steady thrust over the demanded one."""
        return 1.0 if self.thrust is None else self.thrust.gain

    @property
    def hover_demand_n(self) -> float:
        """The demanded thrust that carries the weight."""
        return self.weight_n / self.thrust_gain

    @property
    def largest_thrust_n(self) -> float:
        """The thrust that the drone delivers for the largest demand."""
        return self.thrust_gain * self.altitude.thrust_max_n

    @property
    def inertia_kg_m2(self) -> tuple[float, float, float]:
        """Moments of inertia about the body axes; ones for a drone without torques."""
        x, y, z = (getattr(self.body, key) for key in _INERTIA)
        return (1.0, 1.0, 1.0) if x is None else (x, y, z)

    @property
    def motor_lag_s(self) -> float:
        """Time constant of the rotors; 0 for a drone without."""
        return 0.0 if self.rotors is None else self.rotors.lag_s

    @property
    def step_s(self) -> float:
        """Period of the inner loops and of the simulation: a tick."""
        return 1.0 / self.attitude.rate_hz

    @classmethod
    def json_schema(cls) -> dict[str, Any]:
        """Return the JSON schema (draft 2020-12) of vehicle.toml, for editors."""
        schema = cls.model_json_schema()
        del schema["properties"]["name"]
        optional = ("name", "altitude")
        schema["required"] = [key for key in schema["required"] if key not in optional]
        return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


@lru_cache
def form(attitude: str, sensors: str) -> Form:
    """Return what messages on a file with these kinds of attitude loop and sensors need."""
    sections: dict[str, str] = {}
    keys: dict[str, Key] = {}
    for name, field in VehicleFile.model_fields.items():
        if name == "name":
            continue
        kinds = _models(field.annotation)
        chosen = {"attitude": attitude, "sensors": sensors}.get(name)
        model = next((one for one in kinds if _kind_of(one) == chosen), kinds[0])
        _collect(name, field.description or "", model, sections, keys)
        if name in KINDS:
            choices: dict[str, Any] = {"enum": [_kind_of(one) for one in kinds]}
            keys[f"{name}.kind"] = key_of(
                f"{name}.kind", choices | {"description": "decides which other keys the section has"}
            )
    return Form(sections, keys, KINDS)


def _models(annotation: Any) -> list[type[BaseModel]]:
    """Return the models in an annotation: one, or the members of a union."""
    members = get_args(annotation) or (annotation,)
    return [one for one in members if isinstance(one, type) and issubclass(one, BaseModel)]


def _kind_of(model: type[BaseModel]) -> str | None:
    """Return the kind of which a model is; None for a section of one kind."""
    field = model.model_fields.get("kind")
    return None if field is None else str(get_args(field.annotation)[0])


def _collect(
    path: str, description: str, model: type[BaseModel], sections: dict[str, str], keys: dict[str, Key]
) -> None:
    """Add the section at `path`, the sections in it, and all their keys."""
    sections[path] = description
    schemas = model.model_json_schema()["properties"]
    for name, field in model.model_fields.items():
        below, schema = f"{path}.{name}", schemas[name]
        if inner := _models(field.annotation):
            _collect(below, field.description or "", inner[0], sections, keys)
        else:
            keys[below] = key_of(below, schema.get("anyOf", [schema])[0] | {"description": field.description})
