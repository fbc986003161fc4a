"""The report in a real browser: no complaint, nothing too wide, and the drones move, by mouse and by key."""

import re
from pathlib import Path

import pytest

from mambo_sil.report.report_page import report_page
from tests.support.browser import Browser
from tests.support.results import all_folders

PHONE_PX, DESK_PX = 360, 1280
SPACE, ARROW_RIGHT = 32, 39

DRONES = 'JSON.stringify([...document.querySelectorAll(".drone")].map((path) => path.getAttribute("d")))'
CLOCK = 'Number.parseFloat(document.querySelector("output").textContent)'
FRAMES = "(async () => { for (let n = 0; n < %d; n++) await new Promise(requestAnimationFrame); })()"

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a report of a folder of every command, each part open."""
    base = tmp_path_factory.mktemp("results")
    for name, make in all_folders().items():
        (base / name).mkdir()
        make(base / name)
    page, _ = report_page([base / name for name in all_folders()], lambda _: None)
    opened = page.replace('<details class="part">', '<details class="part" open>')
    assert opened != page
    (base / "report.html").write_text(opened, "utf-8")
    return base / "report.html"


@pytest.mark.parametrize("width_px", [PHONE_PX, DESK_PX])
def test_nothing_is_wider_than_the_window(page: Path, tab: Browser, width_px: int) -> None:
    """Wide tables scroll in their box, fingers find the controls, and the console stays empty."""
    tab.open(page, width_px)
    assert tab.find("innerWidth") == width_px
    assert tab.find("document.documentElement.scrollWidth") <= width_px
    heights = 'Math.min(...[...document.querySelectorAll("button, input")].map((one) => one.offsetHeight))'
    assert tab.find(heights) >= 44
    assert tab.complaints == []


def test_play_moves_the_drone_and_pause_holds_it(page: Path, tab: Browser) -> None:
    """Clock and outlines go on together from frame to frame, until the button is pressed again."""
    tab.open(page, DESK_PX)
    before, button = tab.find(DRONES), 'document.querySelector("button")'
    assert tab.find(CLOCK) == 0.0
    tab.find(f"{button}.click()")
    assert tab.find(f"{button}.textContent") == "Pause"
    tab.find(FRAMES % 20)
    assert tab.find(CLOCK) > 0.0
    tab.find(f"{button}.click()")
    held = tab.find(DRONES)
    assert held != before
    assert tab.find(f"{button}.textContent") == "Play"
    tab.find(FRAMES % 5)
    assert tab.find(DRONES) == held
    assert tab.complaints == []


def test_the_keyboard_plays_and_winds(page: Path, tab: Browser) -> None:
    """Space on the button, an arrow on the slider: each moves the drones."""
    tab.open(page, DESK_PX)
    before = tab.find(DRONES)
    tab.find('document.querySelector(".controls input").focus()')
    tab.press("ArrowRight", ARROW_RIGHT)
    assert tab.find(CLOCK) == 0.1
    assert tab.find(DRONES) != before
    assert tab.find('document.querySelector(".controls input").getAttribute("aria-valuetext")') == "0.1 s"
    tab.find('document.querySelector("button").focus()')
    tab.press(" ", SPACE, " ")
    tab.find(FRAMES % 5)
    assert tab.find(CLOCK) > 0.1


def test_a_flight_ends_and_begins_again(page: Path, tab: Browser) -> None:
    """At its end it stops; play takes it from the begin."""
    tab.open(page, DESK_PX)
    put = 'const slider = document.querySelector(".controls input"); slider.value = 3.9;'
    tab.find(f'{{ {put} slider.dispatchEvent(new Event("input")); }}')
    tab.find('document.querySelector("button").click()')
    tab.find(FRAMES % 30)
    assert tab.find(CLOCK) == 4.0
    assert tab.find('document.querySelector("button").textContent') == "Play"
    tab.find('document.querySelector("button").click()')
    tab.find(FRAMES % 3)
    assert tab.find(CLOCK) < 3.9


def test_reduced_motion_shows_a_picture_a_second(page: Path, tab: Browser) -> None:
    """The first picture that differs is a whole second of playing on: nothing moves smoothly."""
    tab.open(page, DESK_PX, prefers_reduced_motion="reduce")
    tab.find('document.querySelector("button").click()')
    tab.find(f"(async () => {{ while ({CLOCK} === 0) await new Promise(requestAnimationFrame); }})()")
    assert tab.find(CLOCK) == 4.0


@pytest.mark.parametrize(("scheme", "paper"), [("light", range(250, 256)), ("dark", range(50))])
def test_a_dark_desk_gets_a_dark_page(page: Path, tab: Browser, scheme: str, paper: range) -> None:
    """The same page in the other colours."""
    tab.open(page, DESK_PX, prefers_color_scheme=scheme)
    colour = tab.find("getComputedStyle(document.body).backgroundColor")
    assert {int(part) in paper for part in re.findall(r"\d+", colour)} == {True}


def test_on_paper_the_flight_stands_still(page: Path, tab: Browser) -> None:
    """The controls are gone, the picture stays."""
    tab.open(page, DESK_PX)
    tab.do("Emulation.setEmulatedMedia", media="print")
    assert tab.find('document.querySelector(".controls").offsetHeight') == 0
    assert tab.find('document.querySelector(".flight svg").getBoundingClientRect().height') > 50
    tab.do("Emulation.setEmulatedMedia", media="")
