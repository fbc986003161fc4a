"""Compile the firmware's modules for this machine, and link them with an app into a shared library."""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import TARGETS
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.results.cache import build_cached
from mambo_sil.results.shared_library import LIBRARY_FLAGS

HERE: Final = Path(__file__).parent
TESTED: Final = "2a18fc29"
"""Commit of the firmware that the figures were made with."""

MODULES: Final = (
    *("axis3fSubSampler", "collision_avoidance", "commander", "crtp_commander", "crtp_commander_generic"),
    *("crtp_commander_high_level", "crtp_commander_rpyt", "kalman_supervisor", "planner", "pptraj"),
    *("pptraj_compressed", "power_distribution_quadrotor", "sensfusion6", "stabilizer", "supervisor"),
    *("supervisor_state_machine", "estimator/estimator", "estimator/estimator_complementary"),
    *("estimator/estimator_kalman", "estimator/position_estimator_altitude", "controller/*", "kalman_core/*"),
    "outlierfilter/*",
)
UTILITIES: Final = (
    *("filter", "num", "pid", "rateSupervisor", "statsCnt"),
    *("lighthouse/lighthouse_calibration", "lighthouse/lighthouse_geometry"),
)
INCLUDES: Final = (
    *(f"modules/interface{part}" for part in ("", "/controller", "/estimator", "/kalman_core")),
    *("modules/interface/lighthouse", "modules/interface/outlierfilter"),
    *("utils/interface", "utils/interface/lighthouse", "utils/interface/tdoa"),
    *("hal/interface", "drivers/interface", "config", "platform/interface", "deck/interface"),
    "deck/drivers/interface",
)
FLAGS: Final = (
    *("-std=gnu11", "-O2", "-fPIC", "-w", "-fno-strict-aliasing", "-ffp-contract=off"),
    *("-include", "autoconf.h", "-include", "semphr.h"),
    *("-DPLATFORM_CF2", "-DCRAZYFLIE_FW", "-D__fp16=uint16_t"),
)


class NoFirmwareError(Exception):
    """A folder that is no clone of the firmware; the text says so."""


def build(firmware: Path, settings: Settings) -> Path:
    """Return the shared library of the firmware with the app of `settings`, cached by all their files.

    Raises NoFirmwareError, and BuildError if the firmware is not as the desk expects it.
    """
    return link(firmware, render_target(settings, TARGETS["crazyflie"], with_digest=False))


def link(firmware: Path, app: Mapping[str, str]) -> Path:
    """Return the shared library of the firmware with an app, {path: text}; raises as `build`."""
    modules = _modules(firmware)
    sources = {
        path: text for path, text in app.items() if path.startswith("src/") and path[-2:] in (".c", ".h")
    }
    key = hashlib.sha256(repr((modules.name, sorted(sources.items()))).encode()).hexdigest()[:32]

    def compile_app(folder: Path) -> Path:
        for path, text in sources.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, "utf-8")
        names = [path for path in sources if path.endswith(".c")]
        arguments = (
            *LIBRARY_FLAGS,
            "-Wl,--no-undefined",
            *_flags(firmware),
            "-Isrc",
            *names,
            str(modules),
            "-lm",
        )
        host_toolchain().run((*arguments, "-o", "flight.so"), folder)
        return folder / "flight.so"

    return build_cached(f"firmware_{key}.so", compile_app)


def _flags(firmware: Path) -> tuple[str, ...]:
    own = (HERE / "stubs", HERE / "desk")
    return (*FLAGS, *(f"-I{path}" for path in (*own, *(firmware / "src" / name for name in INCLUDES))))


def _modules(firmware: Path) -> Path:
    """Return one object of the firmware's modules and the desk."""
    if not (firmware / "src/modules/src/stabilizer.c").is_file():
        message = f"{firmware}: is no clone of https://github.com/bitcraze/crazyflie-firmware"
        raise NoFirmwareError(message)
    modules, utilities = firmware / "src/modules/src", firmware / "src/utils/src"
    sources = [
        *(path for name in MODULES for path in sorted(modules.glob(f"{name}.c"))),
        *(path for name in UTILITIES for path in sorted(utilities.glob(f"{name}.c"))),
        *sorted((HERE / "desk").glob("*.c")),
    ]
    headers = [*(firmware / "src").rglob("*.h"), *(HERE / "stubs").glob("*.h"), *(HERE / "desk").glob("*.h")]

    def compile_modules(folder: Path) -> Path:
        for number, source in enumerate(sources):
            arguments = (*_flags(firmware), "-c", str(source), "-o", f"{number}.o")
            host_toolchain().run(arguments, folder)
        objects = [f"{number}.o" for number in range(len(sources))]
        host_toolchain().run(("-r", "-nostdlib", *objects, "-o", "modules.o"), folder)
        return folder / "modules.o"

    return build_cached(f"firmware_{_digest([*sources, *headers])}.o", compile_modules)


def _digest(paths: Iterable[Path]) -> str:
    """Return 32 hexadecimal digits of the SHA-256 of flags and files."""
    digest = hashlib.sha256(repr((FLAGS, host_toolchain().identity())).encode())
    for path in sorted(paths):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:32]
