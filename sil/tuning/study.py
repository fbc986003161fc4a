"""The study: Optuna proposes settings, flights of the compiled C evaluate them, a database stores both.

Trials are proposed in rounds of `ROUND`, each with a seed of its own, so the proposals depend neither on the
number of workers nor on interruptions.
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
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from mambo_nmpc.codegen import __version__
from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.campaign.distributions import Distribution
from mambo_nmpc.sil.campaign.executors import Pool
from mambo_nmpc.sil.campaign.file import Entrant
from mambo_nmpc.sil.campaign.flights import CRASHED, Row, fly_batch
from mambo_nmpc.sil.errors import StudyError
from mambo_nmpc.sil.tuning.file import Tuning

if TYPE_CHECKING:
    from optuna import Study, Trial

ROUND: Final = 8
"""Trials proposed together, before any of them is evaluated."""

DRAWN_AT_RANDOM: Final = 20
"""Random trials before the sampler uses earlier results."""

CRASH_ERROR_M: Final = 10.0
"""Constant error that a crashed flight is assigned; the IAE of every flight is bounded by it, too."""

DATABASE: Final = "study.db"

_NAME: Final = "tuned"
_OWNER: Final = "folder"


@dataclass(frozen=True)
class FinishedTrial:
    """One finished trial: settings and results, which are means over all flights."""

    number: int
    values: dict[str, float]
    """Value by key of controller.toml, as in cost.effort_weight."""
    iae_m_s: float
    command_variation_rad: float
    crashed: int


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


def search(
    tuning: Tuning, study: "Study", folder: Path, trials: int, *, pool: Pool, progress: Callable[[int], None]
) -> None:
    """Run trials until the study has `trials` finished ones; call `progress` with their number.

    Trials that an earlier run in `folder` proposed and did not finish are flown first. Raises WorkerError.
    """
    drawn = tuning.draw_flights()
    flight = tuning.file.flight.model_dump()
    owner = f"{socket.gethostname()}:{folder.resolve()}"
    if not study.get_trials(deepcopy=False):
        study.enqueue_trial(tuning.start)
    progress(len(finished_trials(study)))
    while (finished := len(finished_trials(study))) < trials:
        proposed = _find_unfinished(tuning, study, owner)
        count = min(ROUND - _count_proposed(study) % ROUND, trials - finished - len(proposed))
        proposed |= dict(_propose(tuning, study, owner) for _ in range(max(count, 0)))
        tasks = [
            (__version__, [Entrant(_NAME, "nmpc", tuning.settings(values)).document()], flight, drawn)
            for values in proposed.values()
        ]
        numbers = list(proposed)
        for task, rows in pool.run(fly_batch, tasks):
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


def _count_proposed(study: "Study") -> int:
    """Return how many trials have been proposed."""
    return sum(one.state.name != "WAITING" for one in study.get_trials(deepcopy=False))


def _propose(tuning: Tuning, study: "Study", owner: str) -> tuple[int, dict[str, float]]:
    """Propose a new trial; return its number and values."""
    from optuna.samplers import TPESampler  # noqa: PLC0415 - an optional extra

    entropy = np.random.SeedSequence(tuning.file.seed, spawn_key=(_count_proposed(study),))
    seed = int(entropy.generate_state(1)[0])
    study.sampler = TPESampler(
        n_startup_trials=DRAWN_AT_RANDOM, multivariate=True, constant_liar=True, seed=seed
    )
    trial = study.ask()
    trial.set_user_attr(_OWNER, owner)
    return trial.number, {path: _suggest(trial, path, found) for path, found in tuning.search.items()}


def _suggest(trial: "Trial", path: str, found: Distribution) -> float:
    """Return the sampler's proposal for one key."""
    if found.kind == "choice":
        value: Any = trial.suggest_categorical(path, found.numbers)
        return float(value)
    return trial.suggest_float(path, *found.numbers, log=found.kind == "log_uniform")


def _find_unfinished(tuning: Tuning, study: "Study", owner: str) -> dict[int, dict[str, float]]:
    """Return the unfinished trials of an earlier run of `owner`; fail those without all values."""
    from optuna.trial import TrialState  # noqa: PLC0415 - an optional extra

    whole = {}
    for one in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        if one.user_attrs.get(_OWNER) != owner:
            continue
        if set(one.params) == set(tuning.search):
            whole[one.number] = dict(one.params)
        else:
            study.tell(one.number, state=TrialState.FAIL)
    return whole
