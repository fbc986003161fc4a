"""The module of PX4 on the desk: compiled unchanged, in the place of the Crazyflie's app."""

from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import host_toolchain
from mambo_extensions.crazyflie import desk
from mambo_extensions.crazyflie.desk.desk_flight import Desk, DeskConditions
from mambo_extensions.crazyflie.desk.desk_library import HEADERS, SOURCES, interface
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.results.shared_library import LibrarySource, built_library
from tests.extensions.px4.support import HERE, LOGGED, TEMPLATES, px4_files, status_fields

FLAGS: Final = ("-O2", "-ffp-contract=off", "-Wl,-Bsymbolic", "-Wall", "-Wextra", "-Wno-unused-parameter")


def build_px4(settings: Settings, miscompiled: tuple[str, str] = ("", "")) -> Path:
    """Return the library of a module on the desk, built unless it is cached; raises BuildError, CacheError.

    miscompiled: what a compiler makes of nmpc.c that computes other bits: a text, and what takes its place.
    """
    files = px4_files(settings)
    files["nmpc.c"] = files["nmpc.c"].replace(*miscompiled)
    folder = resources.files(desk)
    files |= {name: folder.joinpath(name).read_text("utf-8") for name in (*SOURCES, *HEADERS)}
    stand_ins = folder.joinpath("stand_ins").iterdir()
    files |= {f"stand_ins/{one.name}": one.read_text("utf-8") for one in stand_ins}
    files["surroundings.cpp"] = (HERE / "surroundings.cpp").read_text("utf-8")
    flags = (*FLAGS, "-I.", "-Istand_ins", "-Ipx4")
    source = LibrarySource("px4", files, lambda: files, flags, interface(), ("-lm", "-lstdc++"))
    return built_library(source, host_toolchain())


class Px4Desk(Desk):
    """A drone under PX4 that hovers in Position mode at 1 m, with the module started."""

    fields: Final = status_fields((TEMPLATES / "msg" / "McNmpcStatus.msg.j2").read_text("utf-8"))[1]
    """Type, name and count of the fields of mc_nmpc_status."""

    def __init__(self, library: Path, seed: int = 0, **conditions: Any) -> None:
        """Take off; raises FlightError, CacheError."""
        super().__init__(library, DeskConditions(seed=seed, camera_offset_ms=3, **conditions))
        self.run(1000)
        self.take_off(1.0, 2.0)
        self.run(6000)
        self.set("px4.hover", self["throttle"])
        self.run(600)

    def __getitem__(self, name: str) -> float:
        """Return what PX4 has: a field of mc_nmpc_status as s.FIELD, or of what surrounds the module."""
        return self.log(f"px4.{name}")

    def select(self, mode: int, milliseconds: int = 12) -> "Px4Desk":
        """Turn the pilot's switch, and let time pass."""
        self.set("px4.mode", mode)
        self.run(milliseconds)
        return self

    def be_strong(self, hover: float) -> None:
        """Become a drone that hovers with another share of its throttle, which PX4 knows."""
        self.set("px4.strength", self["throttle"] / hover)
        self.set("px4.hover", hover)
        self.run(600)

    def status(self) -> dict[str, float]:
        """Return the fields of mc_nmpc_status, but its times."""
        names = [
            f"{name}{at}"
            for kind, name, count in self.fields
            if kind in LOGGED
            for at in ([f"[{k}]" for k in range(count)] or [""])
        ]
        return {name: self[f"s.{name}"] for name in names}

    @property
    def angles_deg(self) -> FloatArray:
        """Roll and pitch (2,) of the attitude set-point."""
        return np.degrees([self["roll"], self["pitch"]])
