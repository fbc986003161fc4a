"""The controller with a 1-norm that most tests of the paper's method take."""

from typing import Final

from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings

ONE_NORM: Final[Settings] = with_option(presets.preset("mambo-1norm"), "target.acceleration", "none")
"""Preset mambo-1norm without its tracker: the paper's Table I with the lags of the Mambo's attitude loops."""
