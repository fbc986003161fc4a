"""The autopilot at the other end of a link: which messages count as its own."""

from typing import Any, Final

from mambo_sil.life.records import COMPANION

AUTOPILOT: Final = 1
"""The component of an autopilot."""
COMPUTERS: Final = (191, 192, 193, 194)
"""The components of an onboard computer, which may be another pilot; one for vision has another."""
MOVES_AFTER_S: Final = 1.0
"""Silence after which the autopilot may send from another port: it, or a router, has been restarted."""


class AutopilotSource:
    """Decides which messages count: those of the autopilot that sent the first heartbeat, from its host.

    Heartbeats of another pilot count too, by the same way. `address` is where the autopilot was heard.
    """

    def __init__(self) -> None:
        self.address: tuple[str, int] | None = None
        self._source: tuple[int, int] | None = None
        self._heard_s = 0.0

    def counts(self, message: Any, address: tuple[str, int], now_s: float) -> bool:
        """Return whether a message that came from an address counts."""
        source = message.get_srcSystem(), message.get_srcComponent()
        is_beat = message.get_type() == "HEARTBEAT"
        if is_beat and message.type == COMPANION:
            return source[1] in COMPUTERS and self.address in {None, address}
        if self._source is None and is_beat and source[1] == AUTOPILOT:
            self._source, self.address = source, address
        if source != self._source or not self._is_from(address, now_s):
            return False
        self.address, self._heard_s = address, now_s
        return True

    def _is_from(self, address: tuple[str, int], now_s: float) -> bool:
        """Return whether an address is the autopilot's, or a new port of its host after a silence."""
        if self.address is None or address == self.address:
            return True
        return address[0] == self.address[0] and now_s - self._heard_s > MOVES_AFTER_S
