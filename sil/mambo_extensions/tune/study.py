"""The study: Optuna proposes settings, flights of the compiled C evaluate them, a database stores both.

Trials are proposed in rounds of `ROUND`, each with a seed of its own, from the results of the rounds before.
A trial is stored with all its values in one transaction. So the proposals depend neither on the number of
workers nor on interruptions, at whatever moment.
"""

import contextlib
import hashlib
import json
import shlex
import socket
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from mambo_codegen import __version__
from mambo_codegen.errors import echo
from mambo_extensions.tune.tuning_file import Tuning
from mambo_sil.errors import StudyError
from mambo_sil.experiment.campaign.campaign_flights import CRASHED, Row, fly_batch
from mambo_sil.experiment.campaign.distributions import Distribution
from mambo_sil.experiment.campaign.executors import Pool
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.experiment.margins.margin_reserve import Reserve

if TYPE_CHECKING:
    from optuna import Study, Trial
    from optuna.trial import FrozenTrial

ROUND: Final = 8
"""Trials proposed together, before any of them is evaluated."""

DRAWN_AT_RANDOM: Final = 20
"""Random trials before the sampler uses earlier results."""

CRASH_ERROR_M: Final = 10.0
"""Constant error that a crashed flight is assigned; the IAE of every flight is bounded by it, too."""

DATABASE: Final = "study.db"

IAE_ALLOWANCE: Final = 1.1
"""Bound on the IAE of the chosen point, relative to the least IAE found."""
RULE: Final = "the least command variation with an IAE within 10 % of the least found"
"""How the point is chosen of those that keep their margins; stands in controller.toml."""

_NAME: Final = "tuned"
_OWNER: Final = "folder"
_SEED_BYTES: Final = 8


@dataclass(frozen=True)
class FinishedTrial:
    """One finished trial: settings and results, which are means over all flights."""

    number: int
    values: dict[str, float]
    """Value by key of controller.toml, as in cost.effort_weight."""
    iae_m_s: float
    command_variation_rad: float
    crashed: int
    margins: Reserve | None = None
    """What is left of the margins of the reference, where it was measured."""


@contextlib.contextmanager
def open_study(tuning: Tuning, folder: Path, storage: str | None) -> Iterator["Study"]:
    """Open the study of `tuning` in the database at the URL `storage`, or in a file in `folder`.

    The name of the study is derived from its document, so several studies can share a database. Raises
    StudyError if Optuna is not installed or the database refuses an access.
    """
    demand_optuna()
    import optuna  # noqa: PLC0415 - an optional extra
    from sqlalchemy.exc import SQLAlchemyError  # noqa: PLC0415 - comes with it

    optuna.logging.set_verbosity(optuna.logging.CRITICAL)
    where = f"sqlite:///{(folder / DATABASE).resolve()}" if storage is None else storage
    named = echo(str(folder / DATABASE)) if storage is None else "--storage"
    try:
        database = optuna.storages.RDBStorage(where)
        try:
            yield optuna.create_study(
                storage=database,
                study_name=study_name(tuning),
                directions=["minimize", "minimize"],
                load_if_exists=True,
            )
        finally:
            database.remove_session()
            database.engine.dispose()
    except (SQLAlchemyError, ImportError, optuna.exceptions.StorageInternalError) as error:
        reason = str(error.__cause__ or error).splitlines()[0]
        raise StudyError(
            f"{named}: the database refused an access ({echo(reason)}); its trials are kept. A URL is as in "
            "sqlite:////home/me/study.db or postgresql://host/name, with that database's driver installed"
        ) from error


def demand_optuna() -> None:
    """Raise StudyError, which says how to install Optuna, unless it is installed."""
    try:
        import optuna  # noqa: F401, PLC0415 - an optional extra
    except ImportError:
        install = shlex.join([sys.executable, "-m", "pip", "install", "optuna"])
        raise StudyError(f"tuning needs Optuna; install it: {install}") from None


def study_name(tuning: Tuning) -> str:
    """Return the name of a study in its database."""
    document = {"version": __version__, **tuning.document()}
    return f"mambo-nmpc-{hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16]}"


def owner_of(folder: Path, storage: str | None) -> str:
    """Return the name under which trials of a run in `folder` are stored; empty for a database of its own."""
    return "" if storage is None else f"{socket.gethostname()}:{folder.resolve()}"


def search(
    tuning: Tuning,
    study: "Study",
    owner: str,
    trials: int,
    *,
    pool: Pool,
    progress: Callable[[int], None],
    running: Callable[[float], None] = lambda _: None,
) -> None:
    """Run trials until the study has `trials` finished ones.

    Calls `progress` with their number, and `running` with what the running ones amount to. Trials that an
    earlier run of `owner` proposed and did not finish are flown before the next round is proposed. Raises
    WorkerError.
    """
    drawn = tuning.draw_flights()
    flight = tuning.flight
    progress(len(finished_trials(study)))
    while (finished := len(finished_trials(study))) < trials:
        waiting, proposed = _find_unfinished(study, owner), len(study.get_trials(deepcopy=False))
        room = -proposed % ROUND if waiting else ROUND - proposed % ROUND
        for _ in range(min(room, trials - finished - len(waiting))):
            study.add_trial(propose(tuning, study, owner))
        flown = _find_unfinished(study, owner)
        entrants = [Entrant(_NAME, "nmpc", tuning.settings(values)) for values in flown.values()]
        tasks = [(__version__, [entrant.document()], flight, drawn) for entrant in entrants]
        numbers = list(flown)
        for task, rows in pool.run(fly_batch, tasks, running):
            crashed, means = judge(rows, tuning.file.flight.duration_s, tuning.base.limits.tilt_rad)
            study.set_user_attr(f"{CRASHED}_{numbers[task]}", crashed)
            study.tell(numbers[task], means)
            progress(len(finished_trials(study)))


def judge(rows: Sequence[Row], duration_s: float, tilt_rad: float) -> tuple[int, tuple[float, float]]:
    """Return the number of crashed flights, and the means of IAE and command variation over all flights.

    A crashed flight is assigned a constant error of `CRASH_ERROR_M` and a command that jumps between its
    limits at every update. These values bound those of all other flights, too.
    """
    worst = np.array([CRASH_ERROR_M * duration_s, 4.0 * tilt_rad])
    found = np.array(
        [[row[f"{_NAME}_{key}"] for key in ("iae_m_s", "command_variation_rad")] for row in rows], np.float64
    )
    crashed = np.array([row[f"{_NAME}_{CRASHED}"] for row in rows], np.float64) > 0.0
    found[crashed] = worst
    iae_m_s, variation_rad = np.minimum(found, worst).mean(axis=0).tolist()
    return int(crashed.sum()), (iae_m_s, variation_rad)


def finished_trials(study: "Study") -> list[FinishedTrial]:
    """Return the finished trials of a study by number."""
    crashed = study.user_attrs
    return [
        FinishedTrial(
            one.number, dict(one.params), one.values[0], one.values[1], crashed[f"{CRASHED}_{one.number}"]
        )
        for one in study.get_trials(deepcopy=False)
        if one.state.name == "COMPLETE"
    ]


def pareto_front(trials: Sequence[FinishedTrial]) -> list[FinishedTrial]:
    """Return the Pareto-optimal trials in IAE and command variation, sorted by IAE."""
    front: list[FinishedTrial] = []
    for trial in sorted(trials, key=lambda one: (one.iae_m_s, one.command_variation_rad, one.number)):
        if not front or trial.command_variation_rad < front[-1].command_variation_rad:
            front.append(trial)
    return front


def choose(
    trials: Sequence[FinishedTrial], keeps_margins: Callable[[FinishedTrial], bool] = lambda _: True
) -> FinishedTrial | None:
    """Return the trial according to `RULE` of those that keep their margins; None if none does.

    Asks of as few trials as it needs.
    """
    ordered = sorted(trials, key=lambda one: (one.iae_m_s, one.command_variation_rad, one.number))
    closest = next((index for index, one in enumerate(ordered) if keeps_margins(one)), None)
    if closest is None:
        return None
    near = [one for one in ordered[closest:] if one.iae_m_s <= IAE_ALLOWANCE * ordered[closest].iae_m_s]
    calm = sorted(near, key=lambda one: one.command_variation_rad)
    return next(one for one in calm if keeps_margins(one))


def propose(tuning: Tuning, study: "Study", owner: str) -> "FrozenTrial":
    """Return the next trial of `study` with all its values; the study itself stays as it is.

    The first trial has the base's values. The sampler works on a copy in memory, in which the other trials of
    this round are still running, as they are in a run without interruption.
    """
    import optuna  # noqa: PLC0415 - an optional extra

    before = study.get_trials(deepcopy=False)
    number = len(before)
    shared = int.from_bytes(hashlib.sha256(owner.encode()).digest()[:_SEED_BYTES])
    key = (number, shared) if owner else (number,)
    seed = int(np.random.SeedSequence(tuning.file.seed, spawn_key=key).generate_state(1)[0])
    sampler = optuna.samplers.TPESampler(
        n_startup_trials=DRAWN_AT_RANDOM, multivariate=True, constant_liar=True, seed=seed
    )
    copy = optuna.create_study(sampler=sampler, directions=study.directions)
    copy.add_trials(_show_as_running(one) if one.number >= number - number % ROUND else one for one in before)
    if not before:
        copy.enqueue_trial(tuning.start)
    trial = copy.ask()
    trial.set_user_attr(_OWNER, owner)
    for path, found in tuning.search.items():
        _suggest(trial, path, found)
    return copy.get_trials(deepcopy=False)[number]


def _show_as_running(trial: "FrozenTrial") -> "FrozenTrial":
    """Return a trial as it was before it finished."""
    from optuna.trial import TrialState, create_trial  # noqa: PLC0415 - an optional extra

    return create_trial(
        state=TrialState.RUNNING,
        params=trial.params,
        distributions=trial.distributions,
        user_attrs=trial.user_attrs,
        system_attrs=trial.system_attrs,
    )


def _suggest(trial: "Trial", path: str, found: Distribution) -> None:
    """Have the sampler propose the value of one key."""
    if found.kind == "choice":
        trial.suggest_categorical(path, found.numbers)
    else:
        trial.suggest_float(path, *found.numbers, log=found.kind == "log_uniform")


def _find_unfinished(study: "Study", owner: str) -> dict[int, dict[str, float]]:
    """Return number and values of the trials that `owner` has proposed and not finished."""
    from optuna.trial import TrialState  # noqa: PLC0415 - an optional extra

    running = study.get_trials(deepcopy=False, states=(TrialState.RUNNING,))
    return {one.number: dict(one.params) for one in running if one.user_attrs.get(_OWNER) == owner}
