"""The playground in a real browser: the bits of the engine, of its curves and of other drones."""

import json
import re
from base64 import b64decode, b64encode
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen.port.taken import AHEAD_S
from mambo_extensions.playground.page_controllers import page_controllers
from mambo_sil.drone.plant import elementary
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.altitude_loops import AltitudeLaw
from mambo_sil.flight.columns import LEVEL
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M, Swing
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Bernoulli, Circle, InSpace
from tests.support import command
from tests.support.browser import DESK_PX, MAMBO, ONE_NORM, PD, Browser, Page
from tests.support.laps import write_lap
from tests.support.tools import require

pytestmark = pytest.mark.long


def test_the_browser_flies_the_bits_of_the_native_engine(made: tuple[Path, Any], page: Page) -> None:
    """The digest of each flight in the browser is that which the command printed."""
    here = page.find('proveAll(JSON.parse(document.getElementById("data").textContent))')
    assert here == [one["trace_sha256"] for one in made[1]["controllers"]]
    assert "The same bits" in page.text("#proof")


@pytest.mark.parametrize(
    "arguments",
    [
        ("height.toml", "crazyflie", "pd", "--vehicle", "crazyflie"),
        ("fixed.toml", "double.toml", "one-norm.toml", "--vehicle", "mambo"),
    ],
)
def test_other_drones_and_scalar_types_have_the_same_bits(
    arguments: tuple[str, ...], tab: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another attitude loop, a controller of the height, fixed point and float64; each also flies.

    The ceiling of the settings, 2.5 m, holds when the fence is drawn and when it is removed.
    """
    require("wasm-ld", "lld")
    monkeypatch.chdir(tmp_path)
    for name, preset, scalar in (
        ("fixed", "mambo", "fixed"),
        ("double", "mambo", "float64"),
        ("one-norm", "mambo-1norm", "fixed"),
    ):
        command.run("init", preset, "-o", f"{name}.toml")
        text = Path(f"{name}.toml").read_text("utf-8")
        changed = re.sub(r'^scalar = "\w+"', f'scalar = "{scalar}"', text, flags=re.MULTILINE)
        assert changed != text
        Path(f"{name}.toml").write_text(changed, "utf-8")
    command.run("design", "crazyflie", "-o", "height.toml")
    text = Path("height.toml").read_text("utf-8")
    walls = "[limits]\nfence = { floor_m = 0.4, ceiling_m = 2.5 }"
    Path("height.toml").write_text(text.replace("[limits]", walls), "utf-8")
    command.run("playground", *arguments, "-o", "other.html")
    other = Page(tab, tmp_path / "other.html")
    assert "The same bits" in other.text("#proof")
    other.advance(8.0)
    assert other.error_m(0) < 0.15
    other.find("page.world.target.drag(0, 0)")
    other.find(
        "(page.world.begin(), page.world.enclose([-0.5, -0.5, 0.5, 0.5]), page.world.target.drag(1.2, 0))"
    )
    other.advance(5.0)
    assert float(other.find("page.world.drones[0].position[0]")) == pytest.approx(0.5, abs=0.02)
    follow_heights(other)
    assert tab.complaints == []


def test_what_flies_on_the_page_has_the_bits_of_a_simulated_flight(
    tab: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Update by update and with a height that swings, not only in the flight that proves the bits.

    The PD holds its height by the loop of `fly --altitude-loop pid`; the table has plane and height apart.
    """
    require("wasm-ld", "lld")
    monkeypatch.chdir(tmp_path)
    command.run("design", "crazyflie", "-o", "height.toml")
    command.run("playground", "height.toml", "pd", "--vehicle", "crazyflie")
    page = Page(tab, tmp_path / "play.html", DESK_PX, "#swing=0.3")
    flight = Flight(
        InSpace(Bernoulli(2.0, 0.5), Swing(0.3, 1.5)),
        duration_s=4.0,
        vehicle=Vehicle.of(vehicle_toml.preset("crazyflie")),
        altitude=AltitudeLaw("pid"),
    )
    page.advance(4.01)
    target = np.array(page.find("page.world.history.at(-1).slice(1, 4)"))
    for index, one in enumerate(page_controllers(["height.toml", "pd"])):
        expected = fly(flight, one.controller(flight)).position_m[-1, 0].tolist()
        assert page.find(f"[...page.world.drones[{index}].position]") == expected
        off_cm = 100.0 * np.abs(target * [1.0, 1.0, -1.0] - expected)
        row = f".standing tbody tr:nth-child({index + 1})"
        shown = [float(page.text(f"{row} {cell}").removesuffix(" cm")) for cell in (".error", ".height")]
        assert shown == pytest.approx([np.hypot(*off_cm[:2]), off_cm[2]], abs=0.51)


def follow_heights(page: Page) -> None:
    """Demand that a step of the height is followed, and a swing, if a controller commands the thrust."""
    if not page.find("page.world.data.spatial"):
        assert page.find('document.getElementById("heights")') is None
        return
    page.find("(page.world.enclose(null), page.world.target.drag(0, 0))")
    page.slide("height", 12)
    page.slide("swing", 3)
    assert not page.find('document.getElementById("heights").parentElement.hidden')
    page.advance(6.0)
    heights = page.find("page.world.history.slice(-400).map((row) => row[3])")
    assert (min(heights), max(heights)) == (pytest.approx(1.7, abs=1e-3), pytest.approx(2.3, abs=1e-3))
    swung = page.find("page.world.history.slice(-400).map((row) => row[3] - stateOf(row, 0)[2])")
    held = page.find("page.world.history.slice(-400).map((row) => row[3] - stateOf(row, 1)[2])")
    assert np.abs(swung).max() < 0.02
    assert np.abs(held).max() < 0.1
    assert "height=2" in page.find("location.hash")
    page.slide("swing", 0)
    assert page.find('document.getElementById("heights").parentElement.hidden')
    page.slide("height", 22)
    page.advance(6.0)
    assert page.find("stateOf(page.world.history.at(-1), 0)[2]") == pytest.approx(2.5, abs=0.02)


@pytest.mark.parametrize(("drone", "place"), [(MAMBO, "constant"), (PD, "constant"), (ONE_NORM, "header")])
def test_a_flipped_byte_is_not_the_same_bits(
    made: tuple[Path, Any], tab: Browser, tmp_path: Path, drone: int, place: str
) -> None:
    """The ninth digit of a coefficient of the sine, or a module that does not load."""
    text = made[0].read_text("utf-8")
    data = json.loads(text.partition('id="data">')[2].partition("</script>")[0])
    wasm = b64decode(data["drones"][drone]["wasm"])
    sine = np.float64(elementary.SINE[0]).tobytes()
    changed = sine if place == "constant" else wasm[:8]
    flipped = wasm.replace(changed, changed[:3] + bytes([changed[3] ^ 1]) + changed[4:])
    (tmp_path / "flipped.html").write_text(
        text.replace(b64encode(wasm).decode(), b64encode(flipped).decode()), "utf-8"
    )
    tab.open(tmp_path / "flipped.html", DESK_PX)
    tab.find("playground.catch(() => null).then(() => null)")
    assert "Not the same bits" in str(tab.find('document.getElementById("proof").textContent'))
    marks = tab.find('[...document.querySelectorAll(".here")].map((cell) => cell.textContent[0])')
    assert marks == ["✗" if index == drone else "✓" for index in range(4)]


def test_a_curve_is_hastened_from_where_the_target_is(page: Page) -> None:
    """Slider and fragment; with twice the rate it moves twice as fast, through the same places."""
    page.advance(3.0)
    before = page.find("[...page.world.target.now]")
    page.slide("speed", 6)
    page.find("page.world.target.at(page.world.target.lead && page.world.time - page.world.data.period_s)")
    after = page.find("[...page.world.target.now]")
    period_s = page.find("page.world.data.period_s")
    moved = np.array(after[:2]) - before[:2]
    assert np.abs(moved).max() <= 2 * period_s * np.hypot(*before[2:4]) + 1e-9
    assert np.hypot(*after[2:4]) == pytest.approx(2 * np.hypot(*before[2:4]), rel=0.02)
    assert "speed=2" in page.find("location.hash")
    page.find("page.world.begin()")
    curve = Bernoulli(2.0, 1.0)
    assert page.find("[...page.world.target.at(1.0).slice(0, 4)]") == curve.target([1.0])[0].tolist()


def test_the_curves_are_those_of_the_simulation(page: Page) -> None:
    """Eight, circle and swing have the bits of the simulation's: velocity, acceleration, the one ahead."""
    times = [0.0, 0.01, 1.0, 3.14, 12.5, 1000.01]
    later = [time_s + AHEAD_S for time_s in times]

    def swing(size_m: float) -> Any:
        heights = Swing(size_m, 1.5)
        return np.concatenate([heights.vertical(times), heights.vertical(later)[:, 2:]], axis=-1)

    for kind, curve in (("eight", Bernoulli(2.0, 0.5)), ("circle", Circle(1.2, 0.8))):
        page.find(f'page.world.target.kind = "{kind}"')
        found = page.find(f"{times}.map((time) => [...page.world.target.at(time)])")
        level = [
            curve.target(times),
            curve.acceleration(times),
            curve.acceleration(later),
            np.full((6, 1), 2),
        ]
        assert found == np.concatenate([*level, swing(0.0)], axis=-1).tolist()
    page.find("page.world.target.swing = 0.3")
    heights = page.find(f"{times}.map((time) => [...page.world.target.at(time).slice({LEVEL.target})])")
    assert heights == swing(0.3).tolist()


@pytest.mark.parametrize("sources", [("height.toml",), ("mambo", "pd")])
def test_the_target_flies_a_plan(
    sources: tuple[str, ...], tab: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the bits of the pieces, and the acceleration ahead; one that ends as it begins starts again.

    In the plane alone where no controller commands the thrust.
    """
    require("wasm-ld", "lld")
    monkeypatch.chdir(tmp_path)
    if "height.toml" in sources:
        command.run("design", "crazyflie", "-o", "height.toml")
    lap, times = write_lap(tmp_path / "lap.csv"), [0.0, 0.01, 1.0, 1.5, 2.2, 2.99, 3.0, 40.0]
    command.run("playground", *sources, "--vehicle", "crazyflie", "--plan", "lap.csv")
    page = Page(tab, tmp_path / "play.html")
    assert tab.find('document.getElementById("target").value') == "plan"
    assert tab.find("location.hash") == ""
    later = [time_s + AHEAD_S for time_s in times]
    level = [lap.target(times), lap.acceleration(times), lap.acceleration(later), np.full((8, 1), 2)]
    heights = [lap.vertical(times), lap.vertical(later)[:, 2:]]
    if "height.toml" not in sources:
        heights = [np.broadcast_to([HOVER_HEIGHT_M, 0.0, 0.0, 0.0], (8, 4))]
    now = "(time) => [...page.world.target.at(time)]"
    assert page.find(f"{times}.map({now})") == np.concatenate([*level, *heights], axis=-1).tolist()
    page.find("page.world.begin()")
    page.advance(4.0)
    assert page.error_m(0) < 0.05
    assert page.target() == pytest.approx(lap.target(4.0)[:2].tolist())
    assert not page.find("page.world.data.plan.repeats")
    page.find("page.world.data.plan.repeats = true")
    assert page.find(f"({now})({lap.duration_s} + 1)") == pytest.approx(page.find(f"({now})(1)"))
    assert tab.complaints == []
