"""Results of a campaign: summary, text and records for replay."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.campaign.file import Campaign, scenario
from mambo_nmpc.sil.campaign.flights import CRASHED, DIGEST
from mambo_nmpc.sil.campaign.statistics import Table, summarise, worst
from mambo_nmpc.sil.campaign.store import FLIGHT, Store, refusals
from mambo_nmpc.sil.flight.scenario import Record, write_record

RECORDS: Final = "flights"
_SHOWN: Final = {"0.05": "5 %", "0.5": "median", "0.95": "95 %", "1": "worst"}


def numeric(store: Store) -> Table:
    """Return the numeric columns of the table."""
    return {
        name: np.array(values, np.float64)
        for name, values in store.values().items()
        if not name.endswith(DIGEST) and name != "seed"
    }


def summary_of(campaign: Campaign, table: Table) -> dict[str, Any]:
    """Return statistics of a finished campaign, and the worst flights with the names of their records."""
    names = [entrant.name for entrant in campaign.entrants]
    return {
        "campaign": campaign.document(),
        "flights": len(table[FLIGHT]),
        **summarise(table, names, sensed=campaign.file.flight.sensors != "none"),
        "worst": {name: [_worst(table, name, row) for row in worst(table, name)] for name in names},
    }


def _worst(table: Table, name: str, row: int) -> dict[str, Any]:
    flight = int(table[FLIGHT][row])
    return {
        "flight": flight,
        "crashed": bool(table[f"{name}_{CRASHED}"][row]),
        "iae_m_s": float(table[f"{name}_iae_m_s"][row]),
        "max_error_m": float(table[f"{name}_max_error_m"][row]),
        "record": _record_name(flight, name),
    }


def _record_name(flight: int, name: str) -> str:
    return f"{RECORDS}/{flight:06}-{name}.json"


def write_records(campaign: Campaign, store: Store) -> None:
    """Write one record per flight and controller for `fly --replay`; raises UnwritableError."""
    values = store.values()
    section = campaign.file.flight.model_dump()
    with refusals(store.folder):
        (store.folder / RECORDS).mkdir(exist_ok=True)
        for row, flight in enumerate(map(int, values[FLIGHT])):
            flown = scenario(section, campaign.draw(flight))
            for entrant in campaign.entrants:
                digest = values[f"{entrant.name}_{DIGEST}"][row]
                record = Record(
                    scenario=flown,
                    controller=entrant.kind,
                    settings=entrant.settings,
                    trace_sha256=digest,
                )
                write_record(record, store.folder / _record_name(flight, entrant.name))


def campaign_text(summary: Mapping[str, Any], folder: str) -> str:
    """Return a summary as text: statistics per controller, improvements, commands to replay the worst."""
    lines: list[str] = []
    for name, found in summary["controllers"].items():
        lines.append(f"{name:34}" + "".join(f"{title:>10}" for title in _SHOWN.values()))
        for index, quantiles in found["quantiles"].items():
            values = "".join(f"{_digits(quantiles[share]):>10}" for share in _SHOWN)
            lines.append(f"  {index:32}{values}")
        lines.append(f"  crashed: {_proportion(found['crashed'])}")
        if found["refused_an_input"]["count"]:
            lines.append(f"  rejected an input: {_proportion(found['refused_an_input'])}")
        lines.append("")
    if summary["improvements"]:
        first = next(iter(summary["controllers"]))
        lines.append(f"ratio of {first} to the other, per flight: median, 95 % interval, ratio above 1 in")
        lines += [_improvement(one) for one in summary["improvements"]]
        lines.append("")
    lines.append("worst flights by IAE, and the commands that replay them:")
    for name, flights in summary["worst"].items():
        for one in flights:
            what = "crashed" if one["crashed"] else f"{_digits(one['iae_m_s'])} m s"
            lines.append(f"  {name:12} {what:>12}  mambo-nmpc fly --replay {echo(folder)}/{one['record']}")
    return "\n".join(lines)


def _improvement(one: Mapping[str, Any]) -> str:
    interval = f"{_digits(one['low'])} .. {_digits(one['high'])}"
    return (
        f"  {one['controller']:12} {one['index']:18}{_digits(one['median']):>9}  {interval:20}"
        f"{_proportion(one['better'])}"
    )


def _proportion(one: Mapping[str, Any]) -> str:
    return (
        f"{one['count']} of {one['flights']} flights, "
        f"{100 * one['share']:.3g} % ({100 * one['low']:.3g} .. {100 * one['high']:.3g} %)"
    )


def _digits(value: float) -> str:
    return f"{value:.0f}" if 1000 <= abs(value) < np.inf else f"{value:.4g}"
