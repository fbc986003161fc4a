"""Why some faults of the engine's C change nothing that a flight shows, by file, line and change."""

import re
from collections.abc import Mapping
from typing import Final

from tests.mutation.reasons import Key

_LONGER: Final = "an array one element longer than it must be"
_FIRST_IMAGE: Final = "start and first reading take the same image"
_LOW_PASS: Final = (
    "const real_t output = simulation->low_pass_b "
    "* (((now + (<real> * state[0])) + (<real> * state[1])) + state[2]);"
)
_CLIP: Final = "return choose(value < low, splat(low), choose(value > high, splat(high), value));"
_BESIDE: Final = "reads or writes beside an array passed as a pointer, which no flight shows"

REASONS: Final[Mapping[Key, str]] = {
    **{("evaluation.c", "for (i = 0; i < METRICS; i++) {", change): _BESIDE for change in ("< -> <=",)},
    (
        "evaluation.c",
        "safe = safe & ((height_m > <real>) | (low & (height_m <= <real>)));",
        "zero -> one #1",
    ): "a height above 0 is safe by the first comparison",
    **{
        ("ground.h", line, ">= -> >"): "a drone is at 0 itself, or still, only where the ground has put it"
        for line in (
            "const mask_t low = flight->landing & (body[POSITION + 2] >= <real>);",
            "resting = low & (velocity_m_s[2] >= <real>);",
        )
    },
    (
        "ground.h",
        "const real_t ratio = radius_m / (<real> * rotor_height_m);",
        "negative",
    ): "only its square counts",
    **{
        ("evaluation.c", "for (i = 0; i < 4; i++) {", change): "writes what the mean square then overwrites"
        for change in ("< -> <=", "4 -> 5")
    },
    **{
        (
            "evaluation.c",
            "const int64_t flight = ((index + lane) < evaluation->flights) ? (index + lane) : index;",
            change,
        ): "a lane without a flight reads beside the arrays, and its results are not written"
        for change in ("+ -> -", "< -> <=")
    },
    **{
        ("elementary.h", "#define COUNT(array) ((int)(sizeof(array) / sizeof((array)[0])))", change): (
            "every element has the same size"
        )
        for change in ("0 -> (-1)", "0 -> 1")
    },
    ("elementary.h", "#define ROUNDING <real> /* <real> * 2^52 */", "negative"): "it rounds alike",
    (
        "elementary.h",
        "const mask_t steep = size > <real>;",
        "next number",
    ): "one number, the same result",
    ("lanes.h", "return number - (real_t){ <real> };", "- -> +"): "the C writes no -0.0 into all lanes",
    **{
        ("lanes.h", f"return lanes.{member};", "left out"): "the value is in the register anyway"
        for member in ("whole", "real")
    },
    **{
        ("lanes.h", line, change): "computes what `choose` then ignores"
        for line, change in (
            ("int found = 0;", "0 -> (-1)"),
            ("int found = 0;", "0 -> 1"),
            ("lanes.whole = mask;", "left out"),
            ("return found;", "left out"),
        )
    },
    **{
        ("lanes.h", line, change): "two numbers that are equal"
        for line, change in (
            (_CLIP, "< -> <="),
            (_CLIP, "> -> >="),
            ("return choose((a > b) | (a != a), a, b);", "> -> >="),
            ("return choose((a < b) | (a != a), a, b);", "< -> <="),
        )
    },
    ("loop.c", "return (value == value) ? value : NAN;", "left out"): "the value is in the register anyway",
    **{
        (
            "loop.c",
            "kept = kept & (magnitude(state->body[i]) "
            "< ((i < VELOCITY) ? simulation->lost_m : (double)INFINITY));",
            change,
        ): "a position of exactly 10 km, or a speed of as many metres per second"
        for change in ("< -> <=", "< -> <= #1")
    },
    (
        "loop.c",
        "const int dropped = simulation->dropping "
        "&& (draws->drops[drop] < lane_of(flight->dropped_share, lane));",
        "< -> <=",
    ): "a random number that equals the share",
    **{
        ("loop.c", f"{line} = {{ {{ {{ splat(<real>) }} }} }};", "zero -> one"): (
            "the first command replaces it"
        )
        for line in ("const wire_t wire", "const late_t late")
    },
    **{
        (
            "loop.c",
            "surroundings_t around = { flight->mass_kg, { splat(<real>), splat(<real>) }, splat(<real>) };",
            change,
        ): ("read only in wind, which sets it")
        for change in ("zero -> one", "zero -> one #1")
    },
    **{
        ("loop.c", line, change): "the choice of another compiler or processor"
        for line, changes in (
            ('return __builtin_cpu_supports("avx2") ? 4 : 2;', ("2 -> 1", "2 -> 3")),
            ("return 2;", ("left out", "2 -> 1", "2 -> 3")),
            ("return 1;", ("left out", "1 -> 0", "1 -> 2")),
        )
        for change in changes
    },
    **{
        ("faults.c", line, change): _BESIDE
        for line, changes in (
            ("for (i = 0; i < 7; i++) {", ("< -> <= #1", "7 -> 8 #1", "< -> <= #2", "7 -> 8 #2")),
            ("for (i = 0; i < 6; i++) {", ("0 -> (-1)", "< -> <=", "6 -> 7")),
        )
        for change in changes
    },
    ("faults.c", "break;", "left out #6"): "the last case",
    ("faults.c", "for (i = 0; i < 10; i++) {", "10 -> 9"): "the other numbers alone refuse a state",
    **{
        (
            "loop.c",
            "real_t thrust_share = splat(<real>);",
            change,
        ): "read only with disturbances, which set it"
        for change in ("negative", "next number")
    },
    **{
        (name, f"#define {constant} <number>", change): _LONGER
        for name, constant in (("first_order.h", "LATE_TICKS_MAX"), ("mocap.h", "MOCAP_DELAY_MAX"))
        for change in ("one less", "one more")
    },
    ("first_order.h", "real_t nodes_rad[3][3];", "3 -> 4"): _LONGER,
    (
        "first_order.h",
        "for (i = 0; i < (LATE_TICKS_MAX + 2); i++) {",
        "0 -> 1",
    ): "the first tick writes that entry",
    (
        "mocap.h",
        "for (k = 1; k <= simulation->mocap_delay_ticks; k++) {",
        "1 -> 0",
    ): "the first tick writes that entry",
    (
        "world.h",
        "for (k = 0; k < (DELAY_TICKS_MAX + 1); k++) {",
        "0 -> 1",
    ): "the first tick writes that entry",
    **{
        ("world.h", "for (k = 0; k < (DELAY_TICKS_MAX + 1); k++) {", change): _BESIDE
        for change in ("< -> <=", "1 -> 2")
    },
    (
        "world.h",
        "wire->sent[k][i] = first[i];",
        "index + 1",
    ): "the first tick writes the first entry; and beside the array, which no flight shows",
    **{
        (
            "loop.c",
            "const real_t touching = choose(flight->landing & (truth_now->position_m[2] >= <real>), "
            "splat(<real>), splat(<real>));",
            change,
        ): "any number but 0 is the floor"
        for change in ("negative", "next number")
    },
    **{
        ("loop.c", "flying->given_n = splat(<real>);", change): "the first update sets it"
        for change in ("left out", "zero -> one")
    },
    (
        "loop.c",
        "flying->capped = splat(<real>);",
        "left out",
    ): "what memory holds then is negative: no thrust counts as capped",
    **{
        (
            "loop.c",
            "flying->capped = choose(magnitude(given_n - wanted_n) > simulation->capped_n, splat(<real>), "
            "flying->capped);",
            change,
        ): "any positive number is a capped thrust, and no difference equals its limit in every bit"
        for change in ("> -> >=", "next number")
    },
    **{
        ("first_order.h", "for (i = 0; i < 3; i++) {", change): _BESIDE
        for change in ("< -> <= #1", "3 -> 4 #1")
    },
    **{
        ("first_order.h", "for (i = 0; i < 6; i++) {", change): "the derivative does not read position x"
        for change in ("0 -> 1", "0 -> 1 #1")
    },
    **{
        ("pd.c", "(void)thrust_acceleration_m_s2;", change): "only silences a warning"
        for change in ("left out", "left out #1", "left out #2")
    },
    **{
        ("pd.c", line, change): "no error, jerk or tilt of a flight equals its limit in every bit"
        for line, change in (
            (
                "const double jerk_m_s3 = (magnitude(change) <= pid->jerk_limit_m_s3) ? change : <real>;",
                "<= -> <",
            ),
            ("if ((magnitude(target[0] - state[0]) < pid->integrated_error_m)", "< -> <="),
            ("&& (magnitude(target[1] - state[1]) < pid->integrated_error_m)", "< -> <="),
            ("< (pid->tilt_limit_rad * pid->tilt_limit_rad))) {", "< -> <="),
        )
    },
    ("rigid_body.h", "to_world(r, state + VELOCITY, rate + POSITION);", "+ -> - #1"): "POSITION is 0",
    **{
        ("vehicle.h", "for (i = 0; i < 4; i++) {", change): _BESIDE
        for change in ("0 -> (-1) #3", "< -> <= #3", "4 -> 5 #3")
    },
    **{
        ("vehicle.h", "for (i = 0; i < STATE_ROWS; i++) {", change): "the derivative does not read position x"
        for change in ("0 -> 1", "0 -> 1 #1")
    },
    ("sensors.h", "measure_flow(simulation, start, r, suite->flow_m_s);", "left out"): _FIRST_IMAGE,
    ("sensors.h", "if ((suite->tick == 0)", "0 -> (-1)"): _FIRST_IMAGE,
    **{
        ("sensors.h", line, change): "moves a gate by an ulp"
        for line, change in (
            ("suite->low_pass[i][k] = suite->z_m / (<real> * simulation->low_pass_b);", "next number"),
            (_LOW_PASS, "next number"),
            (_LOW_PASS, "next number #1"),
        )
    },
    **{
        (
            "sensors.h",
            "const real_t pitch_seen = arc_sine(clip(smooth[0] / simulation->gravity_m_s2, <real>, <real>));",
            change,
        ): "one number just beyond the limit"
        for change in ("next number", "next number #1")
    },
    (
        "sensors.h",
        "const mask_t sonar_agrees = magnitude(slow_sonar - suite->z_m) < simulation->slow_jump_m;",
        "- -> +",
    ): "the wider gate of the pressure accepts first",
    ("world.h", "#define DELAY_TICKS_MAX <number>", "one more"): _LONGER,
    (
        "world.h",
        "const gusts_t gusts = { draws[0], draws[1], (<real> * draws[1]) + (<real> * draws[2]) };",
        "next number #1",
    ): "one ulp of the first gust, which decays before it changes a rounded state",
    **{
        (
            "world.h",
            "const mask_t any_axis = (flight->impulse_n_s[0] != <real>) "
            "| (flight->impulse_n_s[1] != <real>) | (flight->impulse_n_s[2] != <real>);",
            change,
        ): "an impulse of zero changes nothing but the sign of a zero"
        for change in ("zero -> one", "zero -> one #1", "zero -> one #2")
    },
}


def reason(key: Key) -> str | None:
    """Return why the fault `key` changes nothing, or None if no reason is known."""
    name, line, change = key
    length = re.fullmatch(r"(\d+) -> (\d+)( #\d+)?", change)
    if length and re.search(rf"\b(?:double|real_t|lanes_t) \w+\[{length[1]}\](;| = )", line):
        return _LONGER if int(length[2]) > int(length[1]) else _BESIDE
    if name == "sensors.h" and not line.startswith("for") and re.fullmatch(r"<=? -> <=?( #\d+)?", change):
        return "two numbers that are equal"
    return REASONS.get(key)
