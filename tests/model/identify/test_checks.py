"""Logs that contradict themselves: each fault is told by name, with the option that mends it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mambo_sil.errors import LogError
from mambo_sil.model.identify.identify import identify
from mambo_sil.model.identify.signals import DEGREE
from tests.support.logs import Array, Flown, Truth, fly, log_of

Columns = dict[str, Array]
FLOWN = fly(Truth(), Flown(), 1)[0]
ANGLES = ("roll_command_rad", "pitch_command_rad", "roll_rad", "pitch_rad")


def without_motion(log: Columns) -> Columns:
    """Leave out position and velocity."""
    return {name: values for name, values in log.items() if name not in ("x_m", "y_m", "vx_m_s", "vy_m_s")}


def scale(factor: float, *names: str) -> Callable[[Columns], Columns]:
    """Multiply columns."""
    return lambda log: {key: factor * values if key in names else values for key, values in log.items()}


def swap(*pairs: tuple[str, str]) -> Callable[[Columns], Columns]:
    """Swap pairs of columns."""
    names = dict([*pairs, *((second, first) for first, second in pairs)])
    return lambda log: {key: log[names.get(key, key)] for key in log}


def delay(rows: int, *names: str) -> Callable[[Columns], Columns]:
    """Log columns later by some rows of 10 ms."""
    return lambda log: {key: np.roll(values, rows) if key in names else values for key, values in log.items()}


COMMANDS, TILTS = (ANGLES[0], ANGLES[1]), (ANGLES[2], ANGLES[3])
NEGATE_ROLL = "--columns roll_command_rad=-roll_command_rad,roll_rad=-roll_rad"
FAULTS: dict[str, tuple[Callable[[Columns], Columns], list[str], list[str] | None]] = {
    "measured roll negated": (
        scale(-1.0, "roll_rad"),
        ["roll: commanded and measured angle", "the measured one", "--columns roll_rad=-roll_rad"],
        ["roll_command_rad=-roll_command_rad or --columns roll_rad=-roll_rad"],
    ),
    "commanded pitch negated": (
        scale(-1.0, "pitch_command_rad"),
        ["pitch: commanded", "the commanded one", "--columns pitch_command_rad=-pitch_command_rad"],
        ["pitch_command_rad=-pitch_command_rad or --columns pitch_rad=-pitch_rad"],
    ),
    "both rolls negated": (
        scale(-1.0, "roll_command_rad", "roll_rad"),
        ["roll: tilt and motion along y contradict", NEGATE_ROLL, "--columns y_m=-y_m,vy_m_s=-vy_m_s"],
        None,
    ),
    "y to the left": (
        scale(-1.0, "y_m", "vy_m_s"),
        ["roll: tilt and motion along y contradict", "--columns y_m=-y_m,vy_m_s=-vy_m_s"],
        None,
    ),
    "commands swapped": (
        swap(COMMANDS),
        ["roll and pitch are swapped", "the commanded angles", "roll_command_rad=pitch_command_rad"],
        ["roll and pitch are swapped", "roll_rad=pitch_rad,pitch_rad=roll_rad"],
    ),
    "angles swapped": (
        swap(TILTS),
        ["roll and pitch are swapped", "the measured angles: --columns roll_rad=pitch_rad"],
        ["roll and pitch are swapped"],
    ),
    "everything swapped": (
        swap(COMMANDS, TILTS),
        ["roll and pitch are swapped, or x and y", "roll_command_rad=pitch_command_rad"],
        None,
    ),
    "measured roll in degrees": (
        scale(57.3, "roll_rad"),
        ["roll_rad", "degrees", "--columns roll_rad=deg*roll_rad"],
        ["--columns roll_rad=deg*roll_rad"],
    ),
    "commands in degrees": (
        scale(57.3, *COMMANDS),
        ["--columns roll_command_rad=deg*roll_command_rad,pitch_command_rad=deg*pitch_command_rad"],
        ["roll_command_rad, pitch_command_rad", "0.79 rad"],
    ),
    "all angles in degrees": (scale(57.3, *ANGLES), ["roll_rad=deg*roll_rad"], ["roll_rad=deg*roll_rad"]),
    "angles of an earlier clock": (
        delay(-20, *TILTS),
        ["roll: the measured angle leads", "pitch: the measured", "two clocks"],
        ["two clocks"],
    ),
    "commands of a later clock": (delay(19, *COMMANDS), ["two clocks"], ["two clocks"]),
}


@pytest.mark.first_is_quick
@pytest.mark.parametrize("fault", FAULTS)
def test_a_contradiction_is_told_by_name(fault: str) -> None:
    """With the motion it is known which column is wrong; without it, which two disagree, or nothing."""
    spoil, words, words_without = FAULTS[fault]
    with pytest.raises(LogError) as raised:
        identify([log_of(spoil(FLOWN))])
    for word in words:
        assert word in str(raised.value)
    blind = log_of(spoil(without_motion(FLOWN)))
    if words_without is None:
        assert any("signs not checked" in remark for remark in identify([blind])[0].remarks)
        return
    with pytest.raises(LogError) as raised:
        identify([blind])
    for word in words_without:
        assert word in str(raised.value)


def test_a_sound_log_is_said_to_be_sound() -> None:
    """Units, signs and axes; the sense of yaw only where the heading turns."""
    remarks = identify([log_of(FLOWN)])[0].remarks
    assert remarks[0] == "made.csv: units, signs and axes agree with the motion"
    assert "sense of yaw not checked" in remarks[1]


def test_all_logs_tell_all_their_faults() -> None:
    """Also two faults of one log."""
    first = scale(-1.0, "roll_rad", "pitch_command_rad")(FLOWN)
    second = scale(57.3, "roll_rad")(FLOWN)
    with pytest.raises(LogError) as raised:
        identify([log_of(first, "a.csv"), log_of(second, "b.csv")])
    assert [fault.split()[0] for fault in raised.value.faults] == ["a.csv:", "a.csv:", "b.csv:"]


def test_yaw_that_turns_the_wrong_way_is_told() -> None:
    """Where the heading moves by 20 degrees or more."""
    turning = fly(Truth(), Flown(yaw_rate_rad_s=0.1), 1)[0]
    with pytest.raises(LogError, match="yaw turns the wrong way: --columns yaw_rad=-yaw_rad"):
        identify([log_of(scale(-1.0, "yaw_rad")(turning))])


def test_small_angles_in_degrees_are_told_by_the_motion() -> None:
    """Where none is beyond 0.79."""
    calm = Flown(size_m=0.03, sines_rad=0.0, gusts_m_s2=0.002, slow_rad=1e-4, estimate_noise=0.1)
    gentle = fly(Truth(trim_rad=(0.0, 0.0)), calm, 1)[0]
    with pytest.raises(LogError, match="g per radian; are the angles in degrees"):
        identify([log_of(scale(57.3, *ANGLES)(gentle))])


@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_a_command_that_is_zero_is_no_command(axis: str) -> None:
    """The axis is refused, the other one is not; and there is no model of one axis."""
    summary = identify([log_of(scale(0.0, f"{axis}_command_rad")(FLOWN))])[0]
    refused = summary.axes[axis]
    assert (refused.verdict, refused.fitted) == ("refused", None)
    assert refused.reasons == [
        f"no command: {axis}_command_rad is 0, or moves by less than 0.1 degrees (rms)"
    ]
    assert sorted(one.verdict for one in summary.axes.values()) == ["good", "refused"]
    assert not summary.good


def test_hover_is_refused_and_hover_with_sines_is_not() -> None:
    """Without excitation there is no model of an axis, and none of the motion; two degrees are enough."""
    summary = identify([log_of(fly(Truth(), Flown(size_m=0.0, sines_rad=0.0), 1)[0])])[0]
    assert (summary.good, summary.motion) == (False, None)
    for axis in summary.axes.values():
        assert axis.verdict == "refused"
        assert "1 degree is needed" in axis.reasons[0]
    summary = identify([log_of(fly(Truth(), Flown(size_m=0.0, sines_rad=0.04), 1)[0])])[0]
    assert summary.good


def test_short_and_calm_flights_are_weak() -> None:
    """Between 8 and 15 s; below 8 s they are refused."""
    short = identify([log_of({name: values[:1200] for name, values in FLOWN.items()})])[0]
    assert [axis.verdict for axis in short.axes.values()] == ["weak", "weak"]
    assert short.roll.reasons == ["12 s of flight; 15 s make it good"]
    shorter = identify([log_of({name: values[:700] for name, values in FLOWN.items()})])[0]
    assert shorter.roll.reasons[0] == "7 s of flight; 8 s are needed"


def test_tilt_and_velocity_of_two_clocks_give_no_motion() -> None:
    """Tilt that lags behind both: a doubtful dead time, too."""
    summary = identify([log_of(delay(19, *TILTS)(FLOWN))])[0]
    assert summary.motion is None
    assert any("s apart, as if of two clocks" in remark for remark in summary.remarks)
    assert "dead time of 28" in summary.roll.reasons[0]
    assert "share a clock" in summary.roll.reasons[0]


def tumble(log: Columns, share: float) -> Columns:
    """Let the drone turn over and over in the last part of a log, as a quaternion shows it."""
    begin = round((1.0 - share) * len(log["time_s"]))
    turning = np.arange(len(log["time_s"]) - begin) / 8.0
    spoilt = {name: values.copy() for name, values in log.items()}
    spoilt["roll_rad"][begin:] = (turning + np.pi) % (2.0 * np.pi) - np.pi
    spoilt["pitch_rad"][begin:] = 1.5 * np.sin(turning)
    return spoilt


@pytest.mark.parametrize("share", [0.1, 0.4])
@pytest.mark.parametrize("factor", [1.0, 1.0 / DEGREE])
def test_a_tumble_is_cut_out_and_the_rest_is_used(share: float, factor: float) -> None:
    """No unit is suspected, in radians or in degrees that the columns name, and the model is that before."""
    spoilt = scale(factor, *ANGLES)(tumble(FLOWN, share))
    log = log_of(spoilt)
    if factor > 1.0:
        signals = {
            name: replace(signal, value=DEGREE * signal.value, column=f"deg*{name}")
            if name in ANGLES
            else signal
            for name, signal in log.signals.items()
        }
        log = replace(log, signals=signals)
    summary = identify([log])[0]
    assert any("a tumble beyond 45 degrees is cut out" in remark for remark in summary.remarks)
    assert summary.roll.verdict == summary.pitch.verdict == "good"
    assert summary.roll.fitted is not None
    assert abs(summary.roll.fitted.gain.value - Truth().gain[0]) < 0.03
    assert (1.0 - share) * 30.0 - 1.5 < summary.duration_s < (1.0 - share) * 30.0


def test_spikes_beyond_half_a_turn_name_the_column() -> None:
    """Of three in a hundred samples, as a lost packet leaves them."""
    spoilt = {name: values.copy() for name, values in FLOWN.items()}
    spoilt["roll_rad"][::33] = 999.0
    with pytest.raises(LogError, match="more than 1 % of the samples of roll_rad are beyond half a turn"):
        identify([log_of(spoilt)])


def test_a_bad_log_of_a_pool_is_left_out_with_its_reason() -> None:
    """A tumble from start to end, a wrong sign, a wrong unit; all of them bad are refused."""
    upside_down = log_of(tumble(FLOWN, 1.0), "tumble.csv")
    negated = log_of(scale(-1.0, "roll_rad")(FLOWN), "negated.csv")
    degrees = log_of(scale(57.3, "roll_rad")(FLOWN), "degrees.csv")
    summary = identify([upside_down, negated, log_of(FLOWN), degrees], ["cut.csv: is empty"])[0]
    assert [log.name for log in summary.logs] == ["made.csv"]
    assert summary.roll.verdict == "good"
    left_out = [remark for remark in summary.remarks if remark.startswith("left out: ")]
    for remark, words in zip(
        left_out,
        (
            "cut.csv: is empty",
            "tumble.csv: has no stretch",
            "negated.csv: roll: com",
            "degrees.csv: more than",
        ),
        strict=True,
    ):
        assert remark.startswith(f"left out: {words}")
    with pytest.raises(LogError) as raised:
        identify([upside_down, negated])
    assert [fault.split(":")[0] for fault in raised.value.faults] == ["tumble.csv", "negated.csv"]


@pytest.mark.long
def test_a_tone_does_not_show_a_sign() -> None:
    """Commands of 1.6 Hz: a delay of half a period more looks like the other sign."""
    time_s = FLOWN["time_s"]
    random = np.random.default_rng(1)
    wave = 0.1 * np.sin(10.0 * time_s)
    tilt = 0.07 * np.sin(10.0 * (time_s - 0.19)) + 0.02 * random.normal(size=len(time_s))
    both = {"roll_command_rad": wave, "pitch_command_rad": wave, "roll_rad": tilt, "pitch_rad": tilt}
    for seed in range(5):
        noise = np.random.default_rng(seed).normal(size=len(time_s))
        log = {"time_s": time_s} | both | {"roll_rad": tilt + 0.01 * noise}
        assert identify([log_of(log)])[0].duration_s > 29.0


def test_a_unit_that_the_columns_name_is_not_asked_for() -> None:
    """A command that is read as degrees and 57 times too large: both columns are named instead."""
    log = log_of(scale(57.3, "roll_command_rad")(without_motion(FLOWN)))
    command = replace(log.signals["roll_command_rad"], column="deg*cmd.roll")
    signals = dict(log.signals) | {"roll_command_rad": command}
    with pytest.raises(LogError, match=r"read as deg\*cmd.roll and roll_rad: one of these units is wrong"):
        identify([replace(log, signals=signals)])


@pytest.mark.long
def test_logs_of_two_drones_are_said_to_be_of_two_drones() -> None:
    """Other gains, or another lag: nothing is said of clocks; a log of the same drone is not doubted."""
    for other in (Truth(gain=(1.0, 1.0)), Truth(lag_s=(0.12, 0.12), delay_s=(0.02, 0.02))):
        flown = without_motion(fly(other, Flown(), 1, 2)[0])
        roll = identify([log_of(without_motion(FLOWN)), log_of(flown, "b.csv")])[0].roll
        assert roll.verdict == "weak"
        assert "the drones of the logs differ: gain 0.8" in roll.reasons[0]
        assert "clock" not in " ".join(roll.reasons)
    same = without_motion(fly(Truth(), Flown(), 1, 2)[0])
    assert identify([log_of(without_motion(FLOWN)), log_of(same)])[0].roll.verdict == "good"


def test_logs_whose_clocks_differ_are_doubted() -> None:
    """Each alone looks sound; together they disagree by 50 ms."""
    later = without_motion(delay(5, *TILTS)(FLOWN))
    summary = identify([log_of(without_motion(FLOWN)), log_of(later)])[0]
    assert summary.roll.verdict == "weak"
    assert "lag plus dead time of the logs is" in summary.roll.reasons[0]


def test_a_log_without_flight_is_refused() -> None:
    """Shorter than 4 s, or full of gaps."""
    with pytest.raises(LogError, match="no stretch of 4 s in the air"):
        identify([log_of({name: values[:350] for name, values in FLOWN.items()})])
    with pytest.raises(LogError, match="no stretch of 4 s in the air"):
        identify([log_of({name: values[::30] for name, values in FLOWN.items()})])
