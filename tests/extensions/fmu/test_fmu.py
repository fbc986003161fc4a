"""Functional mock-up units: validated and compiled by FMPy, flown with the bits of the controller alone."""

import re
import shutil
import sys
import zipfile
from collections.abc import Callable, Sequence
from ctypes import CDLL
from dataclasses import fields, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.heading import slew_heading
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_extensions.fmu.fmu_variables import fmu_variables
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import Applied
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.trajectories import CURVES, Bernoulli
from tests.support.bundles import write_target
from tests.support.height_settings import height_settings
from tests.support.shell import shell
from tests.support.tools import require, require_module

VERSIONS: Final = ("2", "3")
STATUS, SATURATED = [100], [101]
MEASURED = ("x", "y", "vx", "vy", "roll", "pitch", "yaw", "height", "climb", "on_ground")
COMMANDED = ("roll_command", "pitch_command")
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror")
SUBJECTS = {
    "mambo": presets.preset("mambo"),
    "float64": with_option(presets.preset("mambo"), "code.scalar", "float64"),
    "1-norm": presets.preset("mambo-1norm"),
    "limits": with_option(presets.preset("mambo"), "limits.speed_m_s", 1.0),
    "height": height_settings(),
}
OTHERS = ("float64", "1-norm", "limits", "height")
"""Subjects whose flights are left to the long tests."""


@pytest.fixture(scope="module")
def unit_file(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Path]:
    """Return the unit of a subject in a version; both are built at the first call for the subject."""

    @cache
    def built(name: str) -> Path:
        require("cc", "gcc")
        require_module("fmpy")
        folder = tmp_path_factory.mktemp("units")
        write_target("fmu", SUBJECTS[name], folder)
        shell(sys.executable, folder / "build.py")
        return folder

    return lambda name, version: built(name) / f"nmpc_fmi{version}.fmu"


@pytest.fixture
def unpacked(unit_file: Callable[[str, str], Path], tmp_path: Path) -> Callable[[str, str], Path]:
    """Return a folder into which the unit of a subject in a version is unpacked."""

    def unpack(name: str, version: str) -> Path:
        folder = tmp_path / f"unit{version}"
        with zipfile.ZipFile(unit_file(name, version)) as archive:
            archive.extractall(folder)
        return folder

    return unpack


class Unit:
    """A unit in an unpacked folder, through FMPy, as a position controller of one flight."""

    def __init__(self, folder: Path, version: str, settings: Settings) -> None:
        self.settings, self._period_s, self._steps = settings, settings.horizon.update_period_s, 0
        self.reference = {variable.name: place for place, variable in enumerate(fmu_variables(settings))}
        described = import_module("fmpy").read_model_description(str(folder))
        slave = getattr(import_module(f"fmpy.fmi{version}"), f"FMU{version}Slave")
        self._unit: Any = slave(
            guid=described.guid or described.instantiationToken,
            unzipDirectory=str(folder),
            modelIdentifier=described.coSimulation.modelIdentifier,
            instanceName="controller",
        )
        kind = "Real" if version == "2" else "Float64"
        self.set, self.get = (getattr(self._unit, f"{verb}{kind}") for verb in ("set", "get"))
        self.get_status = getattr(self._unit, "getInteger" if version == "2" else "getInt32")
        self._unit.instantiate()
        if version == "2":
            self._unit.setupExperiment(startTime=0.0)
        self._unit.enterInitializationMode()
        self._unit.exitInitializationMode()

    def advance(self, duration_s: float) -> None:
        """Make a communication step."""
        self._unit.doStep(self._steps * self._period_s, duration_s)
        self._steps += round(duration_s / self._period_s)

    def reset(self) -> None:
        """Return to the start state."""
        self._unit.reset()

    @property
    def is_saturated(self) -> bool:
        """Whether a command is at the tilt limit."""
        return bool(self._unit.getBoolean(SATURATED)[0])

    def read(self, *names: str) -> list[float]:
        """Return the values of variables by name."""
        values: list[float] = self.get([self.reference[name] for name in names])
        return values

    def write(self, **values: float) -> None:
        """Set variables by name."""
        self.set([self.reference[name] for name in values], list(values.values()))

    def step(
        self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray | None = None
    ) -> Applied:
        """Set the inputs, make a step of an update period, and return the outputs."""
        places = dict(zip(MEASURED, state[0], strict=False))
        if thrust_acceleration_m_s2 is not None:
            places["thrust_acceleration"] = thrust_acceleration_m_s2[0]
        aimed = [number.told[0] for number in method_of(self.settings).port.numbers("target")]
        self.write(**places, **dict(zip(aimed, target[0], strict=False)))
        self.advance(self._period_s)
        status, command = np.array(self.get_status(STATUS)), np.array([self.read(*COMMANDED)])
        thrust = np.array(self.read("thrust_command")) if thrust_acceleration_m_s2 is None else None
        return Applied(command, status, thrust)

    def close(self) -> None:
        """Release the unit and its library."""
        self._unit.terminate()
        self._unit.freeInstance()


def flown(settings: Settings, controller: PositionController) -> list[Any]:
    """Fly a figure of eight, and return every array of the trace."""
    period_s = settings.horizon.update_period_s
    flight = Flight(Bernoulli(2.0, 0.5), duration_s=2.0, yaw_rad=0.4, update_period_s=period_s)
    if settings.height is not None:
        drone = Vehicle.from_preset("crazyflie")
        flight = replace(flight, trajectory=CURVES["swinging-eight"](2.0, 0.5), vehicle=drone)
    trace = fly(flight, controller)
    return [getattr(trace, column.name) for column in fields(trace)]


def same(left: Sequence[Any], right: Sequence[Any]) -> bool:
    """Whether all arrays are equal in every bit."""
    return all(a.tobytes() == b.tobytes() for a, b in zip(left, right, strict=True))


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", ["mambo", *(pytest.param(name, marks=pytest.mark.long) for name in OTHERS)])
def test_both_units_fly_with_the_bits_of_the_controller_alone(
    name: str, unit_file: Callable[[str, str], Path], unpacked: Callable[[str, str], Path]
) -> None:
    """FMPy finds no fault in a unit, and in a flight every bit of the trace is that of `fly`."""
    settings = SUBJECTS[name]
    validate = import_module("fmpy.validation").validate_fmu
    alone = flown(settings, CompiledController(settings))
    for version in VERSIONS:
        assert validate(str(unit_file(name, version))) == []
        unit = Unit(unpacked(name, version), version, settings)
        assert same(flown(settings, unit), alone)
        unit.close()


@pytest.mark.long
@pytest.mark.parametrize("version", VERSIONS)
def test_an_importer_compiles_the_sources(
    version: str, tmp_path: Path, unpacked: Callable[[str, str], Path]
) -> None:
    """FMPy builds them with CMake as the unit describes them, and what it built flies the same bits."""
    require("cmake", "cmake")
    settings, folder = SUBJECTS["mambo"], unpacked("mambo", version)
    shutil.rmtree(folder / "binaries")
    objects = tmp_path / "objects"
    objects.mkdir()
    import_module("fmpy.build").build_platform_binary(folder, objects)
    assert list((folder / "binaries").rglob("nmpc.*"))
    unit = Unit(folder, version, settings)
    assert same(flown(settings, unit), flown(settings, CompiledController(settings)))
    unit.close()


@pytest.mark.parametrize("version", VERSIONS)
def test_a_unit_answers_as_its_description_says(version: str, unpacked: Callable[[str, str], Path]) -> None:
    """Start values, reset, several periods in a step, bad inputs as a status, and refusals."""
    settings, folder = SUBJECTS["1-norm"], unpacked("1-norm", version)
    period_s = settings.horizon.update_period_s
    starts = [variable.start for variable in fmu_variables(settings)]
    one, other = Unit(folder, version, settings), Unit(folder, version, settings)
    assert one.get(range(len(starts))) == starts
    one.set([7], [3.0])
    other.set([7], [3.0])
    one.advance(5 * period_s)
    for _ in range(5):
        other.advance(period_s)
    assert one.get([12, 13]) == other.get([12, 13]) != [0.0, 0.0]
    assert one.is_saturated
    for unit, weight in ((one, 0.0), (other, starts[14])):
        unit.reset()
        unit.set([7, 14], [0.1, weight])
        unit.advance(period_s)
    assert one.get([12, 13]) == [0.0, 0.0], "without a weight no error counts"
    assert other.get([12, 13]) != [0.0, 0.0]
    one.set([0], [np.nan])
    one.advance(period_s)
    assert one.get_status(STATUS) == [2]
    one.reset()
    assert (one.get(range(len(starts))), one.get_status(STATUS)) == (starts, [0])
    for refused in (
        lambda: one.advance(1.5 * period_s),
        lambda: one.set([12], [0.1]),
        lambda: one.get([99]),
    ):
        with pytest.raises(Exception, match="failed with status 3"):
            refused()
    one.close()
    other.close()


@pytest.mark.parametrize("version", VERSIONS)
def test_the_heading_turns_from_the_measured_one(version: str, unpacked: Callable[[str, str], Path]) -> None:
    """By nmpc_slew_heading, from the first one in range on, at the rate of the parameter."""
    settings = SUBJECTS["mambo"]
    unit = Unit(unpacked("mambo", version), version, settings)
    period_s = settings.horizon.update_period_s
    for yaw in (np.nan, 2000.0):
        unit.write(yaw=yaw, target_yaw=1.0)
        unit.advance(period_s)
        assert unit.read("yaw_command") == [0.0]
    expected = np.array([3.0])
    unit.write(yaw=3.0, target_yaw=-3.0, heading_rate=2.0)
    for _ in range(20):
        unit.advance(period_s)
        expected = slew_heading(method_of(settings), expected, [-3.0], [2.0 * period_s])
        assert unit.read("yaw_command") == expected.tolist()
    unit.reset()
    unit.write(yaw=0.5)
    unit.advance(period_s)
    assert 0.4 < unit.read("yaw_command")[0] < 0.5
    unit.close()


@pytest.mark.parametrize("version", VERSIONS)
def test_the_delivered_thrust_is_reported_once_in_a_communication_step(
    version: str, unpacked: Callable[[str, str], Path]
) -> None:
    """As by nmpc_report_thrust before its first period; 0 is as commanded, out of range changes nothing."""
    settings = SUBJECTS["height"]
    unit = Unit(unpacked("height", version), version, settings)
    alone, untold = CompiledController(settings), CompiledController(settings)
    period_s = settings.horizon.update_period_s
    state, target = np.zeros((1, 10)), np.zeros((1, 13))
    assert unit.read("thrust_delivered") == [0.0]
    assert max(unit.reference.values()) == unit.reference["thrust_delivered"]
    unit.write(target_height=0.05)
    target[0, 6] = 0.05
    for thrust_m_s2, periods in ((0.0, 1), (12.0, 1), (12.0, 2), (1e6, 1), (0.0, 3)):
        unit.write(thrust_delivered=thrust_m_s2)
        unit.advance(periods * period_s)
        if thrust_m_s2:
            alone.report_thrust([thrust_m_s2])
        for _ in range(periods):
            commanded = alone.step(state, target).thrust_m_s2.tolist()
            otherwise = untold.step(state, target).thrust_m_s2.tolist()
        assert unit.read("thrust_command") == commanded
    assert commanded != otherwise
    unit.close()


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", [*SUBJECTS, "fixed", "fixed height"])
def test_the_sources_build_without_a_word_and_have_every_function(name: str, tmp_path: Path) -> None:
    """All warnings on and fatal; an importer finds each function of the standard's header in the library."""
    require_module("fmpy")
    compiler = require("gcc", "gcc")
    fixed = {
        "fixed": with_option(presets.preset("mambo"), "code.scalar", "fixed"),
        "fixed height": height_settings("fixed"),
    }
    settings = (SUBJECTS | fixed)[name]
    folder = write_target("fmu", settings, tmp_path)
    headers = Path(str(import_module("fmpy").__file__)).parent / "c-code"
    for version in VERSIONS:
        sources = [folder / "sources" / f"{stem}.c" for stem in ("nmpc", "nmpc_fmu", f"fmi{version}")]
        library = tmp_path / f"fmi{version}.so"
        shell(compiler, *STRICT, "-fPIC", "-shared", *sources, "-lm", "-o", library)
        unit = CDLL(str(library))
        header = headers / f"fmi{version}Functions.h"
        wanted = set(
            re.findall(rf"^#define (fmi{version}[A-Z]\w+) +fmi\dFullName", header.read_text("utf-8"), re.M)
        )
        assert len(wanted) > 30
        of_model_exchange = {
            *("fmi2EnterEventMode", "fmi2NewDiscreteStates", "fmi2EnterContinuousTimeMode", "fmi2SetTime"),
            *("fmi2CompletedIntegratorStep", "fmi2SetContinuousStates", "fmi2GetDerivatives"),
            *("fmi2GetEventIndicators", "fmi2GetContinuousStates", "fmi2GetNominalsOfContinuousStates"),
        }
        assert not {function for function in wanted - of_model_exchange if not hasattr(unit, function)}
