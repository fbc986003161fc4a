"""Why a fault cannot show: a row for each mutant that survives, and the settings for which it holds."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from codegen.settings import Settings
from sil.verify.mutants import Mutant


def _always(_: Settings) -> bool:
    return True


@dataclass(frozen=True)
class Reason:
    """A mutant, by its key, why it changes no bit, and for which settings that is so."""

    file: str
    line: str
    change: str
    reason: str
    holds: Callable[[Settings], bool] = _always

    def explains(self, mutant: Mutant, settings: Settings) -> bool:
        """Whether this is the reason of `mutant`."""
        return mutant.key == (self.file, self.line, self.change) and self.holds(settings)


REASONS: Final[tuple[Reason, ...]] = ()
