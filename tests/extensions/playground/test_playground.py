"""The command `playground`: what it takes, what it refuses, and that its page stands alone."""

import json
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.errors import BuildError
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.presets import preset
from mambo_extensions.playground.bit_proof import calm, proof_flight
from mambo_extensions.playground.dials import dials, target_dials, weight_dial
from mambo_extensions.playground.page_controllers import DEFAULTS, page_controllers
from mambo_extensions.playground.wasm_build import module, program
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.columns import LEVEL, TARGET
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.engine_library import SOURCES
from mambo_sil.flight.engine.records import flight_records
from tests.support import command
from tests.support.one_norm import ONE_NORM
from tests.support.tools import only, require, toolchain

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

SLOW = "[horizon]\nupdate_period_s = 0.02\n"
MAMBO, CRAZYFLIE = vehicle_toml.preset("mambo"), vehicle_toml.preset("crazyflie")
PDS = page_controllers(["pd"])


def run(*arguments: str, code: int = 0) -> tuple[str, str]:
    """Run the command, demand its exit code, and return stdout and stderr."""
    return command.run("playground", *arguments, code=code)


def demand_tools() -> None:
    """Skip without clang and wasm-ld."""
    require("clang", "clang")
    require("wasm-ld", "lld")


def test_the_page_holds_everything_and_says_what_it_flies() -> None:
    """One file without an address in it; the summary names every controller."""
    demand_tools()
    out, _ = run("pd", "mambo", "--json")
    summary = json.loads(out)
    page = Path("play.html").read_text("utf-8")
    assert summary["page"] == "play.html"
    assert summary["bytes"] == len(page.encode())
    assert [one["source"] for one in summary["controllers"]] == ["pd", "mambo"]
    assert [one["settings"] for one in summary["controllers"]] == [None, preset("mambo").digest]
    assert all(one["trace_sha256"] in page for one in summary["controllers"])
    for outside in ("http:", "https:", "src=", "@import", "url("):
        assert outside not in page, outside


def test_the_height_of_the_proof_swings_where_a_controller_commands_the_thrust() -> None:
    """For all controllers of a page, some of which follow it by a tuned loop; else the flight is level."""
    level = proof_flight(MAMBO, PDS)
    assert (level.given_targets.shape[2], level.altitude.name) == (LEVEL.target, "stock")
    command.run("design", "crazyflie", "-o", "height.toml")
    spatial = proof_flight(CRAZYFLIE, page_controllers(["pd", "height.toml"]))
    assert np.ptp(spatial.given_targets[:, 0, TARGET["height_m"]]) == pytest.approx(0.6, abs=1e-3)
    assert spatial.altitude.name == "pid"
    assert next(one for one in target_dials(spatial=True) if one.key == "swing").start == 0


def test_the_same_command_writes_the_same_page() -> None:
    """No clock, host or path is in it."""
    demand_tools()
    run("pd", "-o", "a/one.html")
    run("pd", "-o", "b/two.html")
    assert Path("a/one.html").read_bytes() == Path("b/two.html").read_bytes()


def test_a_page_is_written_over_and_nothing_else_is() -> None:
    """An earlier page is; a file of the user's is refused before anything is compiled."""
    demand_tools()
    run("pd")
    run("pd")
    Path("mine.html").write_text("<p>notes", "utf-8")
    assert "mine.html: exists and is no page of mambo-nmpc" in run("pd", "-o", "mine.html", code=2)[1]
    assert Path("mine.html").read_text("utf-8") == "<p>notes"
    assert ".: is a folder, not a file; name one with -o" in run("pd", "-o", ".", code=2)[1]


@pytest.mark.parametrize(
    ("sources", "message"),
    [
        (["pd", "pd"], "pd is named twice; name each controller once"),
        (["a", "b", "c", "d", "e"], "there are 5 controllers; name at most 4"),
        (["mamba"], "did you mean mambo?"),
        (["mambo", "slow.toml"], "slow.toml: horizon.update_period_s = 0.02 must be that of mambo, 0.01"),
    ],
)
def test_what_cannot_fly_together_is_refused(sources: list[str], message: str) -> None:
    """With the rule, and what to do."""
    Path("slow.toml").write_text(SLOW, "utf-8")
    assert message in run(*sources, code=2)[1]
    assert not Path("play.html").exists()


def test_what_is_no_plan_is_refused() -> None:
    """Points that are not planned yet, with what the file must have."""
    Path("points.csv").write_text("x,y,z\n0,0,1\n", "utf-8")
    assert "points.csv: line 1: column duration is missing" in run("pd", "--plan", "points.csv", code=2)[1]
    assert not Path("play.html").exists()


@pytest.mark.parametrize(
    ("there", "message"),
    [
        ((), "clang not found.*Debian: clang"),
        (("clang",), "wasm-ld not found.*Debian: lld"),
    ],
)
def test_a_missing_tool_is_named(
    there: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the package that has it."""
    demand_tools()
    monkeypatch.setenv("PATH", only(tmp_path, *there) if there else str(tmp_path))
    with pytest.raises(BuildError, match=message):
        module(page_controllers(["pd"])[0])


@pytest.mark.long
def test_the_c_of_the_page_compiles_without_a_warning(tmp_path: Path) -> None:
    """Without a C library, for WebAssembly."""
    files, _, step = program(page_controllers(["pd"])[0])
    for name, text in files.items():
        (tmp_path / name).write_text(text, "utf-8")
    warnings = ["-pedantic", "-Wall", "-Wextra", "-Wshadow", "-Wundef", "-Wmissing-prototypes", "-Werror"]
    flags = ["--target=wasm32", "-ffreestanding", "-std=c99", "-O2", "-I.", f"-DCONTROLLER={step}"]
    engine = [name for name in files if name in SOURCES]
    toolchain("clang").run([*flags, *warnings, "-c", "playground.c", *engine], tmp_path)


def test_a_slider_writes_what_a_flight_with_its_value_has() -> None:
    """Each position of the slider of the motor lag, and the one where it starts."""
    flight = calm(proof_flight(MAMBO, PDS))
    by_key = {dial.key: dial for dial in dials(flight)}
    own = flight_records(flight, np.zeros((1, 4)))[0]
    for dial in by_key.values():
        for member, rows in dial.members.items():
            assert len(rows) == len(dial.values)
            if member != "gust_heading":
                assert rows[dial.start] == np.ravel(own[member]).tolist(), member
    assert by_key["lag"].values[by_key["lag"].start] == 0.0
    lagging = {dial.key: dial for dial in dials(calm(proof_flight(CRAZYFLIE, PDS)))}["lag"]
    assert lagging.values[lagging.start] == 1000.0 * CRAZYFLIE.motor_lag_s


def test_the_slider_of_the_weight_starts_at_the_settings() -> None:
    """With the tracking weight unchanged at every position."""
    dial = weight_dial(ONE_NORM, "mine", 2)
    assert dial.values[dial.start] == ONE_NORM.cost.effort_weight
    assert dial.drone == 2
    assert {row[0] for row in dial.members["weights"]} == {ONE_NORM.cost.tracking_weight}
    assert [row[1] for row in dial.members["weights"]] == pytest.approx(dial.values)


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_the_controller_takes_every_weight_of_the_slider(scalar: str) -> None:
    """None is refused, in any scalar type."""
    settings = with_option(ONE_NORM, "code.scalar", scalar, "test")
    dial = weight_dial(settings, "mine", 0)
    controller, tracking = CompiledController(settings), settings.cost.tracking_weight
    assert [controller.set_weights([[tracking, value]])[0] for value in dial.values] == [0] * len(dial.values)


def test_a_file_is_called_by_its_own_name_as_text(tmp_path: Path) -> None:
    """It may be called anything; the page does not tell where it was."""
    demand_tools()
    Path("folder").mkdir()
    Path("folder", "<img src=x>.toml").write_text("[horizon]\ncontrol = 2\n", "utf-8")
    run(str(tmp_path / "folder" / "<img src=x>.toml"))
    page = Path("play.html").read_text("utf-8")
    assert "<img" not in page
    assert "&lt;img src=x&gt;.toml" in page
    assert "folder/" not in page


def test_every_default_is_a_source() -> None:
    """In the order of the page."""
    assert [one.title for one in page_controllers(DEFAULTS)] == [
        "mambo",
        "mambo-1norm",
        "PD-feedforward",
        "PD",
    ]
