"""The curves that a campaign draws from, of which some may be the user's own, in files."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_sil.errors import FlightError, TrajectoryError
from mambo_sil.experiment.campaign.distributions import Distribution
from mambo_sil.flight.own_curve import check_curve, curve_named, is_curve_file, load_curve
from mambo_sil.flight.own_file import whole_name
from mambo_sil.flight.trajectories import is_spatial


def chosen_curves(drawn: Distribution) -> tuple[str, ...]:
    """Return the names of the curves that may be drawn."""
    return tuple(str(drawn.domain.value(number)) for number in drawn.numbers)


def spatial_curves(drawn: Distribution) -> bool:
    """Return whether any curve that may be drawn has a height."""
    return any(is_spatial(curve_named(name, 1.0, 1.0)) for name in chosen_curves(drawn))


def with_files(document: dict[str, Any], drawn: Distribution) -> dict[str, Any]:
    """Return what determines flights, the files of curves by name and hashes: the same in every folder."""
    found = dict[str, list[str]]()
    for name in filter(is_curve_file, chosen_curves(drawn)):
        found.setdefault(Path(name).name, []).append(load_curve(name)[1])
    if not found:
        return document
    names = tuple(Path(name).name if is_curve_file(name) else name for name in drawn.domain.names)
    written = replace(drawn, domain=replace(drawn.domain, names=names)).document()
    return document | {"flight": document["flight"] | {"trajectory": written}, "curves": found}


def located(drawn: Distribution, duration_s: float, folder: Path, place: str) -> Distribution:
    """Return the distribution with the whole paths of files in `folder`, whose curves are checked.

    Raises InvalidSettingsError, whose line begins with `place`.
    """
    names = dict[str, str]()
    for name in filter(is_curve_file, chosen_curves(drawn)):
        names[name] = whole_name(name, folder)
        try:
            check_curve(echo(names[name]), load_curve(names[name])[0], duration_s)
        except (FlightError, TrajectoryError) as error:
            raise InvalidSettingsError((f"{place}: {error}",)) from None
    return replace(
        drawn,
        domain=replace(drawn.domain, names=tuple(names.get(name, name) for name in drawn.domain.names)),
    )
