"""The columns of a trace that say what a controller got of its targets beside place and velocity."""

from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.columns import own_columns
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.traces import CSV_COLUMNS, HEIGHT_COLUMNS
from mambo_sil.model.replay.logged_columns import signals_of


def target_columns(flight: Flight, settings: Settings) -> dict[str, FloatArray]:
    """Return the columns (k,) by their names in a log; none of a controller that is told no more."""
    port = method_of(settings).port
    given = flight.given_targets if settings.height is None else flight.targets_in_space
    names = (*signals_of(port, "target"), *(f"target_{one.member}" for one in port.wholes("target")))
    columns = dict(zip(names, own_columns(port, "target"), strict=True))
    return {
        name: given[:, 0, column]
        for name, column in columns.items()
        if name not in (*CSV_COLUMNS, *HEIGHT_COLUMNS)
    }
