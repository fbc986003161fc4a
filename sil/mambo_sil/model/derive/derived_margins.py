"""The margins of derived settings on their drone, what is in the way of more, and why a height is missing."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.key import spell
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import FirstOrderAttitude
from mambo_sil.experiment.margins.axis_margins import PLACES, Margins
from mambo_sil.experiment.margins.corners import Ends, at_ends, corners, intervals, uncertain
from mambo_sil.experiment.margins.many_drones import measure_drone
from mambo_sil.experiment.margins.margin_figures import verdict
from mambo_sil.flight.names import DEFAULT_SENSORS, SensorsName
from mambo_sil.model.derive.derived_settings import controller_text

LEAST_GAIN: Final = 1.5
"""A loop that tolerates less of its gain is warned of, wherever it is broken."""
LEAST_DELAY_S: Final = 0.03
"""The same for the delay at the command."""

Axes = Sequence[Margins]
MORE_MASS, LESS_THRUST = 0.2, 0.05
"""Shares by which a mass or a thrust differs from that in the file."""
FIX: Final = "write [thrust] with lag_s and gain into its file"


@dataclass(frozen=True)
class JudgedMargins:
    """The margins of settings on a drone, at the worst ends of its intervals, with a warning or None."""

    where: str
    axes: Axes
    warning: str | None

    def lines(self) -> list[str]:
        """Return what `design` prints: each axis, the loop whose margin is the least, and the warning."""
        said = [f"{verdict(axis)} ({self.where})" for axis in self.axes]
        least = min((one for axis in self.axes for one in _reserves(axis)), default=None)
        if least is not None and all(axis.stable for axis in self.axes):
            said.append(f"least margin: {least[1]}")
        return [*said, *([] if self.warning is None else [f"warning: {self.warning}"])]


def judge_margins(
    settings: Settings, drone: VehicleFile, progress: Callable[[float], None] = lambda _: None
) -> JudgedMargins:
    """Return the margins of derived settings on their drone, through its own sensors.

    Of a drone with intervals, which `identify` writes, each axis has the margins of the worst of their ends;
    `progress` is called with the share of these that is measured. Raises BuildError, CacheError.
    """
    sensors = DEFAULT_SENSORS[drone.sensors.kind]
    where = "true state" if sensors == "true" else f"through sensors {sensors}"
    if drone.uncertainty is not None:
        where = f"{where}, at the worst of the intervals in [uncertainty]"
    drone = uncertain(drone, height=settings.height is not None)
    given = list(corners(drone)) if drone.uncertainty else [{}]
    found = []
    for ends in given:
        found.append((ends, measure_drone(settings, _at(drone, ends), sensors)))
        progress(len(found) / len(given))
    axes = [min(of_one, key=_reserve) for of_one in zip(*(measured for _, measured in found), strict=True)]
    if min(map(_reserve, axes)) >= 1.0:
        return JudgedMargins(where, axes, None)
    worst, _ = min(found, key=lambda one: _reserve_of(one[1]))
    short = (
        f"a loop tolerates less than {LEAST_GAIN:g} times the gain or {1e3 * LEAST_DELAY_S:.0f} ms more delay"
    )
    return JudgedMargins(where, axes, f"{short}; {_in_the_way(settings, drone, worst, sensors)}")


def _at(drone: VehicleFile, ends: Ends) -> VehicleFile:
    return at_ends(drone, ends) if ends else drone


def _reserves(axis: Margins) -> Iterator[tuple[float, str]]:
    """Yield the finite margins of an axis, each over the least that is not warned of, and in words."""
    for loop, where in zip((axis.command, axis.motors), PLACES.values(), strict=True):
        if loop is not None and math.isfinite(loop.gain_up):
            yield loop.gain_up / LEAST_GAIN, f"{axis.axis}, {loop.gain_up:.2g} times the gain at {where}"
    if axis.command is not None and math.isfinite(axis.command.delay_s):
        delay_s = axis.command.delay_s
        yield delay_s / LEAST_DELAY_S, f"{axis.axis}, {1e3 * delay_s:.0f} ms more delay at the command"


def _reserve(axis: Margins) -> float:
    """Return the least margin of an axis over the least that is not warned of; 0 if it is unstable."""
    if not axis.stable:
        return -axis.poles.growth_1_s
    return min((reserve for reserve, _ in _reserves(axis)), default=math.inf)


def _reserve_of(axes: Axes) -> float:
    return min(map(_reserve, axes))


def _in_the_way(settings: Settings, drone: VehicleFile, worst: Ends, sensors: SensorsName) -> str:
    """Return in words which property of a drone costs its loops most, at the worst ends of its intervals.

    Settings do not depend on an interval; without another property they are derived again.
    """
    found = []
    for name, keys in (intervals(drone) if worst else {}).items():
        words = ", ".join(f"{key} +- {spell(width)}" for key, width in keys if width)
        certain = _at(drone, {**worst, name: 0})
        found.append((_reserve_of(measure_drone(settings, certain, sensors)), f"the interval of {words}"))
    for words, other in _without(drone, height=settings.height is not None):
        seen: SensorsName = sensors if other.sensors.kind == drone.sensors.kind else "true"
        derived = controller_toml.parse(controller_text(other, drone.name), drone.name)
        found.append((_reserve_of(measure_drone(derived, _at(other, worst), seen)), words))
    if not found:
        return "no single property is the cause"
    reserve, words = max(found)
    enough = "large enough" if reserve >= 1.0 else "still too small"
    return f"the main cause is {words}: without it the margins are {enough}"


def _without(drone: VehicleFile, *, height: bool) -> Iterator[tuple[str, VehicleFile]]:
    """Yield properties in words, and the drone without each; the thrust's only with a height."""
    document: dict[str, Any] = drone.model_dump(exclude_none=True)
    if isinstance(drone.attitude, FirstOrderAttitude):
        attitude = document["attitude"]
        quick = {axis: attitude[axis] | {"dead_time_s": 0.0} for axis in ("roll", "pitch")}
        if quick["roll"] != attitude["roll"] or quick["pitch"] != attitude["pitch"]:
            times = " and ".join(spell(attitude[axis]["dead_time_s"]) for axis in ("roll", "pitch"))
            other = VehicleFile.model_validate(document | {"attitude": attitude | quick})
            yield f"dead_time_s of roll and pitch, {times}", other
    if height and drone.thrust is not None and drone.thrust.dead_time_s:
        thrust = document["thrust"] | {"dead_time_s": 0.0}
        other = VehicleFile.model_validate(document | {"thrust": thrust})
        yield f"thrust.dead_time_s = {spell(drone.thrust.dead_time_s)}", other
    if drone.rotors is not None and drone.rotors.lag_s:
        rotors = document["rotors"] | {"lag_s": 0.0}
        other = VehicleFile.model_validate(document | {"rotors": rotors})
        yield f"rotors.lag_s = {spell(drone.rotors.lag_s)}", other
    if drone.sensors.kind != "true":
        other = VehicleFile.model_validate(document | {"sensors": {"kind": "true"}})
        yield f"sensors.kind = {spell(drone.sensors.kind)}", other


def missing_height(drone: VehicleFile) -> str:
    """Return why the settings for a drone without `[height]` have none, and how far it then sinks.

    Its altitude loop has no integral: a thrust that is missing is `altitude.p_n_m` times the sinking.
    """
    if drone.rotors is not None or drone.thrust is not None:
        most_m_s2 = drone.largest_thrust_n / drone.body.mass_kg
        return f"height: not in the settings, since the largest thrust, {most_m_s2:.3g} m/s^2, hardly climbs"
    cost = ""
    if gain_n_m := drone.altitude.p_n_m:
        heavy_mm, weak_mm = (1e3 * share * drone.weight_n / gain_n_m for share in (MORE_MASS, LESS_THRUST))
        cost = (
            f"; by its altitude loop the drone sinks by {heavy_mm:.0f} mm under {100.0 * MORE_MASS:g} % more "
            f"mass, by {weak_mm:.0f} mm with {100.0 * LESS_THRUST:g} % less thrust"
        )
    return f"height: not in the settings, since the thrust is not known{cost}: {FIX}"
