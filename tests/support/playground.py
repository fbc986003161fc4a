"""The playground in a tab of a browser."""

from pathlib import Path
from typing import Any

from tests.support.browser import Browser

PHONE_PX, DESK_PX = 390, 1280
MAMBO, ONE_NORM, FEEDFORWARD, PD = range(4)
"""The drones of the default page, in its order."""


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
