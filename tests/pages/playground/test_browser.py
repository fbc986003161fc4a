"""The playground in a real browser: the same bits, a target that is followed, and controls for all."""

import json
import re
from base64 import b64decode, b64encode
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_sil.drone.plant import elementary
from mambo_sil.drone.plant.gusts import mean_speed_m_s
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.height_profiles import Swing
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Bernoulli, Circle, InSpace
from mambo_sil.pages.playground.page_controllers import page_controllers
from tests.support import command
from tests.support.browser import Browser, browser
from tests.support.tools import require, require_module

PHONE_PX, DESK_PX = 390, 1280
SPACE, ARROW_RIGHT = 32, 39
MAMBO, ONE_NORM, FEEDFORWARD, PD = range(4)
"""The drones of the page, in its order."""
BLUE = [0, 0x67, 0xA3, 255]
"""The colour of the first one on a light page."""

PIXELS = (
    "((canvas, ...box) => { const copy = new OffscreenCanvas(canvas.width, canvas.height)"
    ".getContext('2d', { willReadFrequently: true }); copy.drawImage(canvas, 0, 0);"
    " return [...copy.getImageData(...box).data]; })"
)
"""Pixels of a canvas in a box: left, top, width and height."""
AXES = f"page.player.views.slice(1).map(({{ canvas }}) => {PIXELS}(canvas, 0, 0, 36, canvas.height)).join()"
"""Those of the vertical axes of all plots."""

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """Return the default page and its summary."""
    require("clang", "clang")
    require("wasm-ld", "lld")
    page = tmp_path_factory.mktemp("playground") / "play.html"
    return page, json.loads(command.run("playground", "-o", str(page), "--json")[0])


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Return a tab of a browser for all tests of this file."""
    with browser(tmp_path_factory.mktemp("profile")) as one:
        yield one


class Page:
    """The playground in a tab, which stands still until it is advanced."""

    def __init__(self, tab: Browser, page: Path, width_px: int = DESK_PX, fragment: str = "") -> None:
        self._tab = tab
        tab.open(page, width_px, fragment, prefers_reduced_motion="reduce")
        self.find("true")

    def find(self, expression: str) -> Any:
        """Return the value of an expression of `page`, what the page's script offers, when it is ready."""
        return self._tab.find(f"playground.then(async (page) => ({expression}))")

    def advance(self, seconds: float) -> None:
        """Fly on."""
        self.find(f"page.advance({seconds})")

    def error_m(self, drone: int) -> float:
        """Return the distance of a drone to the target now."""
        return float(self.find(f"page.world.error(page.world.history.at(-1), {drone})"))

    def target(self) -> list[float]:
        """Return the position of the target now."""
        return list(self.find("[...page.world.target.now.slice(0, 2)]"))

    def pixels(self, x: float, y: float) -> tuple[float, float]:
        """Return the place of a point of the field in the window."""
        place = "const box = page.player.views[0].canvas.getBoundingClientRect()"
        found = self._tab.find(
            f"playground.then((page) => {{ {place}; const [x, y] = page.player.views[0].pixels({x}, {y});"
            " return [box.x + x, box.y + y]; })"
        )
        return found[0], found[1]

    def slide(self, key: str, place: int) -> None:
        """Move a slider."""
        self._tab.find(
            f'{{ const slider = document.getElementById("{key}"); slider.value = {place};'
            ' slider.dispatchEvent(new Event("input")); }'
        )

    def text(self, selector: str) -> str:
        """Return the text of an element."""
        return str(self._tab.find(f'document.querySelector("{selector}").textContent'))


@pytest.fixture
def page(made: tuple[Path, Any], tab: Browser) -> Page:
    """Return the page at a desk, at its start."""
    return Page(tab, made[0])


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
    """Update by update and with a height that swings, not only in the flight that proves the bits."""
    require("wasm-ld", "lld")
    monkeypatch.chdir(tmp_path)
    command.run("design", "crazyflie", "-o", "height.toml")
    command.run("playground", "height.toml", "pd", "--vehicle", "crazyflie")
    page = Page(tab, tmp_path / "play.html", DESK_PX, "#swing=0.3")
    vehicle = Vehicle.of(vehicle_toml.preset("crazyflie"))
    flight = Flight(InSpace(Bernoulli(2.0, 0.5), Swing(0.3, 1.5)), duration_s=4.0, vehicle=vehicle)
    page.advance(4.01)
    for index, one in enumerate(page_controllers(["height.toml", "pd"])):
        expected = fly(flight, one.controller(flight)).position_m[-1, 0].tolist()
        assert page.find(f"[...page.world.drones[{index}].position]") == expected


def follow_heights(page: Page) -> None:
    """Demand that a step of the height is followed, and a swing, if a controller commands the thrust."""
    if not page.find("page.world.data.spatial"):
        assert page.find('document.getElementById("heights")') is None
        return
    page.find("(page.world.enclose(null), page.world.target.drag(0, 0))")
    page.slide("height", 12)
    page.slide("swing", 3)
    page.advance(6.0)
    heights = page.find("page.world.history.slice(-400).map((row) => row[3])")
    assert (min(heights), max(heights)) == (pytest.approx(1.7, abs=1e-3), pytest.approx(2.3, abs=1e-3))
    swung = page.find("page.world.history.slice(-400).map((row) => row[3] - stateOf(row, 0)[2])")
    stock = page.find("page.world.history.slice(-400).map((row) => row[3] - stateOf(row, 1)[2])")
    assert np.abs(swung).max() < 0.02
    assert np.abs(stock).max() > 0.1
    assert "height=2&swing=0.3" in page.find("location.hash")
    page.slide("swing", 0)
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


def test_the_curves_are_those_of_the_simulation(page: Page) -> None:
    """Eight, circle and swing have the bits of the simulation's, velocity and acceleration included."""
    times = [0.0, 0.01, 1.0, 3.14, 12.5, 1000.01]
    for kind, curve in (("eight", Bernoulli(2.0, 0.5)), ("circle", Circle(1.2, 0.8))):
        page.find(f'page.world.target.kind = "{kind}"')
        found = page.find(f"{times}.map((time) => [...page.world.target.at(time)])")
        swing = Swing(0.0, 1.5).vertical(times)
        expected = np.concatenate([curve.target(times), curve.acceleration(times), swing], axis=-1)
        assert found == expected.tolist()
    page.find("page.world.target.swing = 0.3")
    heights = page.find(f"{times}.map((time) => [...page.world.target.at(time).slice(6)])")
    assert heights == Swing(0.3, 1.5).vertical(times).tolist()


@pytest.mark.parametrize("width_px", [PHONE_PX, DESK_PX])
def test_a_dragged_target_is_followed(made: tuple[Path, Any], tab: Browser, width_px: int) -> None:
    """The target glides to where mouse or finger left it; each NMPC gets there with it, and stays."""
    page = Page(tab, made[0], width_px)
    move = tab.swipe if width_px == PHONE_PX else tab.drag
    move(page.pixels(0.0, 0.9), page.pixels(1.5, -0.8))
    assert page.find("page.world.target.goal") == pytest.approx([1.5, -0.8], abs=0.02)
    errors = []
    for _ in range(8):
        page.advance(1.0)
        errors.append(page.error_m(MAMBO))
    assert page.target() == pytest.approx([1.5, -0.8], abs=0.02)
    assert max(errors) < 0.15
    assert errors[-1] < 0.02
    assert page.error_m(FEEDFORWARD) < 0.1
    assert tab.find('document.getElementById("target").value') == "hand"


def test_a_target_30_m_away_is_reached_at_the_speed_limit(page: Page, tab: Browser) -> None:
    """It steps there; the view follows, and the page says the speed and what limits it."""
    tab.find('document.getElementById("away").click()')
    assert page.target() == [30.0, 0.0]
    page.advance(3.0)
    assert page.text("#limits").startswith("mambo 5.0 m/s, limit: speed; without limits: mambo-1norm,")
    width, height = page.find(
        "[page.player.views[0].canvas.clientWidth, page.player.views[0].canvas.clientHeight].join()"
    ).split(",")
    for point in ("30, 0", f"...page.world.drones[{MAMBO}].position.slice(0, 2)"):
        x, y = page.find(f"page.player.views[0].pixels({point}).join()").split(",")
        assert 0.0 < float(x) < float(width)
        assert 0.0 < float(y) < float(height)
    speed = f"(page.world.advance(1), Math.hypot(...page.world.drones[{MAMBO}].velocity.slice(0, 2)))"
    speeds = page.find(f"Array.from({{ length: 900 }}, () => {speed})")
    assert 4.9 < max(speeds) < 5.3
    assert page.error_m(MAMBO) < 0.05
    assert tab.complaints == []


@pytest.mark.parametrize("width_px", [PHONE_PX, DESK_PX])
def test_a_pointer_at_the_edge_takes_the_target_far(
    made: tuple[Path, Any], tab: Browser, width_px: int
) -> None:
    """The view grows while it is held there; the target steps to where it is let go, at most 30 m away."""
    page = Page(tab, made[0], width_px)
    field = "page.player.views[0]"
    pointer, canvas = "page.player.controls.pointer", f"{field}.canvas"
    page.find(f"{pointer}.begin([{canvas}.clientWidth - 5, {canvas}.clientHeight / 2])")
    page.find(f"(() => {{ for (let n = 0; n < 40; n++) {pointer}.hold({pointer}.before + 50); }})()")
    page.find(f"{pointer}.end(true)")
    assert page.target() == [30.0, pytest.approx(0.0, abs=0.2)]
    assert page.find(f"{field}.pixels(30, 0)[0] < {field}.canvas.clientWidth")


def test_a_drawn_fence_keeps_the_drone_inside(made: tuple[Path, Any], tab: Browser) -> None:
    """The target is beyond it; the others have no limits, as the page says; removed, the drone leaves."""
    page = Page(tab, made[0], DESK_PX, "#target=hand&at=0,0")
    tab.find('document.getElementById("fence").click()')
    tab.drag(page.pixels(-1.0, -1.0), page.pixels(1.0, 1.0))
    assert page.find("page.world.fence") == pytest.approx([-1.0, -1.0, 1.0, 1.0], abs=0.02)
    assert page.text("#fence") == "Remove the fence"
    assert "without a fence: mambo-1norm, PD-feedforward, PD." in page.text("#status")
    fragment = tab.find("location.hash")
    page.find("(page.world.target.drag(2.5, 2.0), page.world.target.release())")
    place = f"(page.world.advance(1), Math.max(...page.world.drones[{MAMBO}].position.slice(0, 2)))"
    assert 0.95 < max(page.find(f"Array.from({{ length: 600 }}, () => {place})")) < 1.02
    assert page.error_m(FEEDFORWARD) < 0.1
    page.advance(0.1)
    assert "limit: fence" in page.text("#limits")
    tab.find('document.getElementById("fence").click()')
    assert page.find("page.world.fence") is None
    page.advance(6.0)
    assert page.error_m(MAMBO) < 0.05
    other = Page(tab, made[0], PHONE_PX, fragment)
    assert other.find("page.world.fence") == pytest.approx([-1.0, -1.0, 1.0, 1.0], abs=0.02)
    assert tab.complaints == []


def test_a_lost_drone_says_why_and_starts_again(page: Page, tab: Browser) -> None:
    """Verdict and table say it, view and axes stay, and the others fly on, bit for bit."""
    others = "JSON.stringify(page.world.drones.slice(0, 3).map((drone) => [...drone.position]))"
    page.advance(6.0)
    calm, axes = page.find(others), page.find(AXES)
    page.find("page.world.begin()")
    page.advance(2.0)
    hit = "(one) => one.push([5, 0], (page.world.updates - one.born) * page.world.data.ticks)"
    page.find(f"({hit})(page.world.drones[{PD}])")
    page.advance(2.0)
    assert "PD is lost: it turned over; it starts again at the target." in page.text("#verdict")
    assert page.text(f".standing tbody tr:nth-child({PD + 1}) .error") == "lost"
    assert page.find("page.player.views[0].view.wanted.width") == page.find("VIEW_M")
    assert page.find(AXES) == axes
    page.advance(2.0)
    assert page.find(others) == calm
    page.advance(1.0)
    assert page.error_m(PD) < 1.0
    assert "PD was lost once." in page.text("#verdict")
    assert tab.complaints == []


def test_a_page_that_was_hidden_shows_the_field_again(page: Page, tab: Browser) -> None:
    """As in a frame without a size; the view is where it was."""
    for display in ("none", ""):
        tab.find(f'document.querySelector(".desk").style.display = "{display}"')
        page.advance(1.0)
    assert page.find("page.player.views[0].view.width") == page.find("VIEW_M")
    assert page.find("page.player.views[0].view.centre") == [0, 0]


def test_the_inset_shows_the_target_20_times_larger(page: Page) -> None:
    """A drone 1 cm right of it and 2 cm below; it makes room for a target in its corner."""
    page.find("(page.world.target.drag(0, 0), page.world.begin())")
    page.find(f"page.world.drones[{MAMBO}].position.set([0.01, 0.02])")
    page.find("(page.world.record(), page.player.redraw())")
    field = "page.player.views[0]"
    inset = "(({ left, top, size }, scale) => [left + size / 2 + 0.2 * scale, top + size / 2 + 0.4 * scale])"
    place = f"{inset}(insetPlace({field}, [0, 0]), {field}.view.scale)"
    assert page.find(f"{PIXELS}({field}.canvas, ...{place}, 1, 1)") == BLUE
    assert page.find(f"insetPlace({field}, [{field}.canvas.clientWidth, 0]).left") == 8


def test_the_arrow_of_the_wind_points_where_drones_drift(page: Page) -> None:
    """With the mean speed at the height of a level course."""
    page.find("page.world.target.drag(0, 0)")
    page.slide("wind", 16)
    for place, way in ((0, [1.0, 0.0]), (6, [0.0, 1.0])):
        page.slide("towards", place)
        page.find("page.world.begin()")
        page.advance(2.0)
        x, y = page.find(f"[...page.world.drones[{PD}].position.slice(0, 2)]")
        assert page.find("windWay(page.world)") == pytest.approx(way)
        assert np.dot((x, y), way) > 0.2
    assert page.find("windSpeed(page.world)") == pytest.approx(mean_speed_m_s(np.array([8.0]), 1.1)[0])


def test_the_verdict_names_the_closest(page: Page) -> None:
    """Distances in cm, the others as multiples, and a longer bar for a larger distance."""
    page.advance(20.0)
    verdict = page.text("#verdict")
    assert re.match(
        r"mambo(-1norm)? is closest: \d\.\d cm from the target in the mean of the last 10 s, ", verdict
    )
    assert re.search(r"PD \d+ times as far", verdict)
    widths = page.find("[...document.querySelectorAll('.bar')].map((bar) => bar.clientWidth)")
    assert 0 < widths[MAMBO] < widths[FEEDFORWARD] < widths[PD]


def test_the_keyboard_fences_the_target(page: Page, tab: Browser) -> None:
    """F puts the fence, and removes it."""
    page.find("page.world.target.drag(0, 0)")
    page.find("page.world.begin()")
    tab.find('document.getElementById("field").focus()')
    tab.press("f", 70, "f")
    assert page.find("page.world.fence") == [-1.0, -1.0, 1.0, 1.0]
    tab.press("f", 70, "f")
    assert page.find("page.world.fence") is None


def test_a_dragged_drone_pushes_all(page: Page, tab: Browser) -> None:
    """The same impulse for each; the wide lag of the PD lets one take it beside the target."""
    page.advance(6.0)
    x, y = page.find(f"page.world.drones[{PD}].position.slice(0, 2).join()").split(",")
    start = page.pixels(float(x), float(y))
    before = page.error_m(MAMBO)
    tab.drag(start, (start[0] + 150.0, start[1]))
    assert "Pushed every drone" in page.text("#status")
    assert page.find("page.world.target.kind") == "eight"
    page.advance(0.4)
    assert page.error_m(MAMBO) > before + 0.1
    page.advance(4.0)
    assert page.error_m(MAMBO) < 0.1


def test_the_keyboard_moves_pushes_and_pauses(page: Page, tab: Browser) -> None:
    """Arrow, Shift and arrow, Space: all on the field, and what happened is said."""
    tab.find('document.getElementById("field").focus()')
    tab.press("ArrowRight", ARROW_RIGHT)
    tab.press("ArrowRight", ARROW_RIGHT)
    assert page.find("page.world.target.goal") == [0.5, 0.0]
    assert page.text("#status") == "Target at x 0.50 m, y 0.00 m."
    page.advance(5.0)
    assert page.error_m(MAMBO) < 0.02
    tab.press("ArrowRight", ARROW_RIGHT, shift=True)
    assert "Pushed every drone right" in page.text("#status")
    page.advance(0.4)
    assert page.error_m(MAMBO) > 0.1
    assert not page.find("page.player.playing")
    tab.press(" ", SPACE, " ")
    assert page.find("page.player.playing")
    assert page.text("#pause") == "Pause"
    tab.press(" ", SPACE, " ")
    assert not page.find("page.player.playing")


def test_every_control_is_reached_by_tab(page: Page, tab: Browser) -> None:
    """Field, buttons, one box a drone, and sliders."""
    controls = "[...document.querySelectorAll('canvas[tabindex], button, input, select')]"
    reached = set()
    for _ in range(30):
        tab.press("Tab", 9)
        reached.add(tab.find(f"{controls}.indexOf(document.activeElement)"))
    assert reached >= set(range(tab.find(f"{controls}.length")))
    assert page.find("true")


def test_the_fragment_restores_the_scenario(made: tuple[Path, Any], page: Page, tab: Browser) -> None:
    """Sliders, target and hidden drones; and what then flies has the same bits."""
    for key, place in (("wind", 8), ("towards", 3), ("noise", 4), ("lag", 6), ("effort2", 6)):
        page.slide(key, place)
    tab.find('document.querySelectorAll(".standing input")[3].click()')
    tab.drag(page.pixels(0.0, 1.2), page.pixels(-1.0, 0.5))
    fragment = tab.find("location.hash")
    tab.find('document.getElementById("again").click()')
    page.advance(3.0)
    flown = page.find("JSON.stringify(page.world.history)")
    other = Page(tab, made[0], PHONE_PX, fragment)
    assert other.find("page.world.dials") == [8, 3, 4, 6, 6]
    assert other.find("page.world.drones.map((drone) => drone.shown)") == [True, True, True, False]
    assert other.target() == pytest.approx([-1.0, 0.5], abs=0.02)
    assert tab.find('document.querySelector("output[for=wind]").textContent') == "4 m/s"
    other.advance(3.0)
    assert other.find("JSON.stringify(page.world.history)") == flown


@pytest.mark.parametrize(
    "fragment", ["#target=moon&wind=9999&at=x,y&without=7", "#target=hand&at=1", "#fence=1,1,0,0", "#%%%"]
)
def test_a_wrong_fragment_is_ignored(made: tuple[Path, Any], tab: Browser, fragment: str) -> None:
    """What it does not understand stays at the start."""
    page = Page(tab, made[0], DESK_PX, fragment)
    assert page.find("page.world.dials") == page.find("page.world.data.dials.map((dial) => dial.start)")
    assert page.find("page.world.target.kind") == "eight"
    page.advance(2.0)
    assert page.error_m(MAMBO) < 0.15
    assert tab.complaints == []


def test_a_weight_changes_its_controller_alone(page: Page) -> None:
    """The flights of the others keep their bits."""
    states = "JSON.stringify(page.world.drones.map((drone) => [...drone.position]))"
    page.advance(4.0)
    before = json.loads(page.find(states))
    page.slide("effort2", 9)
    page.find("page.world.begin()")
    page.advance(4.0)
    after = json.loads(page.find(states))
    assert [one == other for one, other in zip(before, after, strict=True)] == [True, False, True, True]


def test_wind_noise_and_lag_disturb_every_flight(page: Page) -> None:
    """Each slider alone changes what every drone flies."""
    states = "JSON.stringify(page.world.drones.map((drone) => [...drone.position]))"
    page.advance(2.0)
    calm = json.loads(page.find(states))
    for key in ("wind", "noise", "lag"):
        page.slide(key, 10)
        page.find("page.world.begin()")
        page.advance(2.0)
        flown = json.loads(page.find(states))
        assert all(one != other for one, other in zip(calm, flown, strict=True)), key
        page.slide(key, 0)


def test_a_picture_takes_a_bounded_number_of_updates(page: Page) -> None:
    """A minute without pictures, as in a tab in the background, is not flown at once."""
    begin = "page.player.playing = true, page.player.frame(0), page.before = page.world.updates"
    end = "page.player.frame(60000), page.player.playing = false, page.world.updates - page.before"
    assert page.find(f"({begin}, {end})") == 10


def test_reduced_motion_waits_and_draws_once_a_second(page: Page) -> None:
    """Nothing moves until it is asked to, and then there is one picture a second."""
    assert not page.find("page.player.playing")
    assert "reduced motion" in page.text("#status")
    drawn = page.find(
        "(page.player.playing = true, Array.from({ length: 151 }, (_, n) => "
        "(page.player.frame(1e6 + 20 * n), page.player.drawn - 1e6)))"
    )
    page.find("page.player.playing = false")
    assert sorted(set(drawn)) == [0, 1000, 2000, 3000]


def test_it_flies_by_itself_where_motion_is_welcome(made: tuple[Path, Any], tab: Browser) -> None:
    """Picture after picture, without a request, until it is paused."""
    tab.open(made[0], DESK_PX)
    frames = "for (let n = 0; n < 20; n++) await new Promise(requestAnimationFrame)"
    updates = f"playground.then(async (page) => {{ {frames}; return page.world.updates; }})"
    assert tab.find(updates) > 0
    tab.find('document.getElementById("pause").click()')
    held = tab.find(updates)
    assert tab.find(updates) == held
    assert tab.complaints == []
    assert tab.requests == [made[0].as_uri()]


@pytest.mark.parametrize("width_px", [PHONE_PX, DESK_PX])
def test_nothing_is_wider_than_the_window(made: tuple[Path, Any], tab: Browser, width_px: int) -> None:
    """Fingers find the controls on a phone."""
    Page(tab, made[0], width_px).advance(3.0)
    assert tab.find("document.documentElement.scrollWidth") <= width_px
    beyond = "[...document.querySelectorAll('.scroll')].map((one) => one.scrollWidth - one.clientWidth)"
    assert tab.find(beyond) == [0, 0]
    controls = "button, select, input[type=range], label:has(input)"
    heights = f"Math.min(...[...document.querySelectorAll('{controls}')].map((one) => one.offsetHeight))"
    assert tab.find(heights) >= (44 if width_px == PHONE_PX else 24)


def test_the_page_is_as_light_or_dark_as_what_surrounds_it(made: tuple[Path, Any], tab: Browser) -> None:
    """Whatever the system is, once it is told, and again; any other message is ignored."""
    page = Page(tab, made[0])
    papers = []
    for told in ("dark", "light", "dark", "blue"):
        come = "new Promise((done) => addEventListener('message', done, { once: true }))"
        page.find(f"(postMessage('{told}', '*'), await {come}, true)")
        papers.append(
            page.find("[getComputedStyle(document.body).backgroundColor, page.player.palette.paper]")
        )
    black, white = ["rgb(20, 23, 26)", "#14171a"], ["rgb(255, 255, 255)", "#ffffff"]
    assert papers == [black, white, black, black]


def test_on_a_phone_the_field_stays_above_the_sliders(made: tuple[Path, Any], tab: Browser) -> None:
    """Each one that has the focus is in the window, below the field; sliders come before plots."""
    page = Page(tab, made[0], PHONE_PX)
    box = "(({ top, bottom }) => [top, bottom])(document.getElementById('{0}').getBoundingClientRect())"
    for key in ("lag", "wind"):
        tab.find(f"document.getElementById('{key}').focus()")
        top, bottom = page.find(box.replace("{0}", "field"))
        assert top == 0
        assert bottom <= 0.46 * 800
        slider = page.find(box.replace("{0}", key))
        assert bottom <= slider[0] < slider[1] <= 800
    assert page.find(box.replace("{0}", "lag"))[1] < page.find(box.replace("{0}", "errors"))[0]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width_px", [PHONE_PX, DESK_PX])
def test_axe_finds_no_fault(made: tuple[Path, Any], tab: Browser, width_px: int, scheme: str) -> None:
    """Not one of those that it calls serious or critical."""
    require_module("axe_core_python")
    tab.open(made[0], width_px, prefers_color_scheme=scheme)
    tab.find("playground.then((page) => page.player.play(false))")
    tab.find(resources.files("axe_core_python").joinpath("axe.min.js").read_text("utf-8") + "; null")
    found = tab.find("axe.run().then((all) => JSON.stringify(all.violations))")
    grave = [one for one in json.loads(found) if one["impact"] in ("serious", "critical")]
    assert [(one["id"], [node["html"] for node in one["nodes"]]) for one in grave] == []
