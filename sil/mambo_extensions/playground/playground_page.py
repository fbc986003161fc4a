"""The page: modules, records, sliders and digests as data of one HTML file."""

import base64
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np
from pydantic import BaseModel, ConfigDict

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.limits_constants import HEIGHT_LIMITS, LIMITS, PLACES
from mambo_codegen.port.taken import AHEAD_S
from mambo_codegen.settings.model import Settings
from mambo_extensions.playground import bit_proof
from mambo_extensions.playground.dials import Dial, dials, target_dials, weight_dial
from mambo_extensions.playground.page_controllers import PageController
from mambo_extensions.playground.wasm_build import module
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.columns import LEVEL, SPACE, TARGET
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.engine_library import ffi, record_type
from mambo_sil.flight.engine.native import pd_function
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.polynomials import PiecesInSpace
from mambo_sil.flight.trajectories import is_spatial
from mambo_sil.results.html_page import render_page
from mambo_sil.results.summary import Summary

STYLES: Final = ("style.css", "playground.css")
SCRIPTS: Final = (
    *("module.js", "drone.js", "target.js", "world.js", "view.js", "marks.js", "field.js", "plots.js"),
    *("pointer.js", "controls.js", "playground.js"),
)
"""The files of the page's script, in their order."""
_PD_HUES: Final = {"pd": 1, "pd-feedforward": 2, "pid-feedforward": 3}
"""Colours of the PDs on all pages."""
_DASHES: Final = ((), (7, 3), (2, 3), (9, 3, 2, 3))
"""Lengths of dashes and gaps of each controller's line, in pixels, for whoever cannot tell colours."""
_TRACED: Final = ("position_m", "velocity_m_s", "height_m", "climb_m_s")
"""What a trace has of a target."""
_CIRCLE: Final = (1.2, 0.8)
"""Radius in m and rate in rad/s."""
_DRAWN: Final = 200
"""Places of a plan that the page draws."""
_SAME: Final = 1e-3
"""In m and m/s, by which the ends of a plan that repeats may differ."""


class FlownController(BaseModel):
    """One controller of a page. `trace_sha256` is `Trace.digest` of the flight that proves the bits."""

    model_config = ConfigDict(frozen=True)

    source: str
    settings: str | None
    """Digest of the settings; None for a PD."""
    wasm_bytes: int
    trace_sha256: str


class PlaygroundSummary(Summary):
    """A page on which controllers fly."""

    command = "playground"

    page: str
    """Name of the HTML file."""
    bytes: int
    vehicle: VehicleFile
    controllers: list[FlownController]


def playground_page(
    found: Sequence[PageController],
    drone: VehicleFile,
    progress: Callable[[float], None],
    plan: PiecesInSpace | None = None,
) -> tuple[str, list[FlownController]]:
    """Return the HTML page on which the controllers fly a drone, and what it says of each.

    plan: what the target follows at first; None: an eight.

    Raises FlightError if the drone and the update period do not fit, BuildError and CacheError.
    """
    flight = bit_proof.proof_flight(drone, found)
    flown, drones = [], []
    for number, (one, hue) in enumerate(zip(found, _hues(found), strict=True)):
        wasm, digest = module(one), bit_proof.native_digest(flight, one)
        settings = one.kind.digest if isinstance(one.kind, Settings) else None
        flown.append(
            FlownController(source=one.source, settings=settings, wasm_bytes=len(wasm), trace_sha256=digest)
        )
        drones.append(
            _drone(one, flight) | {"hue": hue, "dash": _DASHES[number], "wasm": _text(wasm), "digest": digest}
        )
        progress((number + 1) / len(found))
    sliders = _sliders(flight, found)
    context = {
        "data": _simulation(flight)
        | {"drones": drones, "dials": [asdict(dial) for dial in sliders]}
        | {"plan": None if plan is None else _plan(plan), "first": "eight" if plan is None else "plan"},
        "flown": list(zip(drones, flown, strict=True)),
        "dials": sliders,
        "spatial": is_spatial(flight.trajectory),
        "vehicle": drone.name,
        "duration_s": bit_proof.DURATION_S,
        "generator": PlaygroundSummary.model_fields["generator"].default,
    }
    return render_page("playground.html.j2", context, "playground", STYLES, SCRIPTS), flown


def _hues(found: Sequence[PageController]) -> list[int]:
    """Return the number of each controller's colour; a PD has the same on every page."""
    taken = {_PD_HUES[one.source] for one in found if one.source in _PD_HUES}
    others = (hue for hue in (0, 3, 1, 2) if hue not in taken)
    return [_PD_HUES[one.source] if one.source in _PD_HUES else next(others) for one in found]


def _sliders(flight: Flight, found: Sequence[PageController]) -> list[Dial]:
    weights = [
        weight_dial(one.kind, one.title, number)
        for number, one in enumerate(found)
        if isinstance(one.kind, Settings) and method_of(one.kind).weight_limits
    ]
    course = target_dials(spatial=is_spatial(flight.trajectory))
    return [*course, *dials(bit_proof.calm(flight)), *weights]


def _drone(one: PageController, flight: Flight) -> dict[str, Any]:
    """Return title, type of the C's numbers, and in base64 the record of a law without a model.

    `metre` is 1 m in the numbers of the C's limits; None: the controller has none. `commands_thrust`: whether
    it does, and reads the height of its target. `walls`: floor and ceiling in m, if it has them.
    """
    if isinstance(one.kind, Settings):
        method = method_of(one.kind)
        fence = one.kind.limits.fence
        metre = method.numbers.quantize(np.ones(1), ("position",)).item() if method.limiting else None
        return {
            "title": one.title,
            "scalar": one.kind.code.scalar,
            "constants": None,
            "metre": metre,
            "commands_thrust": one.commands_thrust,
            "walls": (fence.floor_m, fence.ceiling_m) if fence.floor_m < fence.ceiling_m else (),
        }
    constants = pd_function(pd_controller(one.kind, flight))[1]
    return {
        "title": one.title,
        "scalar": "float64",
        "constants": _text(bytes(ffi.buffer(constants))),
        "metre": None,
        "commands_thrust": False,
        "walls": (),
    }


def _simulation(flight: Flight) -> dict[str, Any]:
    """Return what all drones of the page share; records and arrays in base64."""
    quiet_simulation, quiet = bit_proof.records(bit_proof.calm(flight))
    simulation, own = bit_proof.records(flight)
    read = bit_proof.inputs(flight)
    return {
        "period_s": flight.update_period_s,
        "ahead_s": AHEAD_S,
        "limits": {"count": len(LIMITS) + len(HEIGHT_LIMITS), "fence": PLACES["fence_min_m"]},
        "columns": {
            "level": LEVEL.target,
            "target": SPACE.target,
            "known": TARGET["known"].start,
            "traced": [column for name in _TRACED for column in range(SPACE.target)[TARGET[name]]],
        },
        "spatial": is_spatial(flight.trajectory),
        "height_m": HOVER_HEIGHT_M,
        "ticks": flight.ticks_per_update,
        "offsets": {
            "simulation": _offsets("engine_simulation_t"),
            "flight": _offsets("engine_flight_t"),
        },
        "simulation": _text(quiet_simulation.tobytes()),
        "flight": _text(quiet.tobytes()),
        "curves": {"eight": (bit_proof.HALF_WIDTH_M, bit_proof.RATE_RAD_S), "circle": _CIRCLE},
        "swing_rad_s": bit_proof.SWING_RAD_S,
        "proof": {
            "updates": len(read.targets),
            "simulation": _text(simulation.tobytes()),
            "flight": _text(own.tobytes()),
            "targets": _text(read.targets.tobytes()),
            "sensors": _text(read.sensors.tobytes()),
            "gusts": _text(read.gusts.tobytes()),
        },
    }


def _plan(plan: PiecesInSpace) -> dict[str, Any]:
    """Return what the target reads of a plan: coefficients by axis and piece, and whether it repeats.

    It does if it ends as it begins: in the same place, with the same velocity. `path` has places to draw.
    """
    last_s = plan.duration_s
    first, last = (
        np.concatenate([plan.target(time_s), plan.vertical(time_s)[:2]])
        for time_s in (0.0, np.nextafter(last_s, 0.0))
    )
    return {
        "ends": np.cumsum([piece.duration_s for piece in plan.pieces]).tolist(),
        "axes": [[getattr(piece, axis) for piece in plan.pieces] for axis in ("north", "east", "height")],
        "repeats": bool(np.allclose(first, last, atol=_SAME)),
        "path": plan.target(np.linspace(0.0, last_s, _DRAWN))[:, :2].round(3).tolist(),
    }


def _offsets(record: str) -> dict[str, int]:
    """Return the offset of each member of a record, in bytes."""
    fields = record_type(record).fields
    assert fields is not None
    return {name: int(field[1]) for name, field in fields.items()}


def _text(content: bytes) -> str:
    return base64.b64encode(content).decode()
