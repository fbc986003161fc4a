"""The command `diff`: two controllers in control terms."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.settings.controller_toml import to_toml, with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.presets import preset
from mambo_sil.drone.vehicles.vehicle_toml import preset as vehicle
from mambo_sil.experiment.compare.compared_flights import answers
from mambo_sil.experiment.compare.control_terms import axis_laws, observer_gains
from tests.support.command import run

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

MAMBO = preset("mambo")
SLOWER = with_option(MAMBO, "cost.response_time_s", 0.4)


def compared(*arguments: str) -> dict[str, Any]:
    """Compare controllers that differ; return the summary."""
    summary: dict[str, Any] = json.loads(run("diff", *arguments, "--json", code=1)[0])
    return summary


@pytest.mark.long
def test_a_slower_controller_is_told_in_control_terms() -> None:
    """One setting differs: gains and poles fall, the step settles later, the observer stays."""
    Path("slower").mkdir()
    Path("slower/controller.toml").write_text(to_toml(SLOWER), "utf-8")
    said, _ = run("diff", "mambo", "slower", "-o", "out", code=1)
    assert "cost.response_time_s" in said
    assert "Time in which the drone answers an error" in said
    assert {path.name for path in Path("out").iterdir()} == {"step.png", "step.svg", "summary.json"}
    summary = json.loads(Path("out/summary.json").read_text("utf-8"))
    (one,) = summary["differences"]
    assert (one["key"], one["a"], one["b"]) == ("cost.response_time_s", 0.215, 0.4)
    a, b = summary["figures_a"], summary["figures_b"]
    for axis in (0, 1):
        fast, slow = a["law"][axis], b["law"][axis]
        assert fast["position_gain_rad_m"] > 2.0 * slow["position_gain_rad_m"] > 0.0
        assert fast["dominant_rad_s"] > slow["dominant_rad_s"]
        assert a["step"][axis]["settling_s"] < b["step"][axis]["settling_s"]
        quick, late = a["margins"][axis]["command"], b["margins"][axis]["command"]
        assert quick["delay_s"] < late["delay_s"]
    assert "roll: delay margin at the motors" in said
    assert a["observer"] == b["observer"]
    assert a["instance_bytes"] == b["instance_bytes"] == 236


def test_the_same_controller_does_not_fly() -> None:
    """Exit 0, also for a copy of the file."""
    Path("copy.toml").write_text(to_toml(MAMBO), "utf-8")
    said, _ = run("diff", "mambo", "copy.toml", "-o", "out")
    assert said == f"mambo and copy.toml are the same controller: settings {MAMBO.short_digest}\n"
    assert json.loads(Path("out/summary.json").read_text("utf-8"))["figures_a"] is None


@pytest.mark.long
def test_the_eight_is_that_of_fly_on_the_vehicle() -> None:
    """The same metrics; a 1-norm has them too, but no gains, and a setting that one does not use is null."""
    summary = compared("mambo-1norm", "crazyflie", "--vehicle", "crazyflie")
    run("fly", "crazyflie", "--vehicle", "crazyflie", "--no-pictures")
    flown = json.loads(Path("flight/summary.json").read_text("utf-8"))["metrics"]
    eight = summary["figures_b"]["eight"]
    assert {name: eight[name] for name in eight if name != "crashed"} == {
        name: flown[name] for name in eight if name != "crashed"
    }
    assert summary["figures_a"]["law"] is summary["figures_a"]["observer"] is None
    values = {one["key"]: (one["a"], one["b"]) for one in summary["differences"]}
    assert values["cost.effort_weight"] == (1.0, None)
    assert values["controller.method"] == ("1-norm", "quadratic")


@pytest.mark.parametrize("settings", [MAMBO, SLOWER, preset("crazyflie")])
def test_gains_are_those_of_the_controller(settings: Settings) -> None:
    """A small position error alone, in the first step, gives the command of the gain and the observer."""
    settings = with_option(settings, "code.scalar", "float64")
    laws = axis_laws(settings)
    assert laws is not None
    error_m = 1e-3
    for axis, sign in ((0, -1.0), (1, 1.0)):
        state = np.zeros((1, 7))
        state[0, 1 - axis] = error_m
        controller = method_of(settings).reference_controller(1)
        command = controller.step(state, np.zeros((1, len(method_of(settings).target))), np.array([9.81]))
        gain = laws[axis].position_gain_rad_m
        assert command.command_rad[0, axis] == pytest.approx(sign * gain * error_m, rel=1e-6)


def test_poles_are_those_that_damp_the_loop() -> None:
    """The slowest is the spectral radius; all are damped, and the dominant one is among them."""
    laws, radius = axis_laws(MAMBO), Quadratic(MAMBO).law.spectral_radius
    assert laws is not None
    for law, largest in zip(laws, radius, strict=True):
        decays = [frequency * damping for frequency, damping in law.poles]
        assert np.exp(-min(decays) * MAMBO.horizon.update_period_s) == pytest.approx(largest, rel=1e-9)
        assert (law.dominant_rad_s, law.dominant_damping) in law.poles


def test_a_pole_that_nothing_reads_is_left_out() -> None:
    """Without integral part and dead time four states are left."""
    settings = MAMBO
    for key in ("roll_integral_1_s", "roll_delay_s"):
        settings = with_option(settings, f"model.{key}", 0.0)
    laws = axis_laws(settings)
    assert laws is not None
    assert [len(law.poles) for law in laws] == [4, 6]


def test_observer_gains_are_in_si_units() -> None:
    """They do not change with the update period but for its corrections per step."""
    short, long = (
        observer_gains(with_option(MAMBO, "horizon.update_period_s", period_s)) for period_s in (0.005, 0.01)
    )
    assert short is not None
    assert long is not None
    for name in ("position", "velocity_1_s", "disturbance_1_s2"):
        assert np.array(getattr(long, name)) == pytest.approx(2.0 * np.array(getattr(short, name)), rel=0.1)


def test_a_step_that_never_settles_has_no_time() -> None:
    """With a tilt limit of 0.01 rad the drone is still under way after 10 s."""
    flown = answers(with_option(preset("table1"), "limits.tilt_rad", 0.01), vehicle("mambo"))
    assert flown.step[1].settling_s is None
    assert flown.step[1].iae_m_s > 1.0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["mambo", "mamboo"], "mamboo is neither a preset nor a file (did you mean mambo?)"),
        (["mambo", "crazyflie", "--vehicle", "moon"], "moon is neither a shipped vehicle nor a file"),
    ],
)
def test_what_is_not_there_is_refused(arguments: list[str], said: str) -> None:
    """Exit 2, unlike a difference."""
    assert run("diff", *arguments, code=2)[1].startswith(said)
