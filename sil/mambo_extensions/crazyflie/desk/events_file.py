"""Read an events file: a flight of an app on the desk, what happens in it, and bounds on what comes of it."""

import math
from importlib.resources import as_file
from typing import Annotated, Final, Literal

from pydantic import Field, Strict, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from mambo_codegen.settings.toml_file import ShippedFiles
from mambo_extensions.crazyflie.desk.desk_flight import DeskConditions, DeskSensors
from mambo_sil.experiment.inputs import FileSection, read_as
from mambo_sil.flight.names import CurveName
from mambo_sil.flight.scenario import LONGEST_S

LEAST_HEIGHT_M, MOST_HEIGHT_M = 0.1, 10.0

EVENTS: Final = ShippedFiles(
    "events",
    "a shipped events file",
    "shipped events files",
    "docs/how-to/desk.md shows how to write one",
    "mambo_extensions.crazyflie.desk",
)
SensorsKind = Literal["mocap", "flow-deck", "lighthouse"]
MeasureName = Literal[
    "lowest_m",
    "highest_m",
    "off_m",
    "mean_m",
    "drift_m",
    "height_off_m",
    "iae_60_s_m_s",
    "command_rms_rad",
    "touch_m_s",
    "told_s",
    "lost_s",
    "largest_x_m",
]
"""Measures of a flight; `desk_report` says what they are."""
SENSORS: Final = {
    "mocap": DeskSensors.MOCAP,
    "flow-deck": DeskSensors.FLOW_DECK,
    "lighthouse": DeskSensors.LIGHTHOUSE,
}

CourseFile = Annotated[str, Field(pattern=r"(?i)\.csv$|\.py:\w+$")]
"""A file of waypoints or polynomial pieces, or a class of a file, FILE.py:CLASS."""

_Metres = Annotated[float, Field(ge=-100.0, le=100.0)]
_Gain = Annotated[float, Field(gt=0.0, le=2.0)]
_Vector = Annotated[tuple[_Metres, _Metres, _Metres], Strict(False)]


class DroneSection(FileSection):
    """The drone on the floor, where it stands, and the wind."""

    mass_kg: float = Field(0.03, gt=0.0, le=1.0)
    thrust_gain: float = Field(1.0, gt=0.0, le=10.0)
    motor_gains: Annotated[tuple[_Gain, _Gain, _Gain, _Gain], Strict(False)] = (1.0, 1.0, 1.0, 1.0)
    sag_1_s: float = Field(0.0, ge=0.0, le=1.0)
    centre_m: Annotated[tuple[_Metres, _Metres], Strict(False)] = (0.0, 0.0)
    rotor_lag_s: float = Field(0.072, ge=0.001, le=1.0)
    heading_deg: float = Field(0.0, ge=-180.0, le=180.0)
    table_m: float = Field(0.0, ge=0.0, le=2.0)
    table_radius_m: float = Field(0.0, ge=0.0, le=2.0)
    wind_m_s: Annotated[tuple[_Metres, _Metres], Strict(False)] = (0.0, 0.0)


class SensorsSection(FileSection):
    """What measures, how well, and what the estimator believes of the heading."""

    kind: SensorsKind = "mocap"
    accelerometer_bias_g: _Vector = (0.0, 0.0, 0.0)
    gyroscope_bias_rad_s: _Vector = (0.0, 0.0, 0.0)
    camera_period_ms: int = Field(10, ge=1, le=1000)
    camera_delay_ms: int = Field(10, ge=0, le=200)
    camera_noise_m: float = Field(0.001, ge=0.0, le=1.0)
    camera_outliers: float = Field(0.0, ge=0.0, le=1.0)
    camera_outlier_m: float = Field(0.5, ge=0.0, le=10.0)
    flow_noise_counts: float = Field(2.0, ge=0.0, le=100.0)
    sweep_reflections: float = Field(0.0, ge=0.0, le=1.0)
    initial_yaw_deg: float = Field(0.0, ge=-180.0, le=180.0)


class SetPointsSection(FileSection):
    """How set-points come.

    period_ms:         between two full-state set-points; 0: a plan of the high-level commander flies.
    noise_m:           deviation of their positions; velocities are then differences of these positions.
    acceleration:      whether they have one.
    most_behind:       a packet comes up to so many packets late, at random.
    random:            so many set-points come first whose numbers are random.
    """

    period_ms: int = Field(10, ge=0, le=1000)
    noise_m: float = Field(0.0, ge=0.0, le=1.0)
    acceleration: bool = True
    most_behind: int = Field(0, ge=0, le=20)
    random: int = Field(0, ge=0, le=10_000)


class EventSection(FileSection):
    """Something that happens at a time of the flight; `do` says what, other keys how."""

    at_s: float = Field(ge=0.0, le=LONGEST_S)
    do: Literal[
        "sensors-off",
        "sensors-on",
        "switch",
        "jump",
        "nan",
        "kick",
        "hit",
        "push",
        "controller",
        "set",
        "radio-off",
        "radio-on",
        "go-to",
        "chase",
        "land",
    ]
    name: str = ""
    """Parameter of the app to set, such as "tilt"."""
    every_s: float = Field(0.0, ge=0.0, le=LONGEST_S)
    """It happens again and again, so far apart; 0: once."""
    value: float | Literal["nan"] = 0.0
    sensors: SensorsKind = "mocap"
    """What measures from now on."""
    vector: _Vector = (0.0, 0.0, 0.0)
    """Jump or place in m, kick in m/s, hit in rad/s, push in N."""
    frames: int = Field(1, ge=1, le=1000)
    duration_s: float = Field(2.0, gt=0.0, le=60.0)


class BoundSection(FileSection):
    """Least and most of a measure."""

    least: float | None = None
    most: float | None = None


class EventsFile(FileSection):
    """A flight on the desk: the drone takes off by a plan, hovers, then the course begins at time 0."""

    trajectory: CurveName | CourseFile = "hover"
    """A curve by name, or a file of waypoints or polynomial pieces, which begins where the drone is."""
    size_m: float = Field(1.0, ge=-100.0, le=100.0)
    rate_rad_s: float = Field(1.0, ge=-10.0, le=10.0)
    height_m: float = Field(1.0, ge=LEAST_HEIGHT_M, le=MOST_HEIGHT_M)
    duration_s: float = Field(20.0, ge=0.1, le=LONGEST_S)
    measured_from_s: float = Field(0.0, ge=0.0, le=LONGEST_S)
    drone: DroneSection = DroneSection()
    sensors: SensorsSection = SensorsSection()
    set_points: SetPointsSection = SetPointsSection()
    event: Annotated[tuple[EventSection, ...], Strict(False)] = ()
    bounds: dict[MeasureName, BoundSection] = Field(default_factory=dict)

    @field_validator("measured_from_s")
    @classmethod
    def _check_measured(cls, value: float, info: ValidationInfo) -> float:
        """Leave a part of the course to measure."""
        if value >= info.data.get("duration_s", LONGEST_S):
            raise PydanticCustomError("measured", "must be less than duration_s")
        return value

    def conditions(self, seed: int, offset_ms: int) -> DeskConditions:
        """Return the conditions of the flight, at an offset of the sensors' clock in ms."""
        drone, sensors = self.drone, self.sensors
        return DeskConditions(
            seed=seed,
            mass_kg=drone.mass_kg,
            rotor_lag_s=drone.rotor_lag_s,
            wind_m_s=drone.wind_m_s,
            thrust_gain=drone.thrust_gain,
            motor_gains=drone.motor_gains,
            sag_1_s=drone.sag_1_s,
            centre_m=drone.centre_m,
            heading_rad=math.radians(drone.heading_deg),
            table_m=drone.table_m,
            table_radius_m=drone.table_radius_m,
            gyroscope_bias_rad_s=sensors.gyroscope_bias_rad_s,
            accelerometer_bias_g=sensors.accelerometer_bias_g,
            sensors=SENSORS[sensors.kind],
            camera_period_ms=sensors.camera_period_ms,
            camera_delay_ms=sensors.camera_delay_ms,
            camera_offset_ms=offset_ms,
            camera_noise_m=sensors.camera_noise_m,
            camera_outliers=sensors.camera_outliers,
            camera_outlier_m=sensors.camera_outlier_m,
            flow_noise_counts=sensors.flow_noise_counts,
            sweep_reflections=sensors.sweep_reflections,
            initial_yaw_rad=math.radians(sensors.initial_yaw_deg),
        )


def load(name_or_path: str) -> EventsFile:
    """Return a shipped events file or one of the user.

    Raises SourceNotFoundError if there is neither, UnreadableFileError for a file that is not TOML,
    InvalidSettingsError with all errors.
    """
    path = EVENTS.own_file(name_or_path)
    if path is not None:
        return read_as(EventsFile, path)
    with as_file(EVENTS.file(name_or_path)) as shipped:
        return read_as(EventsFile, shipped)
