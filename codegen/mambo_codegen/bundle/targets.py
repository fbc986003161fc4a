"""The targets of `mambo-nmpc generate --for`: folders that build as they are, in a firmware or a tool.

A target is an entry here and a folder of templates, `firmware/NAME`, laid out like the folder that they make:
`src/Kbuild.j2` becomes `src/Kbuild`. Names of the controller in paths and texts get its prefix. Python, such
as `fly.py`, is copied as it stands: its numbers are in a file of values.
"""

import difflib
from dataclasses import dataclass
from typing import Final

from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError, echo

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
    """

    name: str
    preset: str | None
    source_folder: str
    opening: str = ""
    self_test: bool = True
    tick_s: float | None = None
    flies_height: bool = False

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


_NO_FLAGS: Final = """/* No flag reaches this file; a fused multiply-add rounds once: its bits are others. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("-ffp-contract=off")
#endif

"""
_TARGETS: Final = (
    FirmwareTarget("arduino", "mambo", "src/", opening=_NO_FLAGS),
    FirmwareTarget("crazyflie", "crazyflie", "src/", tick_s=0.001),
    FirmwareTarget("espidf", "mambo", ""),
    FirmwareTarget("fmu", "mambo", "sources/", opening=_NO_FLAGS, self_test=False),
    FirmwareTarget("mambo", "mambo", "src/", self_test=False, tick_s=0.005),
    FirmwareTarget("pil", "mambo", ""),
    FirmwareTarget("platformio", "mambo", "src/"),
    FirmwareTarget("px4", None, "src/modules/mc_nmpc/", flies_height=True),
)
TARGETS: Final = {target.name: target for target in _TARGETS}
"""All targets by name."""


def complete_targets(incomplete: str) -> list[str]:
    """Return the targets that begin with `incomplete`, for the shell."""
    return [name for name in TARGETS if name.startswith(incomplete)]


def find_target(name: str) -> FirmwareTarget:
    """Return the target of that name; raises SourceNotFoundError."""
    if name in TARGETS:
        return TARGETS[name]
    near = difflib.get_close_matches(name, TARGETS, n=1)
    guess = f" (did you mean {near[0]}?)" if near else ""
    raise SourceNotFoundError(
        f"--for {echo(name)} is not a target{guess}; targets are {', '.join(TARGETS)}; without --for the "
        "bundle has a Makefile and fits any firmware"
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
