"""Scenarios that between them use every line of the simulation."""

from typing import Any, Final

from hypothesis import strategies as st

from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.names import CURVE_NAMES
from mambo_sil.flight.scenario import OF_THE_VEHICLE, Scenario

TRUTH: Final = (
    Scenario(
        duration_s=2.0,
        seed=3,
        trajectory="circle",
        size_m=1.0,
        rate_rad_s=1.5,
        start_velocity_m_s=(0.2, -0.3, 0.1),
        start_tilt_rad=(0.1, -0.05),
        yaw_rad=0.8,
        yaw_rate_rad_s=1.0,
        motor_lag_s=0.03,
        push_m_s2=(0.5, -0.2),
        wind_speed_m_s=4.0,
        wind_direction_rad=2.0,
        battery_sag_1_s=0.02,
        payload_kg=0.02,
        payload_time_s=0.5,
        impulse_n_s=(0.02, -0.01, 0.015),
        impulse_time_s=1.0,
        command_delay_ticks=3,
        dropped_share=0.2,
    ),
    Scenario(
        duration_s=2.0,
        seed=4,
        impulse_n_s=(0.0, 0.03, 0.0),
        impulse_time_s=0.5,
        yaw_rad=-2.5,
        start_tilt_rad=(0.0, 0.4),
        wind_speed_m_s=2.0,
        dropped_share=0.1,
    ),
    Scenario(
        duration_s=2.0, yaw_rad=0.3, command_delay_ticks=200, impulse_n_s=(0.02, 0.0, 0.0), impulse_time_s=1.2
    ),
    Scenario(duration_s=2.0, start_offset_m=(9999.0, 0.0, 0.0), start_velocity_m_s=(5.0, 0.0, 0.0)),
    Scenario(
        duration_s=2.0,
        start_tilt_rad=(1.5, 1.2),
        start_offset_m=(0.0, 0.0, 1.0),
        impulse_n_s=(0.0, 0.0, 0.01),
        impulse_time_s=0.3,
    ),
)
"""Without sensors: all disturbances; a hard turn; the longest delay; one lost; one upside down; pushes."""

SENSED: Final = (
    Scenario(
        duration_s=4.0,
        seed=5,
        sensors="mambo-derotated",
        yaw_rad=0.6,
        wind_speed_m_s=3.0,
        impulse_n_s=(0.05, 0.02, -0.06),
        impulse_time_s=1.0,
        accelerometer_bias_m_s2=(0.1, -0.1, 0.05),
        gyro_bias_rad_s=(0.01, 0.02, -0.01),
    ),
    Scenario(
        duration_s=4.0, seed=6, sensors="mambo-derotated", noise_scale=0.01, start_offset_m=(0.0, 0.0, 0.75)
    ),
    Scenario(duration_s=4.0, seed=7, sensors="mambo-derotated", noise_scale=0.0, start_tilt_rad=(0.7, 0.65)),
    Scenario(duration_s=4.0, seed=8, sensors="mambo-derotated", start_velocity_m_s=(7.0, 1.0, 2.5)),
)
"""Through sensors: gusts and a push; low over the ground; tilted beyond the gate of the flow; too fast."""

COUPLED: Final = (Scenario(duration_s=4.0, seed=9, sensors="mambo", dropped_share=0.05),)
TAKE_OFF: Final = (Scenario(duration_s=1.0, seed=1, sensors="mambo-derotated", start="take-off"),)


CRAZYFLIE: Final = vehicle_toml.load("crazyflie")
FLOWN: Final = vehicle_toml.load("crazyflie-flown")


def changed(drone: VehicleFile, **sections: Any) -> VehicleFile:
    """Return a drone with other values in some sections, which may be nested."""

    def merge(old: Any, new: Any) -> Any:
        return (
            old | {key: merge(old.get(key, {}), value) for key, value in new.items()}
            if isinstance(new, dict)
            else new
        )

    return VehicleFile.model_validate(merge(drone.model_dump(exclude_none=True), sections))


LIMITED: Final = changed(
    CRAZYFLIE,
    attitude={
        "rate_hz": 200,
        "rate_max_rad_s": 1.5,
        "output_max": 9000.0,
        "roll": {"d": 0.02, "integral_limit_rad_s": 0.02, "rate_integral_limit_rad": 0.01},
        "pitch": {"p_1_s": 5.0, "d": 0.01, "integral_limit_rad_s": 0.03, "rate_integral_limit_rad": 0.02},
        "yaw": {"integral_limit_rad_s": 0.01, "rate_d_s2_rad": 3.0, "rate_integral_limit_rad": 0.03},
    },
    sensors={"position_rate_hz": 200, "position_delay_s": 0.02, "velocity_filter_s": 0.0},
)
"""A cascade at all its limits; motion capture at every tick, without a filter."""
HEAVY: Final = changed(
    CRAZYFLIE, body={"mass_kg": 0.052}, altitude={"thrust_max_n": 0.55}, rotors={"mixer": "yaw-last"}
)
"""A drone whose weight leaves its motors little for the heading, which its mixer takes from first."""
LATE: Final = changed(
    FLOWN,
    body={"drag_1_s": 0.4},
    attitude={
        "rate_hz": 500,
        "roll": {"gain": 0.9, "lag_s": 0.03, "dead_time_s": 0.0613},
        "pitch": {"gain": 1.1, "lag_s": 0.07, "dead_time_s": 0.1005},
        "yaw_lag_s": 0.3,
        "roll_trim_rad": 0.013,
        "pitch_trim_rad": -0.021,
    },
    sensors={"position_rate_hz": 50, "position_delay_s": 0.006, "lever_m": (0.02, -0.03, 0.05)},
)
"""Two different angles with trims, whose dead times are no multiples of a tick; markers below and beside."""
LAGGING: Final = changed(LATE, thrust={"gain": 0.9, "lag_s": 0.06, "dead_time_s": 0.0151})
"""The same, with a thrust that lags."""


FELT: Final = VehicleFile.model_validate(
    LATE.model_dump(exclude_none=True)
    | {
        "attitude": LATE.attitude.model_dump() | {"rate_hz": 200},
        "sensors": vehicle_toml.load("mambo").sensors.model_dump(),
    }
)
"""The same with the instruments of the Mambo, which feel the body's rates."""
INSTRUMENTS: Final = tuple(
    Scenario(
        vehicle=FELT,
        duration_s=2.0,
        sensors="mambo-derotated",
        seed=seed,
        start_tilt_rad=(0.2, -0.3),
        yaw_rate_rad_s=2.0,
        noise_scale=0.1,
    )
    for seed in (6, 7)
)


def captured(drone: VehicleFile) -> tuple[Scenario, ...]:
    """Return flights with motion capture: all disturbances; a calm one; one upside down."""
    common: dict[str, Any] = {"vehicle": drone, "duration_s": 2.0, "sensors": "mocap"}
    return (
        TRUTH[0].model_copy(
            update=common | {key: getattr(Scenario(vehicle=drone), key) for key in OF_THE_VEHICLE}
        ),
        Scenario(
            **common, seed=4, yaw_rad=0.4, thrust_factor_n_s2=0.9 * Scenario(vehicle=drone).thrust_factor_n_s2
        ),
        Scenario(**common, seed=5, start_tilt_rad=(1.4, 1.1), yaw_rate_rad_s=5.0, noise_scale=0.5),
    )


SPACE: Final = (
    *captured(CRAZYFLIE)[:2],
    *(
        Scenario(
            vehicle=CRAZYFLIE,
            duration_s=2.0,
            sensors="mocap",
            seed=6,
            trajectory=curve,
            size_m=size_m,
            rate_rad_s=1.7,
            start_offset_m=(0.1, 0.0, z_m),
            start_velocity_m_s=(0.3, -0.2, 0.4),
            start_tilt_rad=(0.1, -0.2),
            vertical_gust_m_s2=gust_m_s2,
            vertical_gust_time_s=0.7,
            ground_effect_radius_m=radius_m,
        )
        for curve, size_m, z_m, gust_m_s2, radius_m in (
            ("tilted-circle", 1.0, 0.1, 1.0, 0.0),
            ("helix", 0.5, -0.2, 0.0, 0.2),
            ("height-step", -2.0, 0.0, -0.5, 0.3),
            ("take-off-and-landing", 0.6, -0.05, 0.0, 0.05),
            ("swinging-eight", 1.0, 0.0, 0.0, 0.0),
        )
    ),
)
"""Courses with heights among level ones, with vertical gusts and ground effect; one falls to the ground, one
begins there."""
TOUCHING: Final = tuple(
    Scenario(
        vehicle=CRAZYFLIE,
        duration_s=0.3,
        sensors="mocap",
        seed=7,
        trajectory="take-off-and-landing",
        size_m=0.6,
        start_offset_m=(0.0, 0.0, z_m),
        start_velocity_m_s=velocity_m_s,
        start_tilt_rad=(0.0, 0.3),
    )
    for z_m, velocity_m_s in ((-0.01, (1.0, 0.5, 0.4)), (0.02, (2.0, 0.0, -0.3)), (-0.01, (-1.0, 0.3, 0.2)))
)
"""Tilted drones that move sideways touch the ground; the second rises from below it."""
FLOWN_IN_SPACE: Final = tuple(
    one.model_copy(
        update={"vehicle": FLOWN} | {key: getattr(Scenario(vehicle=FLOWN), key) for key in OF_THE_VEHICLE}
    )
    for one in SPACE[2:5]
)

ALTITUDES: Final = {
    law: tuple(one.model_copy(update={"altitude_loop": law}) for one in SPACE[:5])
    for law in ("feedforward", "pid")
}
"""The same with other altitude loops."""

LATE_THRUST: Final = tuple(
    Scenario(
        vehicle=CRAZYFLIE,
        duration_s=0.5,
        trajectory=curve,
        size_m=1.0,
        start_tilt_rad=(0.5, 0.0),
        command_delay_ticks=delay_ticks,
        dropped_share=0.2,
    )
    for curve, delay_ticks in (("take-off-and-landing", 50), ("height-step", 100), ("tilted-circle", 7))
)
"""Commands that are late for a drone on the ground, and for one that starts tilted."""

BATCHES: Final = {
    "truth": TRUTH,
    "sensed": SENSED,
    "coupled": COUPLED,
    "take-off": TAKE_OFF,
    "instruments": INSTRUMENTS,
    "cascade": captured(CRAZYFLIE),
    "limited": captured(LIMITED),
    "lower": captured(changed(LIMITED, rotors={"mixer": "lower"})),
    "yaw-last": captured(HEAVY),
    "flown": captured(FLOWN),
    "late": captured(LATE),
    "lagging": captured(LAGGING),
    "space": SPACE,
    "touching": TOUCHING,
    "flow deck": tuple(one.model_copy(update={"sensors": "flow-deck"}) for one in captured(CRAZYFLIE)),
    "autopilot": tuple(one.model_copy(update={"sensors": "autopilot"}) for one in captured(FLOWN)[:3]),
    "flown in space": FLOWN_IN_SPACE,
    **ALTITUDES,
    "level by pid": tuple(one.model_copy(update={"altitude_loop": "pid"}) for one in captured(CRAZYFLIE)[:2]),
    "late thrust": LATE_THRUST,
    "flown take-off": (
        Scenario(vehicle=FLOWN, duration_s=0.5, sensors="mocap", start="take-off", start_tilt_rad=(0.2, 0.1)),
    ),
}


def _within(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


AT_240_HZ = "cf2x-pyflyt"
"""A vehicle whose loops do not divide an update period of 10 ms."""


def drones() -> st.SearchStrategy[VehicleFile]:
    """Draw a drone of any kind: a shipped one, or one with other figures."""
    gain, tick = _within(0.0, 20.0), st.sampled_from([100, 200, 500, 1000])
    response = st.fixed_dictionaries(
        {"gain": _within(0.1, 3.0), "lag_s": _within(0.001, 0.5), "dead_time_s": _within(0.0, 0.2)}
    )
    axis = st.fixed_dictionaries(
        {
            "p_1_s": gain,
            "d": _within(0.0, 0.5),
            "integral_limit_rad_s": _within(0.0, 0.1),
            "rate_p_s_rad": _within(0.0, 1e4),
            "rate_d_s2_rad": _within(0.0, 100.0),
            "rate_integral_limit_rad": _within(0.0, 1.0),
        }
    )
    sensors = st.fixed_dictionaries(
        {
            "position_rate_hz": st.sampled_from([20, 50, 100]),
            "position_delay_s": _within(0.0, 0.2),
            "velocity_filter_s": st.one_of(st.just(0.0), _within(0.001, 1.0)),
            "lever_m": st.one_of(st.just((0.0, 0.0, 0.0)), st.tuples(*[_within(-0.3, 0.3)] * 3)),
        }
    )
    cascades = st.fixed_dictionaries({"rate_hz": tick, "roll": axis, "pitch": axis, "yaw": axis})
    mixers = st.fixed_dictionaries({"mixer": st.sampled_from(["clip", "lower", "yaw-last"])})
    trim = _within(-0.2, 0.2)
    firsts = st.fixed_dictionaries(
        {"rate_hz": tick, "roll": response, "pitch": response, "roll_trim_rad": trim, "pitch_trim_rad": trim}
    )
    return st.one_of(
        st.sampled_from([vehicle_toml.load(name) for name in vehicle_toml.names() if name != AT_240_HZ]),
        st.builds(changed, st.just(CRAZYFLIE), attitude=cascades, sensors=sensors, rotors=mixers),
        st.builds(changed, st.just(FLOWN), attitude=firsts, sensors=sensors),
        st.builds(
            changed,
            st.just(FLOWN),
            attitude=firsts,
            sensors=sensors,
            thrust=response,
            altitude=st.just({"thrust_max_n": 3.0}),
        ),
    )


def scenarios(**fixed: Any) -> st.SearchStrategy[Scenario]:
    """Draw a scenario of any kind; `fixed` members have these values."""
    small, tilt = _within(-0.05, 0.05), _within(-1.2, 1.2)
    members: dict[str, st.SearchStrategy[Any]] = {
        "seed": st.integers(0, 2**63 - 1),
        "trajectory": st.sampled_from(CURVE_NAMES),
        "size_m": _within(-3.0, 3.0),
        "rate_rad_s": _within(-2.0, 2.0),
        "start_offset_m": st.tuples(*[_within(-2.0, 2.0)] * 3),
        "start_velocity_m_s": st.tuples(*[_within(-3.0, 3.0)] * 3),
        "start_tilt_rad": st.tuples(tilt, tilt),
        "yaw_rad": st.one_of(_within(-4.0, 4.0), _within(-1000.0, 1000.0)),
        "yaw_rate_rad_s": _within(-3.0, 3.0),
        "mass_kg": _within(0.05, 0.09),
        "motor_lag_s": st.one_of(st.just(0.0), _within(0.001, 0.1)),
        "drag_1_s": _within(0.0, 0.5),
        "push_m_s2": st.tuples(_within(-1.0, 1.0), _within(-1.0, 1.0)),
        "wind_speed_m_s": st.one_of(st.just(0.0), _within(0.0, 10.0)),
        "wind_direction_rad": _within(-7.0, 7.0),
        "battery_sag_1_s": _within(0.0, 0.3),
        "payload_kg": _within(-0.02, 0.03),
        "payload_time_s": _within(-1.0, 2.0),
        "impulse_n_s": st.one_of(
            st.just((0.0, 0.0, 0.0)), st.tuples(small, small, small), st.just((40.0, 0.0, 0.0))
        ),
        "impulse_time_s": _within(0.0, 1.0),
        "vertical_gust_m_s2": st.one_of(st.just(0.0), _within(-2.0, 2.0)),
        "vertical_gust_time_s": _within(-1.0, 1.0),
        "ground_effect_radius_m": st.one_of(st.just(0.0), _within(0.0, 1.0)),
        "command_delay_ticks": st.sampled_from([0, 0, 1, 2, 7, 200]),
        "dropped_share": st.sampled_from([0.0, 0.0, 0.3, 1.0]),
        "noise_scale": st.sampled_from([0.0, 1.0, 3.0]),
        "accelerometer_bias_m_s2": st.tuples(small, small, small),
        "gyro_bias_rad_s": st.tuples(small, small, small),
    }
    return st.builds(Scenario, **(members | {name: st.just(value) for name, value in fixed.items()}))
