"""Tables of what single settings of preset `mambo` are worth, and of what settings by `design` fly."""

from typing import Final

from benchmarks.evidence.item import Figures
from benchmarks.evidence.tables import Row, three
from benchmarks.flights.derived import CURVES, FLIGHTS
from benchmarks.flights.settings import CASES
from benchmarks.markdown import table
from mambo_codegen.settings.presets import preset
from mambo_sil.flight.controllers.pd import pid_gains

_SHIPPED: Final = f"response_time_s {preset('mambo').cost.response_time_s:g}"


def _pair(found: Figures, name: str) -> str:
    values = (found[f"{name}_{end}"] for end in ("median", "most"))
    return ", ".join(
        "crash" if value is None else f"{value:.2g}" if value < 1 else three(value) for value in values
    )


def settings_near(figures: Figures) -> str:
    """Return what drawn drones fly with one setting changed."""
    rows: list[Row] = []
    for title, found in figures["near"].items():
        name, _, size = title.partition(", ")
        key, _, value = name.partition(" ")
        shown = f"`{key}`, {size}" if size else f"`{key}` {value}"
        row = {"settings": f"**{shown}: preset `mambo`**" if title == _SHIPPED else shown}
        for campaign, drones in (("default", "of 300"), ("slow", "slow motors, of 300")):
            one = found[campaign]
            row[f"crashed, {drones}"] = str(one["crashed"])
            start = "estimated error" if campaign == "default" else "its estimated error"
            row[f"{start}, m s: median, 95 %"] = _pair(one, "seen_m_s")
            row[f"{'variation' if campaign == 'default' else 'its variation'}, rad"] = _pair(
                one, "variation_rad"
            )
        rows.append(row)
    return table(rows)


def settings_parts(figures: Figures) -> str:
    """Return what preset mambo flies without each of its parts."""
    rows = []
    for title, found in figures["parts"].items():
        row: Row = {"left out": title}
        row |= {name: three(found["cases"][name]) for name in CASES}
        row |= {
            "variation, rad": f"{found['variation_rad']:.2g}",
            "drawn: IAE, median": three(found["drawn"]["iae_m_s_median"]),
            "estimated: median, 95 %": _pair(found["drawn"], "seen_m_s"),
            "its variation: median, 95 %": _pair(found["drawn"], "variation_rad"),
            "slow motors: crashed, of 300": str(found["slow"]["crashed"]),
        }
        rows.append(row)
    return table(rows)


def settings_moves(figures: Figures) -> str:
    """Return circles and steps with one and with two moves."""
    titles = {"one": "one move (`ramp_s = 0.0`)", "two": "two moves (`ramp_s = 0.4`)"}
    rows = []
    for kind, name, unit in (
        ("circles", "{} rad/s: IAE, m s", ""),
        ("steps", "step of {} m: overshoot, cm", "cm"),
    ):
        for value in figures["moves"]["one"][kind]:
            row: Row = {"median (range)": name.format(value)}
            for move, title in titles.items():
                middle, least, most = (
                    (100.0 if unit else 1.0) * one for one in figures["moves"][move][kind][value]
                )
                row[title] = f"{three(middle)} ({three(least)}..{three(most)})"
            rows.append(row)
    return table(rows)


def settings_study(figures: Figures) -> str:
    """Return base and result of the default study."""
    rows = []
    for title, found in figures["study"].items():
        values = ", ".join(f"`{key.partition('.')[2]}` {value:g}" for key, value in found["values"].items())
        middle, least, most = found["known_iae_m_s"]
        rows.append(
            {
                "settings": f"{title}: {values or 'preset `mambo`'}",
                "100 other draws: median IAE": three(found["drawn"]["iae_m_s_median"]),
                "estimated error": three(found["drawn"]["seen_m_s_median"]),
                "variation, rad": f"{found['drawn']['variation_rad_median']:.2g}",
                "true state, 64 headings: IAE": f"{three(middle)} ({three(least)}..{three(most)})",
            }
        )
    return table(rows)


_TITLES: Final = {
    "pd": "PD",
    "pd-feedforward": "PD with feed-forward",
    "pid-feedforward": "PID with feed-forward",
    "mambo": "preset `mambo`",
    "crazyflie": "preset `crazyflie`",
    "derived": "derived",
}


def derived_campaigns(figures: Figures) -> str:
    """Return crashes, median error and median variation on each vehicle by controller."""
    rows = []
    for vehicle, found in figures["campaigns"].items():
        row: Row = {"vehicle": f"`{vehicle}`"}
        for name, title in _TITLES.items():
            one = found[name]
            if name == "pid-feedforward" and vehicle not in pid_gains():
                row[title] = ""
                continue
            row[title] = (
                f"{one['crashed']}, {three(one['iae_m_s'])}, {one['variation_rad']:.2g}"
                if one["crashed"] < FLIGHTS / 2
                else f"{one['crashed']} crashes"
            )
        rows.append(row)
    return table(rows)


def _errors(found: Figures) -> str:
    return ", ".join(three(found[curve]) for curve in CURVES)


def derived_vehicles(figures: Figures) -> str:
    """Return errors on curves, and the time of a step, of settings on each vehicle."""
    rows = []
    for vehicle, settings in figures["vehicles"].items():
        for name, found in settings.items():
            known, seen = (_errors(found[key]) for key in ("known", "seen"))
            rows.append(
                {
                    "vehicle": f"`{vehicle}`",
                    "settings": _TITLES[name],
                    "true state: eight, circle, step": f"{known}, {found['step_s']:.2f} s",
                    "its sensors: eight, circle": seen,
                    "variation on the eight, rad": f"{found['seen']['variation_rad']:.2g}",
                }
            )
    return table(rows)
