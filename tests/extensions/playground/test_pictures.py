"""The playground in a real browser: what it draws and says, in any window, light or dark."""

import json
import re
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_sil.drone.plant.gusts import mean_speed_m_s
from tests.support.browser import DESK_PX, FEEDFORWARD, MAMBO, PD, PHONE_PX, Browser, Page
from tests.support.tools import require_module

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
