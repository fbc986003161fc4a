"""The playground in a real browser: a target that is followed, and controls for all."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.support.browser import DESK_PX, FEEDFORWARD, MAMBO, PD, PHONE_PX, Browser, Page

SPACE, ARROW_RIGHT = 32, 39

pytestmark = pytest.mark.long


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
    assert page.text("#limits").startswith("mambo 5.0 m/s, limit: speed; mambo-1norm ")
    assert "; without limits: mambo-1norm," in page.text("#limits")
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
    assert other.find("page.world.dials") == [2, 8, 3, 4, 6, 6]
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
