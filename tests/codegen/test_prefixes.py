"""Prefixes of public names that would be names of the controller's own C."""

import re

from mambo_codegen.bundle.render import LIBRARY, render
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.reserved import OWN_NAMES
from tests.support.height import height_case
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import EVERYTHING

LEVEL = with_option(ONE_NORM, "limits.speed_m_s", 1.5)
SCALARS = ("float32", "fixed")
SETTINGS = (
    *(with_option(one, "code.scalar", scalar) for one in (LEVEL, EVERYTHING) for scalar in SCALARS),
    *(height_case(index, scalar) for index in range(9) for scalar in SCALARS),
)


def clashing(settings: Settings) -> set[str]:
    """Return the beginnings of names of the C that end as a public one does."""
    files = render(settings, with_digest=False)
    text = "".join(re.sub(r"/\*.*?\*/", "", files[name], flags=re.DOTALL) for name in LIBRARY)
    words = set(re.findall(r"\b[A-Za-z]\w*\b", text))
    public = {word for word in words if word.lower().startswith("nmpc_")}
    endings = {word.partition("_")[2] for word in public}
    parts = [word.split("_") for word in words - public]
    return {
        "_".join(part[:k]) for part in parts for k in range(1, len(part)) if "_".join(part[k:]) in endings
    }


def test_prefixes_that_are_refused_are_those_that_clash() -> None:
    """All of them, and no other."""
    assert set().union(*map(clashing, SETTINGS)) == OWN_NAMES
