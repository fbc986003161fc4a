"""What the consumers of settings do with a flight of an option: Python API, campaigns, logs, and the like.

Each function returns "=" if it compares bits, "+" if there is nothing to compare with, and raises what the
consumer raises.
"""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from mambo_codegen.settings.controller_toml import to_toml
from mambo_nmpc import Controller, DroneState, TargetState
from mambo_nmpc.adapters.rotorpy import RotorpyController
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.campaign.campaign_flights import DIGEST, fly_scenarios
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.frames import vectors_to_ned
from mambo_sil.flight.scenario import flight_of
from mambo_sil.model.replay.log_replay import replay_log
from tests.support.option_flights import OptionFlights, Update

Consumer = Callable[[OptionFlights, Path], str]
TARGET_COLUMNS: Final = ("target_x_m", "target_y_m", "target_vx_m_s", "target_vy_m_s")
KNOWN_COLUMNS: Final = ("target_ax_m_s2", "target_ay_m_s2")
AHEAD_COLUMNS: Final = ("target_ahead_x_m_s2", "target_ahead_y_m_s2", "target_known")
HEIGHT_COLUMNS: Final = (
    *("target_height_m", "target_climb_m_s", "target_climb_acceleration_m_s2"),
    "target_climb_ahead_m_s2",
)
STATE_COLUMNS: Final = ("x_m", "y_m", "vx_m_s", "vy_m_s", "roll_rad", "pitch_rad", "yaw_rad", "z_m", "vz_m_s")
COMMAND_COLUMNS: Final = ("roll_command_rad", "pitch_command_rad")


def campaign(flights: OptionFlights, _folder: Path) -> str:
    """Compare a flight of a campaign with that of the command `fly`."""
    flight = flight_of([flights.scenario], flights.settings.horizon.update_period_s)
    own = fly(flight, flights.compiled())
    (row,) = fly_scenarios([Entrant("own", "nmpc", flights.settings)], [flights.scenario], lambda _: None)
    assert row[f"own_{DIGEST}"] == own.digest()
    return "="


def api(flights: OptionFlights, folder: Path) -> str:
    """Compare the commands of a Controller, read from a file, with those of the flight."""
    controller = Controller.from_file(written(flights, folder))
    for update in flights.updates:
        if flights.method.has_height and not np.isnan(update.thrust_m_s2).any():
            controller.report_thrust(update.thrust_m_s2)
        thrust = () if flights.method.has_height else (update.thrust_m_s2,)
        done = controller.step(*_records(update), *thrust)
        numbers = [*done.command_rad[0], *(() if done.thrust_m_s2 is None else done.thrust_m_s2)]
        assert np.array(numbers, np.float64).tobytes() == update.command.tobytes()
    return "="


def height(flights: OptionFlights, folder: Path) -> str:
    """Compare a Controller with an altitude loop with the C that is given that loop's thrust."""
    path = written(flights, folder)
    controller = Controller.from_file(path, vehicle=flights.name, height="pid")
    compiled = flights.compiled()
    for update in flights.updates:
        done = controller.step(*_records(update))
        assert done.thrust_m_s2 is not None
        expected = compiled.step(update.state[:, :7], update.target, done.thrust_m_s2)
        assert expected.command_rad.tobytes() == done.command_rad.tobytes()
    return "="


def replay(flights: OptionFlights, folder: Path) -> str:
    """Compare the replay of a log with the flight."""
    path = folder / "log.csv"
    updates = flights.calm_updates
    _write_log(flights, updates, path)
    replayed = replay_log(path, {}, flights.settings)
    assert replayed.is_exact
    assert replayed.replayed_rad.tobytes() == replayed.logged_rad.tobytes()
    assert len(replayed.time_s) == len(updates)
    return "="


def playground(flights: OptionFlights, folder: Path) -> str:
    """Take it into a page."""
    from mambo_extensions.playground.page_controllers import page_controllers  # noqa: PLC0415 - an extension

    (found,) = page_controllers([str(written(flights, folder))])
    assert found.commands_thrust == flights.method.has_height
    return "+"


def rotorpy(flights: OptionFlights, folder: Path) -> str:
    """Compare the thrust that the controller of RotorPy commands with that of the Python API."""
    path, has_height = written(flights, folder), flights.method.has_height
    ours, inner = (
        Controller.from_file(path)
        if has_height
        else Controller.from_file(path, vehicle=flights.name, height="pid")
        for _ in range(2)
    )
    theirs = RotorpyController(inner, 1.0)
    for number, update in enumerate(flights.updates):
        state, target = _records(update)
        place, speed, aim, aim_speed = (
            vectors_to_ned("NWU", each)[0]
            for each in (state.position_m, state.velocity_m_s, target.position_m, target.velocity_m_s)
        )
        assert target.acceleration_m_s2 is not None
        goal = {"x": aim, "x_dot": aim_speed, "x_ddot": vectors_to_ned("NWU", target.acceleration_m_s2)[0]}
        quaternion = np.array([0.0, 0.0, 0.0, 1.0])
        made = theirs.update(0.01 * number, {"x": place, "v": speed, "q": quaternion}, goal | {"yaw": 0.0})
        level = DroneState(state.position_m[0], state.velocity_m_s[0], np.zeros(3))
        if number == 0:
            ours.reset()
        wanted = TargetState(
            target.position_m[0], target.velocity_m_s[0], target.acceleration_m_s2[0], yaw_rad=0.0
        )
        *_, thrust_n = ours.step(level, wanted).attitude_thrust("NWU", mass_kg=1.0)
        assert made["cmd_thrust"] == thrust_n
    return "="


def pilot(flights: OptionFlights, folder: Path) -> str:
    """Make a pilot, without a flight."""
    from mambo_nmpc import Pilot  # noqa: PLC0415 - of an extension

    Pilot.simulate(written(flights, folder), flights.name)
    return "+"


ALL: Final[dict[str, Consumer]] = {
    "fly": lambda flights, _: flights.in_engine(),
    "wrapped": lambda flights, _: flights.in_wrappers(),
    "campaign": campaign,
    "told": lambda flights, _: flights.told(),
    "api": api,
    "height": height,
    "replay": replay,
    "playground": playground,
    "rotorpy": rotorpy,
    "pilot": pilot,
}


def written(flights: OptionFlights, folder: Path) -> Path:
    """Write the settings into a folder and return the path."""
    path = folder / "controller.toml"
    path.write_text(to_toml(flights.settings), "utf-8")
    return path


def _records(update: Update) -> tuple[DroneState, TargetState]:
    """Return the inputs of one drone as the Python API takes them, with all that a target can say."""
    state, target = update.state, update.target
    upward = np.hstack([target, np.zeros((1, 4))])[:, 9:13] if target.shape[1] > 9 else np.zeros((1, 4))
    *given, ahead = (
        _down(np.column_stack([target[:, [2 * order, 2 * order + 1]], upward[:, order]]))
        for order in range(4)
    )
    heights, climbs = (state[:, 7:8], state[:, 8:9]) if state.shape[1] > 7 else np.ones((2, 1, 1))
    return (
        DroneState(
            _down(np.concatenate([state[:, :2], heights], axis=1)),
            _down(np.concatenate([state[:, 2:4], climbs], axis=1)),
            state[:, 4:7],
            state[:, 9] != 0.0 if state.shape[1] > 9 else False,
        ),
        TargetState(*given, ahead_m_s2=ahead),
    )


def _down(vectors: FloatArray) -> FloatArray:
    """Return vectors (..., 3) whose z points up with z down."""
    return np.asarray(vectors * (1.0, 1.0, -1.0))


def _write_log(flights: OptionFlights, updates: list[Update], path: Path) -> None:
    """Write a log of the flight with every column that replay reads."""
    rows: list[dict[str, Any]] = []
    for number, update in enumerate(updates):
        state, target = update.state[0], update.target[0]
        row = {"time_s": number * flights.settings.horizon.update_period_s}
        if len(state) > 7:
            state = np.concatenate([state[:7], -state[7:9]])
        row |= dict(zip(STATE_COLUMNS, state, strict=False))
        row |= dict(
            zip((*TARGET_COLUMNS, *KNOWN_COLUMNS, *AHEAD_COLUMNS, *HEIGHT_COLUMNS), target, strict=False)
        )
        row |= dict(zip(COMMAND_COLUMNS, update.command[0], strict=False))
        if not flights.method.has_height:
            row["thrust_acceleration_m_s2"] = update.thrust_m_s2[0]
        rows.append(row)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: repr(float(value)) for name, value in row.items()} for row in rows)
