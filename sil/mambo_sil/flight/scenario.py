"""One flight as a file: all parameters that determine it, so that it can be repeated bit for bit.

A `Scenario` holds trajectory, start, drone, disturbances, link and sensors of one flight. A `Record` adds the
controller and the digest of the trace. `flight_of` makes one `Flight` of several scenarios.
"""

import json
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_codegen.plain_file import guess_name, read_plain_file
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.airframe import NOMINAL, Airframe, airframe_of
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.link import Link
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.sensors.drift import DriftingEstimate
from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.drone.sensors.mocap import MotionCapture
from mambo_sil.drone.sensors.suites import AnySensors
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import (
    AutopilotSensors,
    FlowDeckSensors,
    MamboSensors,
    MocapSensors,
    TrueState,
)
from mambo_sil.errors import FlightError, ScenarioError
from mambo_sil.flight.altitude_loops import AltitudeLaw
from mambo_sil.flight.loop import Flight, Offset
from mambo_sil.flight.names import (
    CONTROLLER_NAMES,
    CURVE_NAMES,
    AltitudeName,
    SensorsName,
    Start,
    kind_of,
)
from mambo_sil.flight.own_curve import curve_named, is_curve_file
from mambo_sil.flight.trajectories import Trajectories, Trajectory

FORMAT: Final = 2
"""Of a record: other keys have another number."""

LARGEST_FILE_BYTES: Final = 1_000_000
LARGEST_SEED: Final = 2**63 - 1
LARGEST_SIZE_M: Final = 1000.0
LARGEST_RATE_RAD_S: Final = 100.0
LONGEST_S: Final = 3600.0
LARGEST_YAW_RAD: Final = 1000.0
LARGEST_WIND_M_S: Final = 50.0

_NAMES: Final = "|".join(CONTROLLER_NAMES)
RecordedController = Annotated[str, Field(pattern=rf"^(?:{_NAMES}|.*\.py:\w+)$")]
"""A controller by name, or a law of the user's own, FILE.py:CLASS."""
RecordedCurve = Annotated[str, Field(pattern=rf"^(?:{'|'.join(CURVE_NAMES)}|.*\.py:\w+|.*\.(?i:csv))$")]
"""A curve by name, or the user's own, FILE.csv or FILE.py:CLASS."""
Two = tuple[float, float]
Three = tuple[float, float, float]


class _Record(BaseModel):
    """A frozen model that rejects unknown keys, infinity and NaN."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True, defer_build=True
    )


OF_THE_VEHICLE: Final = (
    *("mass_kg", "inertia_kg_m2", "thrust_factor_n_s2", "torque_factor_n_m_s2"),
    *("motor_lag_s", "drag_1_s"),
)
"""Keys of a scenario whose defaults are its vehicle's."""
_AS_THE_VEHICLE: Final[Any] = None


class Scenario(_Record):
    """Parameters of one flight; default: Table II's, with a nominal, undisturbed Mambo without sensors.

    Mass, inertia, rotors and drag are the vehicle's unless they are given.
    """

    vehicle: VehicleFile = NOMINAL
    """The drone: its inner loops and mixer are always as in its file."""

    seed: int = Field(0, ge=0, le=LARGEST_SEED)
    """Seed of sensor noise, gusts and dropped updates."""

    trajectory: RecordedCurve = "bernoulli"
    size_m: float = Field(2.0, ge=-LARGEST_SIZE_M, le=LARGEST_SIZE_M)
    rate_rad_s: float = Field(0.5, ge=-LARGEST_RATE_RAD_S, le=LARGEST_RATE_RAD_S)
    duration_s: float = Field(100.0, gt=0.0, le=LONGEST_S)

    start: Start = "hover"
    start_offset_m: Three = (0.0, 0.0, 0.0)
    """Offset from the nominal start in the world frame (NED)."""
    start_velocity_m_s: Three = (0.0, 0.0, 0.0)
    """In the world frame."""
    start_tilt_rad: Two = (0.0, 0.0)
    """Roll and pitch."""
    yaw_rad: float = Field(0.0, ge=-LARGEST_YAW_RAD, le=LARGEST_YAW_RAD)
    yaw_rate_rad_s: float = 0.0

    mass_kg: float = Field(_AS_THE_VEHICLE, gt=0.0)
    inertia_kg_m2: Three = _AS_THE_VEHICLE
    thrust_factor_n_s2: float = Field(_AS_THE_VEHICLE, gt=0.0)
    torque_factor_n_m_s2: float = Field(_AS_THE_VEHICLE, gt=0.0)
    motor_lag_s: float = Field(_AS_THE_VEHICLE, ge=0.0, le=1.0)
    drag_1_s: float = Field(_AS_THE_VEHICLE, ge=0.0)

    fence_m: float = Field(0.0, ge=0.0, le=LARGEST_SIZE_M)
    """Half the width of a square fence round the origin, which the controller is given in flight; 0: none."""
    fence_time_s: float = Field(0.0, ge=0.0, le=LONGEST_S)
    """Time at which it is given the fence."""

    push_m_s2: Two = (0.0, 0.0)
    """Steady acceleration along x and y of the world."""
    wind_speed_m_s: float = Field(0.0, ge=0.0, le=LARGEST_WIND_M_S)
    """Mean wind 20 ft above the ground, with gusts; 0 is still air."""
    wind_direction_rad: float = 0.0
    """Heading towards which the air moves."""
    battery_sag_1_s: float = Field(0.0, ge=0.0, le=1.0)
    payload_kg: float = 0.0
    payload_time_s: float = 0.0
    impulse_n_s: Three = (0.0, 0.0, 0.0)
    impulse_time_s: float = 0.0
    vertical_gust_m_s2: float = Field(0.0, ge=-100.0, le=100.0)
    """Acceleration upwards from `vertical_gust_time_s` on."""
    vertical_gust_time_s: float = 0.0
    ground_effect_radius_m: float = Field(0.0, ge=0.0, le=1.0)
    """Radius of the rotor in the ground effect of Cheeseman and Bennett; 0 for none."""

    command_delay_ticks: int = Field(0, ge=0, le=200)
    """Delay of the roll and pitch commands in ticks of the vehicle."""
    dropped_share: float = Field(0.0, ge=0.0, le=1.0)
    """Probability that an update of the position controller is dropped; its last command is held."""

    altitude_loop: AltitudeName = "stock"
    """What holds the height: the vehicle's loop, that with feed-forward, or a PID with feed-forward."""

    sensors: SensorsName = "true"
    noise_scale: float = Field(1.0, ge=0.0, le=1000.0)
    """Factor on the standard deviation of all sensor noise."""
    accelerometer_bias_m_s2: Three = (0.0, 0.0, 0.0)
    """Bias that remains after the calibration before take-off."""
    gyro_bias_rad_s: Three = (0.0, 0.0, 0.0)

    @field_validator(*OF_THE_VEHICLE, mode="before")
    @classmethod
    def _as_the_vehicle(cls, value: Any, info: ValidationInfo) -> Any:
        drone = info.data.get("vehicle")
        if value is not _AS_THE_VEHICLE or drone is None:
            return value
        vehicle = Vehicle.of(drone)
        key = str(info.field_name)
        return getattr(vehicle if hasattr(vehicle, key) else vehicle.airframe, key)

    @model_validator(mode="after")
    def _can_fly(self) -> Self:
        if min(self.inertia_kg_m2) <= 0.0:
            raise ValueError("inertia_kg_m2 must be three positive numbers")
        if self.mass_kg + self.payload_kg <= 0.0:
            raise ValueError("payload_kg must leave a positive mass")
        return self


SHARED_KEYS: Final = ("vehicle", "duration_s", "start", "sensors", "altitude_loop")
"""Keys that must be equal in all flights of one simulation."""


def flight_of(
    scenarios: Sequence[Scenario], update_period_s: float, curve: Trajectory | None = None
) -> Flight:
    """Return one simulation with a flight for each scenario, in order; all of `curve`, if it is given.

    Raises `FlightError` for no scenario, or if the scenarios differ in one of `SHARED_KEYS`, and as
    `load_curve`.
    """
    if not scenarios:
        raise FlightError("flights = 0 must be 1 or more")
    first = scenarios[0]
    for key in SHARED_KEYS:
        if any(getattr(scenario, key) != getattr(first, key) for scenario in scenarios):
            raise FlightError(f"{key} must be the same in all flights of one simulation")

    def each(key: str) -> Any:
        """Return an array (n,) for a number, or a tuple of such arrays for a tuple."""
        values = np.array([getattr(scenario, key) for scenario in scenarios], np.float64)
        return values if values.ndim == 1 else tuple(np.ascontiguousarray(values.T))

    def common(kind: type[Any]) -> dict[str, Any]:
        """Return the fields that a record has in common with a scenario."""
        return {field.name: each(field.name) for field in fields(kind) if field.name in Scenario.model_fields}

    n, drone = len(scenarios), first.vehicle
    delays = np.array([scenario.command_delay_ticks for scenario in scenarios], np.int64)
    return Flight(
        _curves(scenarios) if curve is None else curve,
        duration_s=first.duration_s,
        flights=n,
        start=first.start,
        yaw_rad=each("yaw_rad"),
        yaw_rate_rad_s=each("yaw_rate_rad_s"),
        vehicle=Vehicle(replace(airframe_of(drone), **common(Airframe)), **common(Vehicle), drone=drone),
        update_period_s=update_period_s,
        seeds=tuple(scenario.seed for scenario in scenarios),
        offset=Offset(each("start_offset_m"), each("start_velocity_m_s"), each("start_tilt_rad")),
        disturbances=Disturbances(**common(Disturbances)),
        link=Link(delay_ticks=delays, **common(Link)),
        sensors=choose_sensors(first.sensors, drone, **common(Sensors)),
        altitude=AltitudeLaw(first.altitude_loop),
    )


def _curves(scenarios: Sequence[Scenario]) -> Trajectories:
    """Return the curves that scenarios name, each made once."""
    named = {_curve_of(s): s for s in scenarios}
    curves = {key: curve_named(s.trajectory, s.size_m, s.rate_rad_s) for key, s in named.items()}
    return Trajectories(tuple(curves[_curve_of(s)] for s in scenarios))


def _curve_of(scenario: Scenario) -> tuple[str, ...]:
    """Return what tells the curve of a scenario from others; that of a file has neither size nor rate."""
    name = scenario.trajectory
    return (name,) if is_curve_file(name) else (name, repr(scenario.size_m), repr(scenario.rate_rad_s))


def choose_sensors(name: SensorsName, drone: VehicleFile, **parameters: Any) -> AnySensors | None:
    """Return the sensors called `name` of a drone, None for the true state; `parameters` as of `Sensors`.

    Raises FlightError if its file has no figures of them.
    """
    try:
        figures = drone.with_sensors(kind_of(name)).sensors
    except InvalidSettingsError as error:
        raise FlightError(str(error)) from None
    noise_scale = parameters.get("noise_scale", 1.0)
    match figures:
        case TrueState():
            return None
        case MocapSensors():
            return MotionCapture(figures, noise_scale)
        case MamboSensors():
            return Sensors(figures=figures, derotated=name == "mambo-derotated", **parameters)
        case FlowDeckSensors() | AutopilotSensors():
            return DriftingEstimate(figures, noise_scale)


def has_sensors(drone: VehicleFile, name: SensorsName) -> bool:
    """Return whether the file of a drone has the figures of sensors."""
    try:
        choose_sensors(name, drone)
    except FlightError:
        return False
    return True


class Record(_Record):
    """A flight that can be repeated: scenario, controller and digest of the trace."""

    format: Literal[2] = FORMAT
    scenario: Scenario
    controller: RecordedController = "nmpc"
    settings: Settings
    """Settings of the NMPC; a PD uses their update period only, a law of the user's own nothing."""
    trace_sha256: str | None = None
    """`Trace.digest` of the original flight, if known."""


def write_record(record: Record, path: Path) -> None:
    """Write a record as JSON."""
    path.write_text(json.dumps(record.model_dump(mode="json"), indent=2) + "\n", "utf-8")


def read_record(path: Path) -> Record:
    """Read a record; raises `ScenarioError`, which names file, key and rule."""
    name = echo(str(path))
    try:
        content = read_plain_file(path, LARGEST_FILE_BYTES + 1)
    except OSError as error:
        raise ScenarioError(f"{name}: cannot be read: {error.strerror}{guess_name(path)}") from error
    if len(content) > LARGEST_FILE_BYTES:
        raise ScenarioError(f"{name}: is larger than 1 MB; the record of a flight takes a few kB")
    try:
        return Record.model_validate_json(content)
    except ValidationError as error:
        faults = error.errors(include_url=False, include_context=False, include_input=False)
        if any(fault["loc"] == ("format",) for fault in faults):
            raise ScenarioError(
                f"{name}: is a record of another version of mambo-nmpc; repeat it with that version"
            ) from None
        lines = [f"{name}: {'.'.join(map(str, fault['loc'])) or 'file'}: {fault['msg']}" for fault in faults]
        raise ScenarioError("\n".join(lines)) from None
