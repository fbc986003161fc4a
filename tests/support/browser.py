"""A real browser without a window and without a network, driven through its own debugging protocol."""

import contextlib
import fcntl
import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from tests.support.tools import require

_FIRST_HIGH_DESCRIPTOR = 10


class Browser:
    """One tab.

    `complaints` collects what the page writes to the console, throws or is refused, `requests` the addresses
    that it asks for, its own included.
    """

    def __init__(self, commands: BinaryIO, answers: BinaryIO) -> None:
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self._commands, self._answers = commands, answers
        self._sent = 0
        self._session: str | None = None
        target = self.do("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.do("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.do(f"{domain}.enable")

    def do(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Carry out a command of the protocol and return its result."""
        self._sent += 1
        message: dict[str, Any] = {"id": self._sent, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        self._commands.write(json.dumps(message).encode() + b"\0")
        while (answer := self._next()).get("id") != self._sent:
            pass
        assert "error" not in answer, (method, answer)
        return dict(answer["result"])

    def open(self, page: Path, width_px: int, fragment: str = "", **media: str) -> None:
        """Show a page in a window of this width, with these media features, such as a dark scheme."""
        self._visit("about:blank")  # lest another fragment stay on the same page
        self.complaints.clear()
        self.requests.clear()
        features = [{"name": name.replace("_", "-"), "value": value} for name, value in media.items()]
        self.do("Emulation.setEmulatedMedia", features=features)
        size = {"width": width_px, "height": 800, "deviceScaleFactor": 1, "mobile": width_px < 600}
        self.do("Emulation.setDeviceMetricsOverride", **size)
        self._visit(page.as_uri() + fragment)

    def find(self, expression: str) -> Any:
        """Return the value of a JavaScript expression in the page, awaited."""
        found = self.do("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def press(self, key: str, code: int, text: str = "", *, shift: bool = False) -> None:
        """Press a key of the keyboard and let it go."""
        names = {"key": key, "code": key, "windowsVirtualKeyCode": code, "modifiers": 8 * shift}
        self.do("Input.dispatchKeyEvent", type="keyDown", text=text, **names)
        self.do("Input.dispatchKeyEvent", type="keyUp", **names)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Press the mouse at a place of the window, in pixels, move it to another, and let it go."""
        for kind, (x, y) in (("Pressed", start), ("Moved", end), ("Released", end)):
            self.do("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, button="left", clickCount=1)

    def swipe(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Put a finger on a place of the window, in pixels, move it to another, and lift it."""
        for kind, places in (("Start", [start]), ("Move", [end]), ("End", [])):
            points = [{"x": x, "y": y} for x, y in places]
            self.do("Input.dispatchTouchEvent", type=f"touch{kind}", touchPoints=points)

    def _visit(self, address: str) -> None:
        """Show what is at an address, and wait until it is loaded."""
        self.do("Page.navigate", url=address)
        while self._next().get("method") != "Page.loadEventFired":
            pass

    def _next(self) -> dict[str, Any]:
        """Return the next answer or event, and note complaints."""
        text = bytearray()
        while (byte := self._answers.read(1)) != b"\0":
            assert byte, "the browser is gone"
            text += byte
        message: dict[str, Any] = json.loads(text)
        if message.get("method") in ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"):
            self.complaints.append(json.dumps(message["params"]))
        if message.get("method") == "Network.requestWillBeSent":
            self.requests.append(message["params"]["request"]["url"])
        return message


@contextlib.contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """Start a browser that keeps its files in `folder`, and end it."""
    chromium, bash = require("chromium", "chromium"), require("bash", "bash")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"]
    options += [f"--user-data-dir={folder}", "--host-resolver-rules=MAP * ~NOTFOUND"]
    options += ["--remote-debugging-pipe"]
    (its_commands, commands), (answers, its_answers) = _pipe(), _pipe()
    with os.fdopen(commands, "wb", buffering=0) as to_it, os.fdopen(answers, "rb") as from_it:
        process = subprocess.Popen(
            [bash, "-c", f'exec "$0" "$@" 3<&{its_commands} 4>&{its_answers}', chromium, *options],
            pass_fds=(its_commands, its_answers),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(its_commands)
        os.close(its_answers)
        try:
            yield Browser(to_it, from_it)
        finally:
            process.terminate()
            process.wait(30)


def _pipe() -> tuple[int, int]:
    """Return a pipe, read end first, away from the numbers that the browser's own ends get."""
    low = os.pipe()
    high = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, _FIRST_HIGH_DESCRIPTOR) for end in low]
    for end in low:
        os.close(end)
    return high[0], high[1]


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
