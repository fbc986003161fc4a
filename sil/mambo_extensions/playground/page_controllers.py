"""The controllers that fly on a page: laws without a model, and generated C."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mambo_codegen.errors import echo
from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from mambo_sil.errors import FlightError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import AnyPd, pd_controller
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import PD_NAMES, PD_TITLES, PdName

DEFAULTS: Final = ("mambo", "mambo-1norm", "pd-feedforward", "pd")
MOST: Final = 4
"""Colours that can be told apart."""


@dataclass(frozen=True)
class PageController:
    """One controller: a law without a model by its name, or the settings of generated C."""

    source: str
    kind: PdName | Settings

    @property
    def title(self) -> str:
        """The name on the page: of a file or folder without the folders above it."""
        return PD_TITLES.get(self.source, echo(Path(self.source).resolve().name))

    @property
    def commands_thrust(self) -> bool:
        """Whether it commands the thrust too."""
        return isinstance(self.kind, Settings) and method_of(self.kind).has_height

    def controller(self, flight: Flight) -> CompiledController | AnyPd:
        """Return the controller of a single flight for this machine; raises BuildError, CacheError."""
        if isinstance(self.kind, Settings):
            return CompiledController(self.kind)
        return pd_controller(self.kind, flight)


def page_controllers(sources: Sequence[str]) -> tuple[PageController, ...]:
    """Return the controllers of `sources`: laws without a model, presets, settings files, folders of bundles.

    Raises FlightError for too many, one twice, or different update periods, and what
    `presets.load` raises.
    """
    if len(sources) > MOST:
        raise FlightError(f"playground: there are {len(sources)} controllers; name at most {MOST}")
    twice = next((source for source in sources if sources.count(source) > 1), None)
    if twice is not None:
        raise FlightError(f"playground: {echo(twice)} is named twice; name each controller once")
    found = tuple(_page_controller(source) for source in sources)
    generated = [one for one in found if isinstance(one.kind, Settings)]
    for other in generated[1:]:
        if period_s([other]) != period_s(generated):
            raise FlightError(
                f"{echo(other.source)}: horizon.update_period_s = {period_s([other]):g} must be that of "
                f"{echo(generated[0].source)}, {period_s(generated):g}: all drones of a page have one clock"
            )
    return found


def period_s(found: Sequence[PageController]) -> float:
    """Return the update period of controllers that have the same one; a PD has 0.01 s."""
    periods = (one.kind.horizon.update_period_s for one in found if isinstance(one.kind, Settings))
    return next(periods, 0.01)


def _page_controller(source: str) -> PageController:
    for name in PD_NAMES:
        if source == name:
            return PageController(source, name)
    return PageController(source, presets.load_or_bundle(source))
