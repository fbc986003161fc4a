"""What `design` says of margins: the reserve of an axis, and which property is in the way."""

import math
from collections.abc import Mapping
from typing import Any

import pytest

from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.margins.axis_margins import AxisMargins, HeightMargins, Margins, Poles
from mambo_sil.experiment.margins.corners import at_ends, corners
from mambo_sil.experiment.margins.loop_margins import LoopMargins
from mambo_sil.experiment.margins.many_drones import measure_drone
from mambo_sil.flight.names import DEFAULT_SENSORS
from mambo_sil.model.derive.derived_margins import JudgedMargins, _reserve, _without, judge_margins
from tests.support.derived import settings_for
from tests.support.scenarios import CRAZYFLIE, changed

GENERIC = vehicle_toml.preset("generic")


def axis(*, gains: tuple[float, ...], delay_s: float = 9.0, growth_1_s: float = -1.0) -> Margins:
    """Return the margins of a loop broken at the command and, with a second gain, at the motors."""
    loops = [
        LoopMargins(**dict.fromkeys(LoopMargins.model_fields, 7.0) | {"gain_up": gain, "delay_s": late_s})
        for gain, late_s in zip(gains, (delay_s, 1e-6), strict=False)
    ]
    poles = Poles(least_damping=0.5, least_damped_rad_s=1.0, slowest_s=1.0, growth_1_s=growth_1_s)
    shared: dict[str, Any] = {"poles": poles, "gust_to_place_s2": 1.0, "noise": {}, "stable": growth_1_s < 0}
    if len(loops) == 1:
        return HeightMargins(**shared, command=loops[0], gust_to_thrust=1.0, sensed_variation_m_s2=None)
    return AxisMargins(
        **shared,
        axis="roll",
        command=loops[0] if loops else None,
        motors=loops[1] if loops else None,
        gust_to_command_rad_s2_m=1.0,
        sensed_variation_rad=None,
    )


@pytest.mark.parametrize(
    ("margins", "reserve"),
    [
        (axis(gains=(3.0, 6.0)), 2.0),
        (axis(gains=(6.0, 1.5)), 1.0),
        (axis(gains=(1.2,)), 0.8),
        (axis(gains=(6.0, 6.0), delay_s=0.06), 2.0),
        (axis(gains=(3.0,), delay_s=0.015), 0.5),
        (axis(gains=(math.inf,), delay_s=math.inf), math.inf),
        (axis(gains=(), growth_1_s=0.3), -0.3),
    ],
)
def test_the_reserve_is_the_least_margin_over_what_is_warned_of(margins: Margins, reserve: float) -> None:
    """1.5 times the gain wherever the loop is broken, 30 ms at the command; minus the growth if unstable."""
    assert _reserve(margins) == pytest.approx(reserve)


THRUST = "\n[thrust]\nlag_s = 0.06\ndead_time_s = 0.02\n"
FLOWN = vehicle_toml.parse(VEHICLES.text("crazyflie-flown") + THRUST, "mine", "mine.toml")


@pytest.mark.parametrize(
    ("drone", "height", "changes"),
    [
        (
            FLOWN,
            True,
            {
                "dead_time_s of roll and pitch": {
                    "attitude": {name: {"dead_time_s": 0.0} for name in ("roll", "pitch")}
                },
                "thrust.dead_time_s = 0.02": {"thrust": {"dead_time_s": 0.0}},
                "sensors.kind": {"sensors": {"kind": "true"}},
            },
        ),
        (
            FLOWN,
            False,
            {
                "dead_time_s of roll and pitch": {
                    "attitude": {name: {"dead_time_s": 0.0} for name in ("roll", "pitch")}
                },
                "sensors.kind": {"sensors": {"kind": "true"}},
            },
        ),
        (
            CRAZYFLIE,
            True,
            {"rotors.lag_s": {"rotors": {"lag_s": 0.0}}, "sensors.kind": {"sensors": {"kind": "true"}}},
        ),
    ],
)
def test_a_drone_without_a_property_differs_in_nothing_else(
    drone: VehicleFile, height: bool, changes: dict[str, dict[str, Any]]
) -> None:
    """Each property that it has, in words, and the drone without; those of the thrust with a height only."""
    found = dict(_without(drone, height=height))
    assert len(found) == len(changes)
    for (words, other), (begin, sections) in zip(found.items(), changes.items(), strict=True):
        assert words.startswith(begin)
        if "sensors" in sections:
            expected = drone.model_dump() | {"sensors": {"kind": "true"}}
            assert other.model_dump(exclude_none=True) == VehicleFile.model_validate(expected).model_dump(
                exclude_none=True
            )
        else:
            assert other == changed(drone, **sections)


@pytest.mark.parametrize("one", ["roll", "pitch"])
def test_a_dead_time_of_one_axis_is_a_property_too(one: str) -> None:
    """And without any, it is none."""
    prompt = {"gain": 1.0, "dead_time_s": 0.0}
    still = {"roll": prompt | {"lag_s": 0.1}, "pitch": prompt | {"lag_s": 0.12}}
    axes = still | {one: still[one] | {"dead_time_s": 0.03}}
    late = dict(_without(changed(GENERIC, attitude=axes), height=False))
    none = dict(_without(changed(GENERIC, attitude=still), height=False))
    assert [words.split(",")[0] for words in late if "dead" in words] == ["dead_time_s of roll and pitch"]
    ends = ("0.03 and 0.0", "0.0 and 0.03")
    assert next(iter(late)).endswith(ends[one == "pitch"])
    assert not any("dead" in words for words in none)


def test_a_thrust_without_a_dead_time_is_none() -> None:
    """Its lag alone is no property."""
    drone = changed(FLOWN, thrust={"dead_time_s": 0.0})
    assert not any("thrust" in words for words in dict(_without(drone, height=True)))


def blind(**sections: Any) -> VehicleFile:
    """Return a drone whose true state is seen."""
    document = changed(GENERIC, **sections).model_dump(exclude={"sensors"})
    return VehicleFile.model_validate(document)


def of_gains(roll: float, pitch: float, lag_s: float = 0.15) -> VehicleFile:
    """Return a drone without sensors and dead times, with gains of the attitude."""
    axis = {"lag_s": lag_s, "dead_time_s": 0.0}
    return blind(attitude={"roll": axis | {"gain": roll}, "pitch": axis | {"gain": pitch}})


@pytest.mark.parametrize("axis", [0, 1])
def test_a_warning_begins_where_a_loop_tolerates_too_little(axis: int) -> None:
    """Of one axis, whose gain is raised until its loop tolerates less than 30 ms of delay."""
    settings = settings_for(of_gains(0.5, 0.5))
    for gain, reserve in ((1.2647, 1.05), (1.3208, 0.95)):
        gains = [0.5, 0.5]
        gains[axis] = gain
        found, warned = judge_margins(settings, of_gains(*gains)), reserve < 1.0
        assert min(map(_reserve, found.axes)) == pytest.approx(reserve, abs=2e-3)
        assert (found.warning is not None) is warned
        last = found.lines()[-1]
        if warned:
            assert last == f"warning: {found.warning}"
            assert last.endswith("30 ms more delay; no single property is the cause")
        else:
            assert last.startswith(f"least margin: {('roll', 'pitch')[axis]}, 3")
            assert last.endswith(" ms more delay at the command")


@pytest.mark.parametrize(
    ("gain", "dead_time_s", "late_s", "begin"),
    [(1.0, 0.1, 0.004, "dead_time_s of roll"), (1.5, 0.002, 0.1, "sensors.kind")],
)
def test_the_cause_is_the_property_without_which_most_is_left(
    gain: float, dead_time_s: float, late_s: float, begin: str
) -> None:
    """Of sensors and dead time; the settings are derived again, and sensors that stay are seen through."""
    axis = {"gain": gain, "lag_s": 0.15, "dead_time_s": dead_time_s}
    sensors = {"position_delay_s": late_s}
    drone = changed(GENERIC, attitude={"roll": axis, "pitch": axis}, sensors=sensors)
    found = judge_margins(settings_for(of_gains(gain / 2.5, gain / 2.5)), drone)
    left = {
        words: min(map(_reserve, measure_drone(settings_for(other), other, seen)))
        for (words, other), seen in zip(
            _without(drone, height=False), (DEFAULT_SENSORS["mocap"], "true"), strict=True
        )
    }
    cause = max(left, key=lambda words: left[words])
    assert cause.startswith(begin)
    assert found.warning is not None
    assert f"the main cause is {cause}: without it" in found.warning


def judged(dead_time_s: float) -> JudgedMargins:
    """Return what is said of the settings derived for a drone with that dead time."""
    drone = changed(GENERIC, attitude={name: {"dead_time_s": dead_time_s} for name in ("roll", "pitch")})
    return judge_margins(settings_for(drone), drone)


def test_a_quick_drone_is_not_warned_of() -> None:
    """Each axis has its verdict, through the sensors of the drone."""
    found = judged(0.0)
    assert (found.warning, found.where) == (None, "through sensors mocap")
    assert min(map(_reserve, found.axes)) >= 1.0
    *axes, least = found.lines()
    assert len(axes) == len(found.axes)
    assert all(line.endswith(f"({found.where})") for line in axes)
    assert least.startswith("least margin: ")


def reserve_of(drone: VehicleFile, ends: Mapping[str, int]) -> float:
    """Return the least reserve at ends of the intervals, with its own settings."""
    settings = settings_for(drone)
    return min(map(_reserve, measure_drone(settings, at_ends(drone, ends), "true")))


@pytest.mark.parametrize(
    ("gain_width", "dead_time_s"), [(0.2, 0.0), (0.6, 0.0), pytest.param(0.6, 0.15, marks=pytest.mark.long)]
)
def test_drones_are_judged_at_the_worst_ends_of_intervals(gain_width: float, dead_time_s: float) -> None:
    """Each axis at its own; the cause is that without which the worst drone stands most."""
    axis = {"gain": 1.0, "lag_s": 0.15, "dead_time_s": dead_time_s}
    uncertainty = {"roll_gain": gain_width, "pitch_dead_time_s": 0.01}
    sections = {"attitude": {"roll": axis, "pitch": axis}, "uncertainty": uncertainty}
    drone = blind(**sections)
    settings = settings_for(drone)
    shares: list[float] = []
    found, ends = judge_margins(settings, drone, shares.append), list(corners(drone))
    assert shares == [number / len(ends) for number in range(1, len(ends) + 1)]
    measured = [measure_drone(settings, at_ends(drone, one), "true") for one in ends]
    assert [_reserve(axis) for axis in found.axes] == [
        min(map(_reserve, of_one)) for of_one in zip(*measured, strict=True)
    ]
    assert found.where == "true state, at the worst of the intervals in [uncertainty]"
    reserves = [min(map(_reserve, axes)) for axes in measured]
    assert (found.warning is None) == (min(reserves) >= 1.0)
    if found.warning is None:
        return
    worst = ends[reserves.index(min(reserves))]
    prompt = changed(drone, attitude={name: {"dead_time_s": 0.0} for name in ("roll", "pitch")})
    without = {
        "the interval of attitude.roll.gain": reserve_of(drone, {**worst, "gain": 0}),
        "the interval of attitude.pitch.dead": reserve_of(drone, {**worst, "dead_time_s": 0}),
    }
    if dead_time_s:
        without["dead_time_s of roll and pitch"] = reserve_of(prompt, worst)
    cause = max(without, key=lambda words: without[words])
    assert f"the main cause is {cause}" in found.warning
    enough = "large enough" if without[cause] >= 1.0 else "still too small"
    assert found.warning.endswith(f"without it the margins are {enough}")


def test_an_interval_is_taken_away_at_the_worst_ends_of_the_others() -> None:
    """Roll, with settings for less gain, tolerates too little even without the dead time that it may have."""
    axis = {"gain": 0.5, "lag_s": 0.15, "dead_time_s": 0.0}
    widths = {"roll_gain": 0.1, "roll_dead_time_s": 0.035}
    drone = blind(attitude={"roll": axis | {"gain": 1.3}, "pitch": axis}, uncertainty=widths)
    settings = settings_for(of_gains(0.5, 0.5))
    late, strong = (
        min(map(_reserve, measure_drone(settings, at_ends(drone, ends), "true")))
        for ends in ({"gain": 0, "dead_time_s": 1}, {"gain": 1, "dead_time_s": 0})
    )
    assert late < strong < 1.0
    assert str(judge_margins(settings, drone).warning).endswith(
        "the main cause is the interval of attitude.roll.dead_time_s +- 0.035: "
        "without it the margins are still too small"
    )
