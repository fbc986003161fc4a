"""The targets of `mambo-nmpc generate --for`: folders that build as they are, in a firmware or a tool.

A target is an entry here or an entry point of an extension, and a folder of templates, `firmware/NAME`,
laid out like the folder that they make: `src/Kbuild.j2` becomes `src/Kbuild`; a file that begins with `_` is
a part of others. Names of the controller in paths and texts get its prefix. Python, such as `fly.py`, is
copied as it stands: its numbers are in a file of values.
"""

import difflib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from mambo_codegen import extensions
from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError, echo

if TYPE_CHECKING:
    from mambo_codegen.settings.model import Settings

TARGETS_FOLDER: Final = "firmware"
"""The folder of the templates of each target."""


@dataclass(frozen=True)
class FirmwareTarget:
    """Where a controller is used.

    name: as in `--for`, and of the folder of templates.
    preset: the settings if the user names none; None where no preset fits.
    source_folder: of nmpc.h and nmpc.c, with a slash at its end.
    opening: text before the text of nmpc.c.
    self_test: whether the self-test lies beside them.
    tick_s: the period with which the firmware calls, in s; None where the caller chooses it.
    flies_height: whether it wants roll, pitch and thrust from one controller.
    context: returns what its templates insert besides.
    """

    name: str
    preset: str | None
    source_folder: str
    opening: str = ""
    self_test: bool = True
    tick_s: float | None = None
    flies_height: bool = False
    context: "Callable[[Settings], dict[str, object]] | None" = None

    def refuse_level(self, *, has_height: bool) -> None:
        """Raise InvalidSettingsError for settings without a height if the target needs one."""
        if self.flies_height and not has_height:
            raise InvalidSettingsError(
                (
                    f"--for {self.name} wants settings with [height], since its controller "
                    "commands the thrust too: derive them from a drone with [thrust] or [rotors] "
                    "(mambo-nmpc design)",
                )
            )

    def ticks_per_update(self, update_period_s: float) -> int:
        """Return the ticks of an update period, 1 without a tick; raises InvalidSettingsError."""
        if self.tick_s is None:
            return 1
        ticks = round(update_period_s / self.tick_s)
        if ticks < 1 or abs(update_period_s - ticks * self.tick_s) > 1e-9:
            raise InvalidSettingsError(
                (
                    f"horizon.update_period_s = {update_period_s:g} must be a whole multiple of "
                    f"{self.tick_s:g}, the period in seconds with which the firmware of {self.name} calls",
                )
            )
        return ticks


NO_FLAGS: Final = """/* No flag reaches this file; a fused multiply-add rounds once: its bits are others. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("-ffp-contract=off")
#endif

"""
"""The opening where the user's tools choose the flags."""

_OWN: Final = (
    FirmwareTarget("arduino", "mambo", "src/", opening=NO_FLAGS),
    FirmwareTarget("espidf", "mambo", ""),
    FirmwareTarget("mambo", "mambo", "src/", self_test=False, tick_s=0.005),
    FirmwareTarget("platformio", "mambo", "src/"),
)
_TARGETS: Final = {target.name: target for target in _OWN}


def target_names() -> list[str]:
    """Return the names of all targets, those of extensions too, sorted."""
    return sorted({*_TARGETS, *extensions.names("targets")})


def complete_targets(incomplete: str) -> list[str]:
    """Return the targets that begin with `incomplete`, for the shell."""
    return [name for name in target_names() if name.startswith(incomplete)]


def find_target(name: str) -> FirmwareTarget:
    """Return the target of that name; raises SourceNotFoundError."""
    if name in _TARGETS:
        return _TARGETS[name]
    if name in extensions.names("targets"):
        found: FirmwareTarget = extensions.load("targets", name)
        return found
    near = difflib.get_close_matches(name, target_names(), n=1)
    guess = f" (did you mean {near[0]}?)" if near else ""
    raise SourceNotFoundError(
        f"--for {echo(name)} is not a target{guess}; targets are {', '.join(target_names())}; "
        "without --for the bundle has a Makefile and fits any firmware"
    )


def default_source(target: FirmwareTarget) -> str:
    """Return the preset of a target; raises SourceNotFoundError if it has none."""
    if target.preset is None:
        raise SourceNotFoundError(
            f"--for {target.name} has no preset, since no two of its drones are alike: describe yours, and "
            "name its settings (mambo-nmpc design my-drone.toml -o controller.toml; mambo-nmpc generate "
            f"controller.toml --for {target.name} -o {target.name})"
        )
    return target.preset
