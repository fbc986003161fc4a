"""Why some faults of margins and of `design` change nothing that a test of their room can see."""

from collections.abc import Mapping
from typing import Final

from tests.mutation.reasons import Key

_EQUAL: Final = "two numbers that are equal"
_CHOICE: Final = "a choice, which has no definition"
_SIZE: Final = "only its absolute value counts"
_REPORT: Final = "a long test makes a report with pictures"
_CHANGE: Final = "change = 1.0 - np.exp(-1j * ticks[:, np.newaxis] * update_period_s)"
_SHARES: Final = "shares = (shares / np.maximum(shares.max(axis=0), 1e-300)).max(axis=(1, 2))"
_ALIVE: Final = "alive = (np.abs(poles) > _DEAD) & (shares > _LEAST_SHARE)"
_RESULTS: Final = "long tests write results: response.csv, drones.csv and pictures"
_NO_LOAD: Final = "controllers without a height do not read the load"
_LOADS: Final = "loads = hover_thrust_n(flight.vehicle) / drone.weight_n if commands_thrust else 1.0"
_MISSING: Final = "NumPy takes any negative length for the one that is missing"
_LOWER: Final = "position_m[2] -= (drone.weight_n - demand_n) / max(drone.altitude.p_n_m, 1e-9)"
_LONG: Final = "a long test notices it: draws do not depend on how many there are"
_ALIKE: Final = "all drones have the same names"
_DRAWN: Final = "drawn = [campaign.draw(number) for number in range(first, min(first + _BATCH, drones))]"
_START: Final = "START: Final = Offset((-0.7, 0.7, 0.3))"
_YAW: Final = "yaw_rad=2.0 * math.pi * np.arange(HEADINGS) / HEADINGS,"
_REVERSED: Final = "folder / RESPONSES -> (RESPONSES) / (folder)"

MARGIN_REASONS: Final[Mapping[Key, str]] = {
    **{
        ("axis_margins.py", line, change): reason
        for line, change, reason in (
            ("GROWTH_1_S: Final = 1e-3", "1e-3 -> 0.0011", _CHOICE),
            ("_LEAST_SHARE: Final = 1e-3", "1e-3 -> 0.0011", _CHOICE),
            ("_DEAD: Final = 1e-9", "1e-9 -> 1.1000000000000001e-09", _CHOICE),
            ("stable = poles.growth_1_s < GROWTH_1_S", "< -> <=", _EQUAL),
            ("slow = ticks <= updates[-1]", "<= -> <", _EQUAL),
            ("slow = ticks <= updates[-1]", "1 -> 2", "answers to a gust are largest at low frequencies"),
            (
                _CHANGE,
                "1.0 - np.exp(-1j * ticks[:, np.newaxis] * update_period_s) "
                "-> (np.exp(-1j * ticks[:, np.newaxis] * update_period_s)) - (1.0)",
                _SIZE,
            ),
            (_CHANGE, "-1j -> (1j)", _SIZE),
            ("forced = transition @ forced + inputs", "+ -> -", _SIZE),
            (_SHARES, "1e-300 -> 1.1000000000000002e-300", "any positive number"),
            (_ALIVE, "> -> >=", _EQUAL),
            (_ALIVE, "> -> >= #1", _EQUAL),
            ("roots = roots[np.abs(roots) > GROWTH_1_S]", "> -> >=", _EQUAL),
        )
    },
    **{
        ("hover_loop.py", line, change): reason
        for line, change, reason in (
            ("_NEGLIGIBLE: Final = 1e-9", "1e-9 -> 1.1000000000000001e-09", _CHOICE),
            ("whole = np.eye(self.transition.shape[1])", "1 -> 2", "a square matrix"),
            ("moves = np.asarray((np.abs(loop.transition) > _NEGLIGIBLE).any(axis=0))", "> -> >=", _EQUAL),
            (
                "moved = np.asarray((np.abs(loop.inputs) > _NEGLIGIBLE).any(axis=(0, 2)))",
                "> -> >=",
                _EQUAL,
            ),
            (
                "shown = np.asarray((np.abs(loop.outputs) > _NEGLIGIBLE).any(axis=(0, 1)))",
                "> -> >=",
                _EQUAL,
            ),
        )
    },
    **{
        ("derived_flight.py", line, change): reason
        for line, change, reason in (
            (_START, "-0.7 -> (0.7)", _CHOICE),
            (_START, "0.7 -> 0.77", _CHOICE),
            (_START, "0.7 -> 0.77 #1", _CHOICE),
            (_START, "0.3 -> 0.33", _CHOICE),
            (_YAW, "2.0 -> 2.2", _CHOICE),
            (_YAW, "* -> /", _CHOICE),
            (_YAW, "/ -> *", _CHOICE),
            (
                "fault = _fault(trace, drone, axes=2 if settings.height is None else 3)",
                "3 -> 4",
                "there are three axes",
            ),
            ("judged = trace.time_s >= DURATION_S - JUDGED_S", ">= -> >", "a sample less of hundreds"),
            (
                "off_m = (seen_m[judged] - _target_m(trace)[judged]).mean(axis=0)[:, :axes]",
                "seen_m[judged] - _target_m(trace)[judged] -> (_target_m(trace)[judged]) - (seen_m[judged])",
                _SIZE,
            ),
            ("if not (tilt_rad < SWINGING_RAD and speed_m_s < SWINGING_M_S):", "< -> <=", _EQUAL),
            ("if not (tilt_rad < SWINGING_RAD and speed_m_s < SWINGING_M_S):", "< -> <= #1", _EQUAL),
            ("if abs(off_m[farthest]) > FAR_M:", "> -> >=", _EQUAL),
        )
    },
    ("derived_margins.py", "if min(map(_reserve, axes)) >= 1.0:", ">= -> >"): _EQUAL,
    (
        "derived_margins.py",
        "document: dict[str, Any] = drone.model_dump(exclude_none=True)",
        "True -> False",
    ): "a section that there is not, either way",
    **{
        ("margins_record.py", line, change): _REPORT
        for line, change in (
            ("if self.axes is not None and (folder / RESPONSES).is_file():", _REVERSED),
            ("pictures = margin_panels(read_responses(folder / RESPONSES))", _REVERSED),
            ("pictures = margin_panels(read_responses(folder / RESPONSES))", "/ -> *"),
        )
    },
    **{
        ("hover_margins.py", line, change): reason
        for line, change, reason in (
            (
                _LOADS,
                "hover_thrust_n(flight.vehicle) / drone.weight_n if commands_thrust else 1.0 "
                "-> (hover_thrust_n(flight.vehicle) / drone.weight_n)",
                _NO_LOAD,
            ),
            (_LOADS, "1.0 -> 1.1", _NO_LOAD),
            (
                "delays, loads = np.broadcast_arrays(flight.link.delay_ticks, loads, "
                "np.zeros(flight.flights))[:2]",
                "zeros -> ones",
                "only its shape counts",
            ),
            (
                "controller = None if commands_thrust else linear_controller(settings)",
                "None if commands_thrust else linear_controller(settings) -> (None)",
                "the same system, made again for each drone",
            ),
        )
    },
    **{
        ("margins_run.py", line, change): _RESULTS
        for line, change in (
            (
                "new_results(folder, MarginsSummary.command, (*PICTURES, RESPONSES, DRONES))",
                "command -> motors",
            ),
            (
                "motors = not isinstance(flight.vehicle.loop, FirstOrderDrone)",
                "not isinstance(flight.vehicle.loop, FirstOrderDrone) "
                "-> (isinstance(flight.vehicle.loop, FirstOrderDrone))",
            ),
            ("curves = responses(loops, period_s, motors=motors)", "motors -> command"),
            ("write_responses(curves, place / RESPONSES)", "place / RESPONSES -> (RESPONSES) / (place)"),
            ("write_responses(curves, place / RESPONSES)", "/ -> *"),
            ("write_drones(found, place / DRONES)", "place / DRONES -> (DRONES) / (place)"),
            ("write_drones(found, place / DRONES)", "/ -> *"),
        )
    },
    ("response_file.py", "_COUNT: Final = 600", "600 -> 601"): _CHOICE,
    (
        "derived_margins.py",
        'seen: SensorsName = sensors if other.sensors.kind == drone.sensors.kind else "true"',
        'sensors if other.sensors.kind == drone.sensors.kind else "true" -> ("true")',
    ): "settings derived for sensors have about the same margins without these: no other cause is known",
    (
        "response_file.py",
        "updates, ticks = (one[one > _FIRST_RAD_S] for one in frequencies(loop, update_period_s, _COUNT))",
        "> -> >=",
    ): _EQUAL,
    **{
        ("drone_jacobians.py", line, change): reason
        for line, change, reason in (
            ("SETTLE_S: Final = 0.3", "0.3 -> 0.33", _CHOICE),
            ("_ROUNDING: Final = 1e-8", "1e-8 -> 1.1000000000000001e-08", _CHOICE),
            ("_CHANGE: Final = 1e-5", "1e-5 -> 1.1000000000000001e-05", _CHOICE),
            (
                "position_m = np.zeros((3, n))",
                "zeros -> ones",
                "nothing depends on the place beside the height",
            ),
            (_LOWER, "1e-9 -> 1.1000000000000001e-09", "any small number"),
            (
                "change = _CHANGE * np.maximum(1.0, np.abs(np.concatenate([base, inputs])))",
                "1.0 -> 1.1",
                _CHOICE,
            ),
            (
                'changes = np.einsum("rn,rc,s->rncs", change, np.eye(changed), signs).reshape(changed, -1)',
                "1 -> 2",
                _MISSING,
            ),
            (
                "both = np.concatenate([_numbers(after), outputs]).reshape(-1, n, changed, 2)",
                "1 -> 2",
                _MISSING,
            ),
            ("found.append(array.reshape(-1, n))", "1 -> 2", _MISSING),
            (
                "return numbers[first - count : first].reshape(*array.shape[:-1], -1)",
                "1 -> 2 #1",
                _MISSING,
            ),
            ("scale[:rows] = change[:rows] / _CHANGE", "/ -> *", _CHOICE),
            (
                "scale[:rows] = change[:rows] / _CHANGE",
                "change[:rows] / _CHANGE -> (_CHANGE) / (change[:rows])",
                _CHOICE,
            ),
            (
                "change = _CHANGE * np.maximum(1.0, np.abs(np.concatenate([base, inputs])))",
                "np.abs(np.concatenate([base, inputs])) -> (np.concatenate([base, inputs]))",
                _CHOICE,
            ),
            ("demand = np.zeros((signals.axes, inputs.shape[1]))", "zeros -> ones", "only its change counts"),
            ("period = 1", "1 -> 2", "a multiple of the ticks after which all repeats"),
            (
                "settling = -(-round(SETTLE_S / vehicle.drone.step_s) // ticks) * ticks",
                "// -> *",
                "a longer rest",
            ),
            (
                "suite = rebuild(suite, flight.flights, np.copy, "
                "GivenDraws(np.zeros((_noises(flight), flight.flights))))",
                "zeros -> ones",
                "each tick has other draws",
            ),
            (
                "suite = suite_of(replace(flight, sensors=given), (0,) * flight.flights, truth(state))",
                "0 -> 1",
                "nothing is drawn",
            ),
            ("rebuild(moving.suite, n, note, GivenDraws(np.zeros(0)))", "zeros -> ones", "not drawn from"),
            (
                "return _Moving(given, rebuild(moving.suite, n, take, GivenDraws(np.zeros(0))))",
                "0 -> 1",
                "each tick has other draws",
            ),
            (
                "return _Moving(given, rebuild(moving.suite, n, take, GivenDraws(np.zeros(0))))",
                "zeros -> ones",
                "each tick has other draws",
            ),
            (
                "size = np.abs(slopes) * (change / _CHANGE).T / scale[:, :, np.newaxis]",
                "/ -> * #1",
                _CHOICE,
            ),
            ("slopes = np.where(size > _ROUNDING, slopes, 0.0).swapaxes(0, 1)", "> -> >=", _EQUAL),
            ("rebuild(moving.suite, n, note, GivenDraws(np.zeros(0)))", "0 -> 1", "not drawn from"),
        )
    },
    (
        "corners.py",
        "document = drone.model_dump(exclude_none=True)",
        "True -> False #1",
    ): "a section that there is not, either way",
    **{
        ("many_drones.py", line, change): reason
        for line, change, reason in (
            ("FREQUENCIES: Final = 150", "150 -> 151", _CHOICE),
            ("_BATCH: Final = 10", "10 -> 11", "drones do not depend on how many are measured at once"),
            ("for first in range(0, drones, _BATCH):", "0 -> 1", _LONG),
            (_DRAWN, "min -> max", _LONG),
            (_DRAWN, "+ -> -", _LONG),
            ("progress(first + len(drawn))", "+ -> -", "only shown"),
            ("if np.isnan(values).all():", "all -> any", "all of the drones have motors, or none"),
            ("for axis, name in enumerate(one.axis for one in drones[0].axes):", "0 -> 1", _ALIKE),
            ("names = [axis.axis for axis in drones[0].axes]", "0 -> 1", _ALIKE),
            (
                'writer.writerow(["drone", *drones[0].values, *(f"{axis}_stable" for axis in names), *keys])',
                "0 -> 1",
                _ALIKE,
            ),
        )
    },
    (
        "rebuild.py",
        "case np.ndarray() if value.ndim and value.shape[-1] == columns and value.dtype == np.float64:",
        "and -> or",
    ): "the sensors that there are keep no other arrays",
    ("corners.py", "if gain * most_n <= drone.weight_n:", "<= -> <"): _EQUAL,
}
