"""The list of what is evidence: tables and pictures of the manual, and the commands that make them.

Not in the list are figures that take longer, and those that need another machine or package. `peers` needs
the solvers of `make bench-peers`: any value of the environment variable PEERS says that they are installed.
"""

from collections.abc import Callable, Mapping
from pathlib import PurePath
from typing import Final

from benchmarks.evidence.board_tables import (
    compilers,
    faults,
    faults_compared,
    footprint,
    footprint_scalars,
    read_faults,
    read_footprints,
)
from benchmarks.evidence.campaign_tables import (
    SLOW_MOTORS,
    campaign,
    campaign_motor_lag,
    campaign_ratios,
    opponents,
    opponents_curves,
    opponents_ratios,
    opponents_summary,
    read_campaign,
    read_opponents,
    read_quantiles,
)
from benchmarks.evidence.charts import boards_chart, opponents_chart, peers_chart
from benchmarks.evidence.item import RESULTS, Figures, Item
from benchmarks.evidence.link_tables import link_curves, link_jumps, link_pause, link_wires
from benchmarks.evidence.margin_tables import PRESETS, margin_commands, presets_on_drones, read_margins
from benchmarks.evidence.moving_picture import draw_moving_picture, read_space, space_commands, space_table
from benchmarks.evidence.pictures import draw_envelope
from benchmarks.evidence.settings_tables import (
    derived_campaigns,
    derived_vehicles,
    settings_moves,
    settings_near,
    settings_parts,
    settings_study,
)
from benchmarks.evidence.simulator_items import OF_SIMULATORS
from benchmarks.evidence.sources import FLIGHT, HERE, STYLE
from benchmarks.evidence.tables import (
    CONTROLLERS,
    conditions,
    envelope,
    printed,
    read_envelope,
    read_figures,
    read_printed,
    read_sensors,
    read_suite,
    read_table2,
    sensors,
    spread,
    table2,
    table2_quarter,
    title,
    vehicles,
)
from benchmarks.flights.derived import VEHICLES
from benchmarks.margins.front import front_table
from benchmarks.margins.front import read as read_front

_ONE_NORM: Final = f"{HERE}/one-norm.toml"
_EXPERIMENT: Final = "sil/mambo_sil/experiment"
_MEASURED: Final = ("mambo", "mambo --scalar float64", "mambo --scalar fixed", "mambo-1norm")
_MEASURES: Final = (
    *FLIGHT,
    "sil/mambo_sil/board/footprint",
    "codegen/mambo_codegen/data/boards",
    "codegen/mambo_codegen/bundle/flags.py",
)
_ON_EACH: Final = ("pd", "pd-feedforward", "mambo-1norm", "mambo", "crazyflie")
_FLOWN: Final = ("mambo", "mambo-1norm", "table1")
_FIXED: Final = f"{HERE}/mambo-1norm-fixed.toml"


def _regress(item: str, suite: str, *sources: str) -> tuple[str, ...]:
    """Return the commands that fly a suite with presets or files, each into the folder of that name."""
    return tuple(
        f"mambo-nmpc regress {suite} --controller {source} -o {RESULTS}/{item}/{PurePath(source).stem}"
        for source in sources
    )


def _campaign(name: str, options: str, tables: Mapping[str, Callable[[Figures], str]]) -> Item:
    """Return the item of a campaign, NAME.toml beside this file; the first has a picture and more tables."""
    drawn = name == "campaign"
    return Item(
        name=name,
        commands=(f"mambo-nmpc campaign {HERE}/{name}.toml {options}-o {RESULTS}/{name}/campaign",),
        controllers=_FLOWN,
        paths=(*FLIGHT, f"{_EXPERIMENT}/campaign", f"{HERE}/{name}.toml", *((STYLE,) if drawn else ())),
        read=read_campaign if drawn else read_quantiles,
        tables=tables,
        pictures={f"{name}.png": "campaign/campaign.png"} if drawn else {},
    )


ITEMS: Final = (
    Item(
        name="table2",
        commands=(f"mambo-nmpc table2 -o {RESULTS}/table2/table2",),
        controllers=(*_FLOWN, "table1-printed"),
        paths=(*FLIGHT, f"{_EXPERIMENT}/table2", STYLE),
        read=read_table2,
        tables={"table2": table2, "table2-quarter": table2_quarter},
        pictures={"figure3.png": "table2/figure3.png"},
    ),
    Item(
        name="space",
        commands=space_commands(f"{RESULTS}/space"),
        controllers=("crazyflie", "design crazyflie"),
        paths=(*FLIGHT, STYLE, f"{HERE}/moving_picture.py"),
        read=read_space,
        tables={"space": space_table},
        pictures={"space.gif": "space.gif"},
        draw=draw_moving_picture,
    ),
    Item(
        name="sensors",
        commands=(f"mambo-nmpc table2 --sensors -o {RESULTS}/sensors/sensors",),
        controllers=("mambo", "table1"),
        paths=(*FLIGHT, f"{_EXPERIMENT}/table2"),
        read=read_sensors,
        tables={"sensors": sensors},
    ),
    Item(
        name="conditions",
        commands=_regress("conditions", f"{HERE}/conditions.toml", *CONTROLLERS, _ONE_NORM, _FIXED),
        controllers=(*_FLOWN, _ONE_NORM, _FIXED),
        paths=(*FLIGHT, f"{_EXPERIMENT}/regress", f"{HERE}/conditions.toml"),
        read=read_suite((*CONTROLLERS, "one-norm", "mambo-1norm-fixed")),
        tables={
            "conditions": conditions({name: title(name) for name in CONTROLLERS}),
            "tracker": conditions(
                {
                    "one-norm": "without the tracker",
                    "mambo-1norm": "`mambo-1norm`",
                    "mambo-1norm-fixed": "`mambo-1norm`, fixed",
                }
            ),
        },
    ),
    Item(
        name="vehicles",
        commands=_regress("vehicles", f"{HERE}/vehicles.toml", *_ON_EACH),
        controllers=_ON_EACH[2:],
        paths=(*FLIGHT, f"{_EXPERIMENT}/regress", f"{HERE}/vehicles.toml"),
        read=read_suite(_ON_EACH),
        tables={"vehicles": vehicles},
    ),
    Item(
        name="margins",
        commands=margin_commands(),
        controllers=PRESETS,
        paths=(*FLIGHT, f"{_EXPERIMENT}/margins", f"{HERE}/margin_tables.py"),
        read=read_margins,
        tables={"margins": presets_on_drones},
    ),
    Item(
        name="spread",
        commands=("python -m benchmarks.flights.spread",),
        controllers=_FLOWN,
        paths=(*FLIGHT, "benchmarks/flights/spread.py"),
        read=read_printed,
        tables={"spread": spread},
    ),
    Item(
        name="envelope",
        commands=_regress("envelope", "envelope", *CONTROLLERS),
        controllers=_FLOWN,
        paths=(*FLIGHT, f"{_EXPERIMENT}/regress", f"{HERE}/pictures.py", STYLE),
        read=read_envelope,
        tables={"envelope": envelope},
        pictures={"envelope.png": "envelope.png"},
        draw=draw_envelope,
    ),
    _campaign(
        "campaign",
        "",
        {"campaign": campaign, "campaign-ratios": campaign_ratios, "campaign-motor-lag": campaign_motor_lag},
    ),
    Item(
        name="opponents",
        commands=(
            f"mambo-nmpc campaign {HERE}/opponents.toml -o {RESULTS}/opponents/drawn",
            *(
                f"mambo-nmpc campaign {HERE}/opponents-{name}.toml --flights 300 "
                f"-o {RESULTS}/opponents/{name}"
                for name in SLOW_MOTORS
            ),
        ),
        controllers=_FLOWN,
        paths=(
            *(*FLIGHT, f"{_EXPERIMENT}/campaign", f"{HERE}/opponents.toml"),
            *(f"{HERE}/opponents-{name}.toml" for name in SLOW_MOTORS),
        ),
        read=read_opponents,
        tables={
            "opponents-summary": opponents_summary,
            "opponents": opponents("drawn"),
            "opponents-ratios": opponents_ratios,
            "opponents-slow-motors": opponents("slow-motors"),
            "opponents-curves": opponents_curves,
        },
        charts={"opponents": opponents_chart},
    ),
    _campaign("campaign-older-flow", "--flights 100 ", {"campaign-older-flow": campaign}),
    _campaign("campaign-quick-motors", "--flights 100 ", {"campaign-quick-motors": campaign}),
    Item(
        name="limits",
        commands=(f"python -m benchmarks.flights.limits {RESULTS}/limits/pictures",),
        controllers=("mambo", "crazyflie", "mambo-1norm", "table1"),
        paths=(*FLIGHT, "benchmarks/flights/limits.py", STYLE),
        read=read_printed,
        tables={"limits": printed},
        pictures={f"limits-{name}.png": f"pictures/limits-{name}.png" for name in ("step", "fence")},
    ),
    Item(
        name="settings",
        commands=(
            f"mambo-nmpc tune --trials 100 -o {RESULTS}/settings/tuned",
            f"python -m benchmarks.flights.settings {RESULTS}/settings/tuned {RESULTS}/settings/flown",
        ),
        controllers=("mambo",),
        paths=(
            *(
                *FLIGHT,
                f"{_EXPERIMENT}/campaign",
                "sil/mambo_extensions/tune",
                "benchmarks/flights/settings.py",
                "benchmarks/margins/flights.py",
            ),
            f"{HERE}/opponents-slow-motors.toml",
        ),
        read=read_figures("flown"),
        tables={
            "settings-near": settings_near,
            "settings-parts": settings_parts,
            "settings-moves": settings_moves,
            "settings-study": settings_study,
        },
    ),
    Item(
        name="margin-front",
        commands=(f"python -m benchmarks.margins.front {RESULTS}/margin-front/front",),
        controllers=("mambo",),
        paths=(
            *(*FLIGHT, f"{_EXPERIMENT}/campaign", f"{_EXPERIMENT}/margins", "benchmarks/margins"),
            *(f"{HERE}/opponents-slow-motors.toml", STYLE),
        ),
        read=lambda results: {"rows": read_front(results / "front")},
        tables={"margin-front": front_table},
        pictures={"margin-front.png": "front/margin-front.png"},
    ),
    Item(
        name="derived",
        commands=(f"python -m benchmarks.flights.derived {RESULTS}/derived/flown",),
        controllers=(*(f"design {vehicle}" for vehicle in VEHICLES), "mambo", "crazyflie"),
        paths=(*FLIGHT, f"{_EXPERIMENT}/campaign", "benchmarks/flights/derived.py"),
        read=read_figures("flown"),
        tables={"derived-campaigns": derived_campaigns, "derived-vehicles": derived_vehicles},
    ),
    Item(
        name="height",
        commands=(f"python -m benchmarks.flights.height {RESULTS}/height/pictures",),
        controllers=("design crazyflie",),
        paths=(*FLIGHT, "benchmarks/flights/height.py", STYLE),
        read=read_printed,
        tables={"height": printed},
        pictures={"height-helix.png": "pictures/height-helix.png"},
    ),
    Item(
        name="fast",
        commands=(f"python -m benchmarks.flights.fast {RESULTS}/fast/pictures",),
        controllers=("design crazyflie",),
        paths=(*FLIGHT, "benchmarks/flights/fast.py", STYLE),
        read=read_printed,
        tables={"fast": printed},
        pictures={"fast-eight.png": "pictures/fast-eight.png"},
    ),
    Item(
        name="bound",
        commands=("python -m benchmarks.flights.bound",),
        controllers=("design crazyflie",),
        paths=(*FLIGHT, "benchmarks/flights/bound.py", "benchmarks/flights/fast.py"),
        read=read_printed,
        tables={"bound": printed},
        variable="BOUND",
    ),
    Item(
        name="laps",
        commands=(
            "python -m benchmarks.flights.laps",
            f"mambo-nmpc plan {HERE}/points.csv --vehicle crazyflie -o {RESULTS}/laps/lap.csv",
        ),
        controllers=("design crazyflie-brushless", "design crazyflie"),
        paths=(
            *(*FLIGHT, "sil/mambo_extensions/plan", STYLE),
            *("benchmarks/flights/laps.py", f"{HERE}/points.csv"),
        ),
        read=read_printed,
        tables={"laps": printed},
        pictures={"lap.png": "lap.png"},
    ),
    Item(
        name="footprint",
        commands=(
            f"mambo-nmpc footprint mambo -o {RESULTS}/footprint/float32",
            f"mambo-nmpc footprint mambo --scalar float64 -o {RESULTS}/footprint/float64",
            f"mambo-nmpc footprint mambo --scalar fixed -o {RESULTS}/footprint/fixed",
            f"mambo-nmpc footprint mambo-1norm -o {RESULTS}/footprint/1norm",
            f"mambo-nmpc footprint mambo --optimisation=-Os -o {RESULTS}/footprint/size",
        ),
        controllers=_MEASURED,
        paths=_MEASURES,
        read=read_footprints(
            dict(zip(_MEASURED, ("float32", "float64", "fixed", "1norm"), strict=True))
            | {"mambo -Os": "size"}
        ),
        tables={
            "footprint": footprint("mambo"),
            "footprint-size": footprint("mambo -Os"),
            "footprint-float64": footprint("mambo --scalar float64"),
            "footprint-fixed": footprint("mambo --scalar fixed"),
            "footprint-1norm": footprint("mambo-1norm"),
            "footprint-scalars": footprint_scalars,
            "compilers": compilers,
        },
        charts={"boards": boards_chart},
    ),
    Item(
        name="footprint-crazyflie",
        commands=(
            f"mambo-nmpc design crazyflie -o {RESULTS}/footprint-crazyflie/controller.toml",
            f"mambo-nmpc footprint {RESULTS}/footprint-crazyflie/controller.toml "
            f"-o {RESULTS}/footprint-crazyflie/derived",
        ),
        controllers=("design crazyflie",),
        paths=_MEASURES,
        read=read_footprints({"design crazyflie": "derived"}),
        tables={"footprint-crazyflie": footprint("design crazyflie")},
    ),
    Item(
        name="peers",
        commands=("python -m benchmarks.peers.control_step",),
        controllers=("mambo",),
        paths=("benchmarks/peers", "sil/mambo_sil/board/emulation", "codegen/mambo_codegen/bundle/flags.py"),
        read=read_printed,
        tables={"peers": printed},
        charts={"peers-step": peers_chart},
        variable="PEERS",
    ),
    Item(
        name="app-sizes",
        commands=("python -m benchmarks.app_sizes",),
        controllers=("design crazyflie", "crazyflie"),
        paths=(
            *("benchmarks/app_sizes.py", "codegen/mambo_codegen/bundle/episodes.py"),
            "sil/mambo_extensions/crazyflie/desk/stand_ins",
            "templates/mambo_templates/firmware/crazyflie/src",
            *(f"templates/mambo_templates/common/nmpc_self_test.{end}.j2" for end in "ch"),
        ),
        read=read_printed,
        tables={"app-sizes": printed},
    ),
    Item(
        name="faults",
        commands=(
            f"mambo-nmpc faults mambo -o {RESULTS}/faults/mambo",
            f"mambo-nmpc faults mambo-1norm -o {RESULTS}/faults/mambo-1norm",
            f"mambo-nmpc faults {_ONE_NORM} -o {RESULTS}/faults/one-norm",
        ),
        controllers=("mambo", "mambo-1norm", _ONE_NORM),
        paths=(*FLIGHT, f"{_EXPERIMENT}/faults", STYLE),
        read=read_faults({"mambo": "mambo", "mambo-1norm": "mambo-1norm", _ONE_NORM: "one-norm"}),
        tables={
            "faults": faults("mambo"),
            "faults-compared": faults_compared,
        },
        pictures={"faults.png": "mambo/faults.png"},
    ),
    Item(
        name="link",
        commands=(f"python -m benchmarks.flights.link {RESULTS}/link/link",),
        controllers=(f"design {HERE}/link-drone.toml",),
        paths=(
            *("sil/mambo_sil/api", "sil/mambo_sil/drone", "sil/mambo_sil/life", "sil/mambo_sil/model/derive"),
            *("sil/mambo_extensions/mavlink", f"{HERE}/link-drone.toml"),
            *("benchmarks/flights/link.py", "benchmarks/flights/wire.py"),
        ),
        read=read_figures("link"),
        tables={
            "link-curves": link_curves,
            "link-wires": link_wires,
            "link-pause": link_pause,
            "link-jumps": link_jumps,
        },
    ),
    Item(
        name="speed",
        commands=("python -m benchmarks.speed.beside_simulators",),
        controllers=("design crazyflie --sensors true",),
        paths=(
            *("sil/mambo_nmpc/adapters/gymnasium.py", "sil/mambo_sil/api/simulated.py"),
            *(f"{_EXPERIMENT}/campaign/campaign_flights.py", "benchmarks/speed/beside_simulators.py"),
        ),
        read=read_printed,
        tables={"speed": printed},
        variable="SIMULATORS",
    ),
    *OF_SIMULATORS,
)
