"""Why some faults of Python change nothing that a test of their room can see, by file, line and change."""

from collections.abc import Mapping
from typing import Final

from tests.mutation.reasons import Key

_EQUAL: Final = "two numbers that are equal"
_CHOICE: Final = "a choice, which has no definition: flights judge it, and the committed C shows it"
_PARITY: Final = "C and reference then differ, which parity shows"
_SIZE: Final = "only its absolute value counts"
_WORDS: Final = "words of a comment"
_TIMES: Final = "time_s = PERIOD_S * np.arange(first, last + 1, dtype=np.float64)"
_STEP: Final = 'step = HeldCommand.of(Signal(np.array([time_s[0], 0.0]), np.array([0.0, 1.0]), "step"))'
_RAMP: Final = "both axes have the same ramp"
_STABLE: Final = "no loop that is unstable is known: 270 drawn at random have a radius below 1"
_BOTH_AXES: Final = "a segment of one axis, which has both places"
_ROOT: Final = "the root lies in the wider interval too"

PYTHON_REASONS: Final[Mapping[Key, str]] = {
    (
        "fences.py",
        "along = (way_m / np.where(rests, length_m, 1.0)[:, np.newaxis]).T",
        "1.0 -> 1.1",
    ): "of a flight whose target does not rest, whose overshoot is 0",
    (
        "fences.py",
        "return 0.0 * float(trace.position_m[-1, row, 0])",
        "0 -> 1",
    ): "x and y of a lost flight are NaN together",
    **{
        ("height_constants.py", line, change): _CHOICE
        for line, change in (
            ("LEAST_WEIGHT: Final = 0.3", "0.3 -> 0.33"),
            ("LEAST_COSINE: Final = 0.6", "0.6 -> 0.66"),
            ("STEEPEST_RAD: Final = 1.2", "1.2 -> 1.32"),
            ("RECIPROCAL_ERROR: Final = 3e-4", "3e-4 -> 0.00033"),
            ("FLOOR_MARGIN_M: Final = 0.02", "0.02 -> 0.022000000000000002"),
        )
    },
    **{
        (
            "height_constants.py",
            "if solution is None or not solution.spectral_radius < 1:",
            change,
        ): _STABLE
        for change in ("or -> and", "< -> <=", "1 -> 2")
    },
    **{
        ("height_constants.py", line, change): _PARITY
        for line, change in (
            ('"least_weight": LEAST_WEIGHT,', '"least_weight" -> "most_weight"'),
            ('"most_weight": MOST_WEIGHT,', '"most_weight" -> "least_weight"'),
        )
    },
    (
        "limits_constants.py",
        "LEAST_TURN_M2_S2: Final = 4e-5",
        "4e-5 -> 4.4000000000000006e-05",
    ): _CHOICE,
    ("limits_constants.py", "ROOT_BITS: Final = 16", "16 -> 17"): "a format that holds the largest root too",
    (
        "limits_constants.py",
        "if has_limits(settings) and not limits.braking_m_s2 and most_m_s2 < least_m_s2:",
        "< -> <=",
    ): _EQUAL,
    (
        "limits_constants.py",
        '"braking": fractional_bits(16 * slope * found.limits[LIMITS.index("angle")]),',
        "16 -> 17",
    ): "the same power of two",
    (
        "loop_margins.py",
        "return open_loop(sensitivity(loop, at.reshape(-1))).reshape(at.shape)",
        "1 -> 2",
    ): "NumPy takes any negative length for the one that is missing",
    **{
        (
            "loop_margins.py",
            "left = np.flatnonzero((values[:-1] > 0.0) != (values[1:] > 0.0))",
            change,
        ): _EQUAL
        for change in ("> -> >=", "> -> >= #1")
    },
    **{
        ("loop_margins.py", "left = left[(ok[left] > 0.0) & (ok[left + 1] > 0.0)]", change): (
            "between neighbours only a loop next to 0 has turning points on both sides of 0"
        )
        for change in ("> -> >=", "> -> >= #1", "& -> |", "+ -> -", "1 -> 2")
    },
    ("loop_margins.py", "return np.zeros(0)", "zeros -> ones"): "without an element",
    (
        "loop_margins.py",
        "found = elementwise.find_root(function, (rad_s[left], rad_s[left + 1]))",
        "1 -> 2",
    ): _ROOT,
    **{
        ("loop_margins.py", "if not 0 < top < len(rad_s) - 1:", change): (
            "a peak next to the first or the last frequency is that of the grid, to its width"
        )
        for change in ("0 -> 1", "1 -> 2")
    },
    **{
        (
            "loop_margins.py",
            "lambda at: -function(at), (rad_s[top - 1], rad_s[top], rad_s[top + 1])",
            change,
        ): _ROOT
        for change in ("1 -> 2", "1 -> 2 #1")
    },
    (
        "loop_margins.py",
        "lambda at: np.log(np.abs(opened(at))), np.log(np.maximum(np.abs(grid), 1e-300)), all_of_it",
        "1e-300 -> 1.1000000000000002e-300",
    ): "any positive number",
    **{
        (
            "loop_margins.py",
            "phases = np.mod(np.angle(opened(crossovers)) + math.pi, 2.0 * math.pi) "
            "if len(crossovers) else crossovers",
            change,
        ): reason
        for change, reason in (
            (
                "np.mod(np.angle(opened(crossovers)) + math.pi, 2.0 * math.pi) "
                "if len(crossovers) else crossovers "
                "-> (np.mod(np.angle(opened(crossovers)) + math.pi, 2.0 * math.pi))",
                "of no crossover there is no phase either way",
            ),
            ("+ -> -", "a whole turn"),
            ("2.0 -> 2.2", "an angle plus pi is at most a whole turn"),
        )
    },
    (
        "loop_margins.py",
        "gains = np.append(np.abs(opened(turning)) if len(turning) else turning, -grid[-1].real)",
        "np.abs(opened(turning)) if len(turning) else turning -> (np.abs(opened(turning)))",
    ): "of no frequency there is no gain either way",
    **{
        ("loop_margins.py", line, change): _EQUAL
        for line, change in (
            ("factors = 1.0 / gains[gains > LEAST_GAIN]", "> -> >="),
            ("gain_up=min(factors[factors > 1.0], default=math.inf),", "> -> >="),
            ("gain_down=max(factors[factors < 1.0], default=0.0),", "< -> <="),
        )
    },
    **{
        ("loop_margins.py", line, change): _SIZE
        for line, change in (
            (
                "complementary, _ = peak(lambda at: np.abs(1.0 - 1.0 / (1.0 + opened(at))), np.abs(1.0 - s))",
                "1.0 - 1.0 / (1.0 + opened(at)) -> (1.0 / (1.0 + opened(at))) - (1.0)",
            ),
            (
                "complementary, _ = peak(lambda at: np.abs(1.0 - 1.0 / (1.0 + opened(at))), np.abs(1.0 - s))",
                "1.0 - s -> (s) - (1.0)",
            ),
        )
    },
    **{
        (
            "loop_margins.py",
            "lambda at: np.abs(1.0 / (1.0 + opened(at))) - math.sqrt(0.5), "
            "np.abs(s) - math.sqrt(0.5), all_of_it",
            change,
        ): "a root of the opposite function"
        for change in (
            "np.abs(1.0 / (1.0 + opened(at))) - math.sqrt(0.5) "
            "-> (math.sqrt(0.5)) - (np.abs(1.0 / (1.0 + opened(at))))",
            "np.abs(s) - math.sqrt(0.5) -> (math.sqrt(0.5)) - (np.abs(s))",
        )
    },
    (
        "loop_margins.py",
        "least = int(np.argmin(leads)) if len(leads) else None",
        "leads -> phases #1",
    ): "both have a number for each crossover",
    **{
        ("derived_settings.py", f"{name}: Final = {value}", f"{value} -> {wrong}"): _CHOICE
        for name, value, wrong in (("RAMP_S", "0.4", "0.44000000000000006"),)
    },
    **{
        ("derived_settings.py", line, change): _WORDS
        for line, change in (
            ("ticks = round(period_s * rate_hz)", "round(period_s * rate_hz) -> (period_s * rate_hz)"),
            ("ticks = round(period_s * rate_hz)", "* -> /"),
            ("if slowness_s < QUICKEST_RESPONSE_S:", "< -> <="),
            ("if slowness_s < QUICKEST_RESPONSE_S:", "< -> >"),
            ("if half_rad > most_rad:", "> -> <"),
            ("if half_rad > most_rad:", "> -> >="),
        )
    },
    **{
        ("derived_settings.py", line, change): _EQUAL
        for line, change in (
            ("if braking_m_s2 >= LEAST_BRAKING_M_S2:", ">= -> >"),
            ("if largest_m_s2 > MOST_THRUST_M_S2:", "> -> >="),
            (
                "if (drone.rotors is None and drone.thrust is None) or most_m_s2 < LEAST_THRUST_MAX_M_S2:",
                "< -> <=",
            ),
        )
    },
    **{
        ("step_response.py", line, change): "the loops are linear, and at rest long before and behind"
        for line, change in (
            ("STEP_RAD: Final = 0.1", "0.1 -> 0.11000000000000001"),
            ("DURATION_S: Final = 3.0", "3.0 -> 3.3000000000000003"),
            ("_BEFORE_S: Final = SETTLE_S + 0.5", "0.5 -> 0.55"),
        )
    },
    (
        "step_response.py",
        "state = vehicle.at_rest(np.zeros((3, 2)), 0.0, airframe_of(drone).hover_command)",
        "zeros -> ones",
    ): "the attitude does not depend on the place",
    **{
        (
            "step_response.py",
            "first, last = -round(_BEFORE_S / PERIOD_S), round(DURATION_S / PERIOD_S)",
            f"round({time} / PERIOD_S) -> ({time} / PERIOD_S)",
        ): "a whole number anyway"
        for time in ("_BEFORE_S", "DURATION_S")
    },
    ("height_constants.py", "while error > RECIPROCAL_ERROR:", "> -> >="): _EQUAL,
    (
        "height_constants.py",
        "margin = found.error + 1e-5",
        "1e-5 -> 1.1000000000000001e-05",
    ): "a choice: more than all roundings",
    (
        "fences.py",
        "(fence.floor_m, fence.ceiling_m) if settings.height else (0.0, 0.0),",
        "0.0 -> 1.0",
    ): "a floor above the ceiling is no wall either",
    (
        "fences.py",
        "place_m = trace.position_m[since, row] * [1.0, 1.0, -1.0] # the height is up",
        "* -> /",
    ): "by 1 and -1",
    **{
        ("step_response.py", line, change): reason
        for line, change, reason in (
            (_TIMES, "+ -> -", "a sample less of hundreds"),
            (_TIMES, "1 -> 2", "a sample more of hundreds"),
            (_STEP, "0 -> 1", "before the step the command is 0 from the first or second sample on"),
            (_STEP, "1.0 -> 1.1", "the fit has a gain of its own"),
            (
                "still = np.zeros_like(time_s)",
                "zeros_like -> ones_like",
                "not read by the fit of an attitude",
            ),
        )
    },
    ("attitude_constants.py", "MOST_WEIGHT: Final = 1.9", "1.9 -> 2.09"): _CHOICE,
    **{
        ("law.py", line, change): reason
        for line, change, reason in (
            ("moves=len(laws[0].rows),", "0 -> 1", _RAMP),
            ("if laws[0].curvature is None:", "0 -> 1", _RAMP),
            (
                "if round(settings.observer.outage_s / horizon.update_period_s) > MOST_OUTAGE_STEPS:",
                "round(settings.observer.outage_s / horizon.update_period_s) "
                "-> (settings.observer.outage_s / horizon.update_period_s)",
                _EQUAL,
            ),
            ("radius = float(np.max(law_constants(settings).spectral_radius))", "max -> min", _STABLE),
            ("if not radius < 1:", "< -> <=", _STABLE),
            ("if not radius < 1:", "1 -> 2", _STABLE),
        )
    },
    ("derived_settings.py", "FLOW_POSITION_M: Final = 0.04", "0.04 -> 0.044000000000000004"): _CHOICE,
    **{
        ("step_response.py", line, change): reason
        for line, change, reason in (
            (
                "found = fit_response([segment], 0, [segment.counted], integrator=integrator)",
                "0 -> 1",
                _BOTH_AXES,
            ),
            (
                "return found, root_mean_square(residuals(found, [segment], 0, [segment.counted]))",
                "0 -> 1",
                _BOTH_AXES,
            ),
            (
                "chosen, error = (richer, richer_error) if richer_error < WORTH * plain_error "
                "else (plain, plain_error)",
                "< -> <=",
                _EQUAL,
            ),
        )
    },
}
