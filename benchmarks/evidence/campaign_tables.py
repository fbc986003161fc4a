"""Tables of campaigns: figures out of results, and Markdown out of figures."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.evidence.item import Figures
from benchmarks.evidence.tables import Row, summary, three, title
from benchmarks.markdown import table
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.campaign.statistics import Table, index_values, read_table
from mambo_sil.experiment.campaign.store import DATABASE

MOTOR_LAGS_S: Final = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05)
_SHOWN: Final = {
    "iae_m_s": ("0.05", "0.5", "0.95"),
    "seen_iae_m_s": ("0.5", "0.95"),
    "command_variation_rad": ("0.5", "0.95"),
}
"""Quantiles in tables, by index."""
SLOW_MOTORS: Final = {
    "slow-motors": "eight at 0.5 rad/s",
    "slow-motors-circle": "circle at 1.5 rad/s",
    "slow-motors-fast-eight": "eight at 0.8 rad/s",
}
"""The curve of each campaign of light drones with slow motors."""
_SUMMARISED: Final = {
    "pd": "PD of the paper",
    "table1": "`table1`, its NMPC",
    "pd-feedforward": "PD with feed-forward",
    "pid-feedforward": "PID with feed-forward",
    "mambo": "`mambo`, our MPC",
}
"""The controllers that README shows, with their titles there."""


def read_quantiles(results: Path) -> Figures:
    """Return crashes and quantiles of each controller in a campaign."""
    return _quantiles(summary(results / "campaign"))


def read_campaign(results: Path) -> Figures:
    """Return statistics of each controller, improvements, and medians by motor lag."""
    folder = results / "campaign"
    found = summary(folder)
    indices = [one["index"] for one in found["improvements"] if not one["index"].startswith("seen_")]
    return _quantiles(found) | {
        "improvements": _improvements(found, indices),
        "motor_lags": _by_motor_lag(read_table(folder / DATABASE), list(found["controllers"])),
    }


def read_opponents(results: Path) -> Figures:
    """Return statistics of each controller by campaign, and improvements of both errors, seen and true."""
    found = {name: summary(results / name) for name in ("drawn", *SLOW_MOTORS)}
    compared = _improvements(found["drawn"], ("iae_m_s", "seen_iae_m_s"))
    return {name: _quantiles(one) for name, one in found.items()} | {"improvements": compared}


def _improvements(found: Figures, indices: Sequence[str]) -> list[Figures]:
    """Return the improvements of some indices; of the share of flights in which one is better no interval."""
    return [
        one | {"better": {"share": one["better"]["share"]}}
        for one in found["improvements"]
        if one["index"] in indices
    ]


def _quantiles(found: Figures) -> Figures:
    """Return crashes, and the quantiles that tables show, of each controller in the record of a campaign."""
    return {
        "flights": found["flights"],
        "controllers": {
            name: {
                "crashed": one["crashed"],
                "quantiles": {
                    index: {share: one["quantiles"][index][share] for share in shares}
                    for index, shares in _SHOWN.items()
                },
            }
            for name, one in found["controllers"].items()
        },
    }


def _by_motor_lag(flights: Table, names: Sequence[str]) -> list[Figures]:
    """Return median IAE and crashes of each controller, and where `mambo` beats the PD with feed-forward."""
    rows = []
    for low, high in pairwise(MOTOR_LAGS_S):
        inside = (flights["motor_lag_s"] >= low) & (flights["motor_lag_s"] < high)
        if not inside.any():
            continue
        iae = {name: index_values(flights, name, "iae_m_s")[inside] for name in names}
        rows.append(
            {
                "from_s": low,
                "to_s": high,
                "flights": int(inside.sum()),
                "median_iae_m_s": {name: _median(values) for name, values in iae.items()},
                "crashed": {name: int(np.isinf(values).sum()) for name, values in iae.items()},
                "mambo_better": float((iae["mambo"] < iae["pd-feedforward"]).mean()),
            }
        )
    return rows


def _median(values: FloatArray) -> float:
    """Return the median without interpolation, because values may be infinite."""
    return float(np.quantile(values, 0.5, method="inverted_cdf"))


def _percent(share: float) -> str:
    return f"{100 * share:.3g}"


def campaign(figures: Figures) -> str:
    """Return crashes and quantiles of each controller."""
    rows: list[Row] = []
    for name, one in figures["controllers"].items():
        crashed, quantiles = one["crashed"], one["quantiles"]
        interval = f"{_percent(crashed['low'])} .. {_percent(crashed['high'])}"

        def shares(index: str, quantiles: Any = quantiles) -> str:
            return ", ".join(three(quantiles[index][share]) for share in _SHOWN[index])

        rows.append(
            {
                f"{figures['flights']} flights": title(name),
                "crashed (95 %)": f"{crashed['count']}, {_percent(crashed['share'])} % ({interval})",
                "IAE, m s: 5 %, median, 95 % of the flights": shares("iae_m_s"),
                "as estimated: median, 95 %": shares("seen_iae_m_s"),
                "variation, rad: median, 95 %": shares("command_variation_rad"),
            }
        )
    return table(rows)


def campaign_ratios(figures: Figures) -> str:
    """Return the ratio of the PD's indices to each controller's, flight by flight."""
    head = "improvement on the PD, flight by flight: median (95 %), better in"
    rows: dict[str, Row] = {}
    for one in figures["improvements"]:
        index = one["index"].partition("_")[0].upper()
        better = f"{_percent(one['better']['share'])} %"
        interval = f"{three(one['low'])} .. {three(one['high'])}"
        row = rows.setdefault(index, {head: index})
        row[title(one["controller"])] = f"{three(one['median'])} ({interval}), {better}"
    return table(list(rows.values()))


def campaign_motor_lag(figures: Figures) -> str:
    """Return medians and crashes by motor lag."""
    rows: list[Row] = []
    for one in figures["motor_lags"]:
        row = {"motor lag, s": f"{one['from_s']:.2f} .. {one['to_s']:.2f}", "flights": str(one["flights"])}
        for name, median in one["median_iae_m_s"].items():
            lost = one["crashed"][name]
            row[f"{title(name)}: median IAE, m s"] = three(median) + (f", {lost} crashed" if lost else "")
        row["`mambo` better than PD with feed-forward"] = f"{_percent(one['mambo_better'])} %"
        rows.append(row)
    return table(rows)


def opponents(campaign_name: str) -> Callable[[Figures], str]:
    """Return what writes crashes and quantiles of a campaign of the opponents."""
    return lambda figures: campaign(figures[campaign_name])


def opponents_ratios(figures: Figures) -> str:
    """Return the ratio of the errors of the PID with feed-forward to each controller's, flight by flight."""
    rows: dict[str, Row] = {}
    for index, error in (("seen_iae_m_s", "estimated error"), ("iae_m_s", "true error")):
        for one in figures["improvements"]:
            if one["index"] == index:
                name = title(one["controller"])
                row = rows.setdefault(name, {"error of the PID with feed-forward divided by that of": name})
                row[f"{error}: median (95 %)"] = (
                    f"{three(one['median'])} ({three(one['low'])} .. {three(one['high'])})"
                )
                row[f"{error}: the other is closer in"] = f"{_percent(one['better']['share'])} %"
    return table(list(rows.values()))


def opponents_summary(figures: Figures) -> str:
    """Return three figures of each controller for README; an IAE of 100 s, in m s, is a mean in cm."""
    rows = []
    for name, shown in _SUMMARISED.items():
        drawn, eight, circle = (
            figures[campaign]["controllers"][name] for campaign in ("drawn", *list(SLOW_MOTORS)[:2])
        )
        rows.append(
            {
                "controller": shown,
                "distance, cm": three(drawn["quantiles"]["seen_iae_m_s"]["0.5"]),
                "crashes: eight": str(eight["crashed"]["count"]),
                "crashes: circle": str(circle["crashed"]["count"]),
            }
        )
    return table(rows)


def opponents_curves(figures: Figures) -> str:
    """Return the crashes of light drones with slow motors on each curve."""
    rows = []
    for name in figures["slow-motors"]["controllers"]:
        row = {"crashed, of 300": title(name)}
        for campaign, curve in SLOW_MOTORS.items():
            row[curve] = str(figures[campaign]["controllers"][name]["crashed"]["count"])
        rows.append(row)
    return table(rows)
