"""Draws and campaign.toml of campaigns, without flying."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.errors import InvalidSettingsError, MamboNmpcError, UnreadableFileError
from mambo_sil.drone.plant.airframe import MAMBO
from mambo_sil.drone.vehicles import VEHICLES
from mambo_sil.experiment.campaign import campaign_file
from mambo_sil.experiment.campaign.campaign_report import Drawn
from mambo_sil.experiment.campaign.distributions import Distribution, Domain, parse
from mambo_sil.experiment.campaign.parameters import PARAMETERS, draw
from mambo_sil.results.blocks import Facts

ROOT = Path(__file__).parents[3]
WIDE = Domain(-1e3, 1e3)


def written(folder: Path, text: str) -> Path:
    """Write a campaign.toml."""
    path = folder / "campaign.toml"
    path.write_text(text)
    return path


def faults(folder: Path, text: str) -> list[str]:
    """Return the messages on a campaign.toml, without its name."""
    path = written(folder, text)
    with pytest.raises(MamboNmpcError) as caught:
        campaign_file.read(path)
    parts = [line.partition("campaign.toml: ") for line in str(caught.value).splitlines()]
    assert all(found for _, found, _ in parts)
    return [fault for _, _, fault in parts]


@pytest.mark.parametrize(
    ("value", "share", "expected"),
    [
        (3.5, 0.9, 3.5),
        ({"uniform": [2.0, 4.0]}, 0.25, 2.5),
        ({"normal": [1.0, 0.0]}, 0.3, 1.0),
        ({"choice": [7, 8, 9]}, 0.0, 7.0),
        ({"choice": [7, 8, 9]}, 0.34, 8.0),
        ({"choice": [7, 8, 9]}, 0.999, 9.0),
    ],
)
def test_quantiles_of_the_distributions(value: object, share: float, expected: float) -> None:
    """The value below which the given share of draws lies; test_distributions has those of other kinds."""
    assert parse(value, WIDE).quantile(share) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.0, "2"),
        ({"uniform": [1.0, 2.5]}, "1 .. 2.5"),
        ({"normal": [1.0, 0.1]}, "1 +- 0.1"),
        ({"choice": [1.0, 2.0]}, "1 or 2"),
    ],
)
def test_a_distribution_is_written_as_it_is_read_and_said_in_words(value: object, text: str) -> None:
    """campaign.json has the notation of campaign.toml; words are for the report and a tuned controller."""
    assert parse(value, WIDE).document() == value
    assert parse(value, WIDE).text() == text


def test_a_draw_depends_on_seed_and_flight_only() -> None:
    """Draws depend neither on other flights nor on the distributions of other parameters."""
    assert draw(5, 17, PARAMETERS) == draw(5, 17, PARAMETERS)
    assert draw(5, 17, PARAMETERS) != draw(5, 18, PARAMETERS)
    assert draw(5, 17, PARAMETERS) != draw(6, 17, PARAMETERS)
    fixed = PARAMETERS | {"mass_kg": parse(0.07, PARAMETERS["mass_kg"].domain)}
    assert draw(5, 17, fixed) == draw(5, 17, PARAMETERS) | {"mass_kg": 0.07}


def test_curves_are_drawn(tmp_path: Path) -> None:
    """Name, size and rate, each from its number of the stream; heading and all else are drawn as before."""
    plain = campaign_file.default()
    curves = campaign_file.read(
        written(
            tmp_path,
            """
            [flight]
            trajectory = { choice = ["circle", "step"] }
            size_m = { uniform = [1, 2] }
            rate_rad_s = { log_uniform = [0.5, 1.0] }
            """,
        )
    )
    drawn = [curves.draw(flight) for flight in range(200)]
    for flight, one in enumerate(drawn):
        others = {"trajectory": "bernoulli", "size_m": 2.0, "rate_rad_s": 0.5}
        assert one | others == plain.draw(flight)
        flown = campaign_file.scenario(curves.flight, one)
        assert (flown.trajectory, flown.size_m, flown.rate_rad_s) == tuple(one[name] for name in others)
    assert 70 < sum(one["trajectory"] == "circle" for one in drawn) < 130
    assert 1.0 <= min(one["size_m"] for one in drawn) < 1.1
    assert 0.9 < max(one["rate_rad_s"] for one in drawn) <= 1.0
    assert max(one["yaw_rad"] for one in drawn) > 3.0 > -3.0 > min(one["yaw_rad"] for one in drawn)
    assert curves.document()["flight"]["trajectory"] == {"choice": ["circle", "step"]}
    assert plain.document()["flight"]["trajectory"] == "bernoulli"


def test_curves_of_files_are_the_same_in_every_folder(tmp_path: Path) -> None:
    """A campaign is known by their names and hashes; a page shows neither size nor rate of them."""
    chosen = 'trajectory = { choice = ["a/points.csv", "b/points.csv"] }'
    found = []
    for folder, *ends in (("one", 1, 2), ("other", 1, 2), ("changed", 3, 2)):
        for inner, x_m in zip(("a", "b"), ends, strict=True):
            (tmp_path / folder / inner).mkdir(parents=True)
            points = f"time_s,x_m,y_m\n0,0,0\n4,{x_m},0\n"
            (tmp_path / folder / inner / "points.csv").write_text(points, "utf-8")
        path = written(tmp_path / folder, f"[flight]\nduration_s = 5.0\n{chosen}\n")
        found.append(campaign_file.read(path).document())
    one, other, changed = found
    assert one == other
    assert one["flight"]["trajectory"] == {"choice": ["points.csv"] * 2}
    assert one["curves"]["points.csv"][0] != changed["curves"]["points.csv"][0]
    assert one["curves"]["points.csv"][1] == changed["curves"]["points.csv"][1]
    (facts, *_) = Drawn.model_validate(one).shown(tmp_path, None, [], []).blocks
    assert isinstance(facts, Facts)
    assert facts.values["trajectory"] == "points.csv or points.csv, 5 s"


def test_draws_are_those_of_earlier_versions() -> None:
    """New parameters use new numbers: the first flight of the default campaign keeps its draws."""
    drawn = draw(0, 0, PARAMETERS)
    shares = np.random.Generator(np.random.Philox(np.random.SeedSequence(0, spawn_key=(0,)).spawn(2)[0]))
    first, *_, last = shares.random(37)
    assert drawn["mass_kg"] == 0.063 + first * (0.08 - 0.063)
    assert list(PARAMETERS)[36] == "impulse_time_s"
    pushed = draw(0, 0, PARAMETERS | {"impulse_time_s": parse({"uniform": [0.0, 1.0]}, WIDE)})
    assert pushed["impulse_time_s"] == last


def test_names_are_drawn_and_said() -> None:
    """A distribution over names is written and said with them."""
    names = Domain.of_names(("a", "b", "c"))
    assert (names.low, names.high, names.whole) == (0, 2, True)
    found = parse({"choice": ["c", "a"]}, names)
    assert [names.value(found.quantile(share)) for share in (0.0, 0.49, 0.5, 0.99)] == ["c", "c", "a", "a"]
    assert found.document() == {"choice": ["c", "a"]}
    assert found.text() == "c or a"
    assert parse("b", names).document() == parse("b", names).text() == "b"


def test_whole_numbers_are_drawn_as_integers() -> None:
    """A table shows 2, not 2.0."""
    assert repr(Domain(0, 9, whole=True).value(2.0)) == "2"
    assert repr(Domain(0, 9).value(2.0)) == "2.0"


CONSTANT = {name: replace(default, kind="constant") for name, default in PARAMETERS.items()}


def test_seeds_of_flights_differ() -> None:
    """2000 flights have 2000 seeds, and so different noise."""
    assert len({draw(0, flight, CONSTANT)["seed"] for flight in range(2000)}) == 2000


def test_draws_of_the_default_campaign_fill_their_ranges() -> None:
    """Over 1000 flights mean, limits, shares of a choice and correlation are those of the distributions."""
    drawn = CONSTANT | {name: PARAMETERS[name] for name in ("mass_kg", "command_delay_ticks", "yaw_rad")}
    flights = [draw(0, flight, drawn) for flight in range(1000)]
    mass_kg = np.array([flight["mass_kg"] for flight in flights])
    assert 0.063 <= mass_kg.min() < 0.0632
    assert 0.0798 < mass_kg.max() <= 0.08
    assert mass_kg.mean() == pytest.approx(0.0715, abs=0.0005)
    ticks = [flight["command_delay_ticks"] for flight in flights]
    assert all(280 < ticks.count(delay) < 390 for delay in (0, 1, 2))
    yaw_rad = np.array([flight["yaw_rad"] for flight in flights])
    assert abs(np.corrcoef(mass_kg, yaw_rad)[0, 1]) < 0.1


def test_every_parameter_changes_the_scenario() -> None:
    """Each parameter at a limit of its domain gives a valid scenario that differs from the nominal one."""
    section = campaign_file.default().flight
    heavy = CONSTANT | {"mass_kg": Distribution("constant", (0.6,), PARAMETERS["mass_kg"].domain)}
    plain = campaign_file.scenario(section, draw(0, 0, heavy))
    for name, parameter in PARAMETERS.items():
        for limit in (parameter.domain.low, parameter.domain.high):
            extreme = heavy | {name: Distribution("constant", (limit,), parameter.domain)}
            changed = campaign_file.scenario(section, draw(0, 0, extreme))
            assert (changed != plain) == (limit != heavy[name].numbers[0]), name


def test_scales_apply_to_the_nominal_mambo() -> None:
    """The thrust scale applies to rotor thrust and torque, the inertia scale to one axis."""
    drawn = draw(0, 0, PARAMETERS) | {"thrust_scale": 0.5, "inertia_scale_y": 2.0}
    flown = campaign_file.scenario(campaign_file.default().flight, drawn)
    assert flown.thrust_factor_n_s2 == 0.5 * MAMBO.thrust_factor_n_s2
    assert flown.torque_factor_n_m_s2 == 0.5 * MAMBO.torque_factor_n_m_s2
    assert flown.inertia_kg_m2[1] == 2.0 * MAMBO.inertia_kg_m2[1]


def test_an_empty_file_is_the_default_campaign(tmp_path: Path) -> None:
    """The defaults are both PDs and preset mambo, 100 s on the figure of eight, derotated sensors."""
    read = campaign_file.read(written(tmp_path, ""))
    assert read == campaign_file.default()
    assert [(entrant.name, entrant.kind) for entrant in read.entrants] == [
        ("pd", "pd"),
        ("pd-feedforward", "pd-feedforward"),
        ("mambo", "nmpc"),
    ]
    assert read.file.flight.duration_s == 100.0
    assert read.file.flight.sensors == "mambo-derotated"


def test_a_controller_may_be_a_file_beside_the_campaign(tmp_path: Path) -> None:
    """The path is relative to campaign.toml, and the name is the stem of the file."""
    (tmp_path / "calm.toml").write_text("[cost]\neffort_weight = 1000\n")
    read = campaign_file.read(written(tmp_path, 'controllers = ["table1", "calm.toml"]'))
    assert [entrant.name for entrant in read.entrants] == ["table1", "calm"]
    assert read.entrants[1].settings.cost.effort_weight == 1000.0


def test_a_campaign_is_identified_by_its_values(tmp_path: Path) -> None:
    """Writing out a default keeps the identity of a campaign; another distribution changes it."""
    same = campaign_file.read(written(tmp_path, "seed = 0\n[draws]\nmass_kg = { uniform = [0.063, 0.08] }\n"))
    assert same.document() == campaign_file.default().document()
    other = campaign_file.read(written(tmp_path, "[draws]\nmass_kg = 0.063\n"))
    assert other.document()["draws"]["mass_kg"] == 0.063


BAD = {
    "seed = -1": "seed = -1 must lie in 0..9223372036854775807",
    'seed = "x"': 'seed = "x" must be a valid integer',
    "sed = 1": "sed is not a key of this file; did you mean seed?",
    "draws = 3": "draws = 3 must be a section; write [draws] and its keys below",
    "[draws]\nmas_kg = 1": "draws.mas_kg is not a parameter; did you mean mass_kg?",
    "[draws]\nwind = 3": "draws.wind is not a parameter; did you mean wind_speed_m_s, wind_direction_rad",
    "[draws]\nmass_kg = 60": "draws.mass_kg = 60 must lie in 0.01..1",
    "[draws]\nmass_kg = nan": "draws.mass_kg = NaN must lie in 0.01..1",
    "[draws]\nmass_kg = { uniform = [0.08, 0.06] }": "[0.08, 0.06] } must have the lower limit first",
    "[draws]\nmass_kg = { uniform = [0.08] }": "must have two numbers",
    "[draws]\nmass_kg = { uniform = [0.05, 9] }": "must lie in 0.01..1",
    "[draws]\nmass_kg = { gamma = [1, 2] }": "must be a number, { uniform = [low, high] }",
    "[draws]\nmass_kg = [0.06, 0.08]": "must be a number, { uniform = [low, high] }",
    "[draws]\nmass_kg = true": "must be a number, { uniform = [low, high] }",
    "[draws]\nmass_kg = { choice = [] }": "must have 1 to 1000 values",
    "[draws]\nmass_kg = { uniform = [] }": "must have two numbers",
    '[draws]\nmass_kg = { uniform = [0.06, "x"] }': "must be a number, { uniform = [low, high] }",
    "[draws]\nmass_kg = { choice = [true] }": "must be a number, { uniform = [low, high] }",
    "[draws]\nmass_kg = { choice = 0.07 }": "must be a number, { uniform = [low, high] }",
    "[draws]\npush_x_m_s2 = { normal = [0, -1] }": "must have a standard deviation of 0 or more",
    "[draws]\nnoise_scale = { log_uniform = [0, 1] }": "must have limits above 0",
    "[draws]\ncommand_delay_ticks = 1.5": "must be whole numbers",
    "[draws]\ncommand_delay_ticks = { uniform = [0, 2] }": "must be a whole number or { choice",
    "[flight]\nduration_s = 0": "flight.duration_s = 0 must lie in 1..3600",
    '[flight]\ntrajectory = "spiral"': 'flight.trajectory = "spiral" must be one of bernoulli, gerono',
    '[flight]\ntrajectory = { choice = ["circle", "spiral"] }': "must be one of bernoulli, gerono, lissajous",
    "[flight]\ntrajectory = { choice = [] }": "take-off-and-landing, FILE.csv, FILE.py:CLASS, or { choice",
    "[flight]\ntrajectory = { uniform = [0, 1] }": "or { choice = [name, ...] } of them",
    '[flight]\ntrajectory = { choice = ["circle"], uniform = [0, 1] }': "or { choice = [name, ...] } of them",
    "[flight]\ntrajectory = 3": "flight.trajectory = 3 must be one of bernoulli",
    "[flight]\nsize_m = { uniform = [1, 5000] }": "must lie in -1000..1000",
    "[draws]\nsize_m = 1": "draws.size_m is not a parameter",
    "controllers = []": "controllers = [] must name 1 to 10 controllers",
    'controllers = ["mamba"]': "controllers: mamba is neither a preset nor a file (did you mean mambo?)",
    'controllers = ["pd", "pd"]': "controllers: two are called pd",
    'controllers = ["calm.toml", "Calm.toml"]': "controllers: results of calm and Calm would have the same",
    'controllers = ["calm_seen.toml", "calm.toml"]': "results of calm_seen and calm would have the same",
    'controllers = ["pd-feedforward.toml"]': "other than pd, pd-feedforward, pid-feedforward: results are",
    'controllers = ["odd.toml"]': "controllers: odd.toml: horizon.update_period_s = 0.007 must be a whole",
    'controllers = ["wrong.toml"]': "wrong.toml: horizon.control = 11 must lie in 1..10 (horizon.prediction)",
    'controllers = ["a b.toml"]': "controllers: a b.toml must have a name of at most 40 letters",
}


@pytest.mark.parametrize(
    ("domain", "value"), [(WIDE, 1.0), (Domain.of_names(("a", "b")), "b")], ids=["numbers", "names"]
)
def test_a_choice_has_one_to_a_thousand_values(domain: Domain, value: float | str) -> None:
    """Of numbers and of names; the same value may stand more than once, and is drawn more often."""
    for count in (1, 1000):
        assert len(parse({"choice": [value] * count}, domain).numbers) == count
    for count in (0, 1001):
        with pytest.raises(ValueError, match="must"):
            parse({"choice": [value] * count}, domain)


def test_limits_belong_to_their_domain() -> None:
    """A range may be a single value; a mean may lie at a limit, and its deviation may go beyond."""
    assert parse({"uniform": [-1e3, 1e3]}, WIDE).quantile(0.0) == -1e3
    assert parse({"uniform": [2.0, 2.0]}, WIDE).quantile(0.9) == 2.0
    assert parse({"normal": [1e3, 2e3]}, WIDE).quantile(0.9) < 1e3
    assert parse({"log_uniform": [1e-300, 1e-300]}, WIDE).quantile(0.9) == 1e-300


def test_a_payload_may_be_dropped_but_not_the_drone(tmp_path: Path) -> None:
    """A negative payload leaves a positive mass, with the tails of a normal distribution, too."""
    for payload, fault in (
        ("-0.02", ""),
        ("{ normal = [0.0, 0.002] }", ""),
        ("-0.064", "payload_kg, down to -0.064"),
    ):
        (tmp_path / "drop.toml").write_text(f"[draws]\npayload_kg = {payload}\n")
        if not fault:
            assert campaign_file.read(tmp_path / "drop.toml").draw(0)["payload_kg"] != 0.0
            continue
        with pytest.raises(InvalidSettingsError, match=fault):
            campaign_file.read(tmp_path / "drop.toml")


@pytest.mark.parametrize("text", BAD)
def test_an_error_names_key_value_and_rule(text: str, tmp_path: Path) -> None:
    """One error in campaign.toml gives one line."""
    (tmp_path / "odd.toml").write_text("[horizon]\nupdate_period_s = 0.007\n")
    (tmp_path / "wrong.toml").write_text("[horizon]\ncontrol = 11\n")
    for name in ("a b", "calm", "Calm", "calm_seen"):
        (tmp_path / f"{name}.toml").write_text("[horizon]\ncontrol = 1\n")
    (tmp_path / "pd-feedforward.toml").write_text("[horizon]\ncontrol = 1\n")
    (fault,) = faults(tmp_path, text)
    assert BAD[text] in fault


def test_all_errors_are_reported_together(tmp_path: Path) -> None:
    """Three errors in campaign.toml give three lines."""
    assert len(faults(tmp_path, "seed = -1\n[draws]\nmass_kg = 0\nyaw = 1\n")) == 3


def test_a_missing_campaign_is_named(tmp_path: Path) -> None:
    """A campaign.toml that does not exist raises `UnreadableFileError`."""
    with pytest.raises(UnreadableFileError, match="no such file"):
        campaign_file.read(tmp_path / "absent.toml")


def test_every_parameter_is_documented() -> None:
    """docs/reference/campaign-toml.md names every parameter."""
    text = (ROOT / "docs" / "reference" / "campaign-toml.md").read_text("utf-8")
    missing = [name for name in PARAMETERS if f"`{name}`" not in text]
    assert missing == []


def documented(text: str) -> tuple[str, list[float]]:
    """Return kind and numbers of a distribution as docs/reference/campaign-toml.md writes it."""
    numbers = [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", text.partition(" tick")[0])]
    match text.partition(" ")[0].rstrip(","):
        case "uniform":
            return "uniform", numbers or [-math.pi, math.pi]
        case "log-uniform":
            return "log_uniform", numbers
        case "normal":
            return "normal", [0.0, *numbers]
        case _:
            return ("choice" if len(numbers) > 1 else "constant"), numbers


def test_the_documented_defaults_are_those_of_the_default_campaign() -> None:
    """Each row of [draws] in docs/reference/campaign-toml.md has kind and numbers of its parameters."""
    text = (ROOT / "docs" / "reference" / "campaign-toml.md").read_text("utf-8")
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \| ([^|]+) \| [^|]*\|$", text, re.MULTILINE)
    table = {name: documented(words) for names, words in rows for name in re.findall(r"\w+", names)}
    known = {name: found for name, found in table.items() if name in PARAMETERS}
    assert list(known) == [
        name for name in PARAMETERS if name not in campaign_file.FlightSection.model_fields
    ]
    for name, (kind, numbers) in known.items():
        assert (PARAMETERS[name].kind, list(PARAMETERS[name].numbers)) == (kind, numbers), name


def numbers(campaign: campaign_file.Campaign, name: str) -> tuple[float, ...]:
    """Return the numbers of the distribution of a parameter."""
    return campaign_file.distributions(campaign.file.flight, campaign.file.draws)[name].numbers


def test_draws_of_mass_drag_and_motor_lag_are_relative_to_the_drone() -> None:
    """The same shares of its values as of the Mambo's; all others are the same."""
    mambo, other = campaign_file.default(), campaign_file.default("crazyflie")
    assert numbers(mambo, "mass_kg") == (0.063, 0.08)
    np.testing.assert_allclose(numbers(other, "mass_kg"), [0.03, 0.03 * 0.08 / 0.063], rtol=1e-12)
    np.testing.assert_allclose(numbers(other, "drag_1_s"), [0.5 * 0.244, 1.5 * 0.244], rtol=1e-12)
    assert numbers(mambo, "motor_lag_s") == (0.0, 0.05)
    np.testing.assert_allclose(numbers(other, "motor_lag_s"), [0.8 * 0.072, 1.2 * 0.072], rtol=1e-12)
    changed = {name for name in PARAMETERS if numbers(mambo, name) != numbers(other, name)}
    assert changed == {"mass_kg", "drag_1_s", "motor_lag_s"}


def test_a_file_names_its_drone(tmp_path: Path) -> None:
    """A shipped one, or a file beside it; its draws are absolute, and its sensors must be the drone's."""
    path = written(tmp_path, '[flight]\nvehicle = "crazyflie"\n[draws]\nmass_kg = 0.05\n')
    named = campaign_file.read(path)
    assert (named.drone.name, named.file.flight.sensors) == ("crazyflie", "mocap")
    assert numbers(named, "mass_kg") == (0.05,)
    (tmp_path / "my.toml").write_text(VEHICLES.text("generic"))
    assert campaign_file.read(written(tmp_path, '[flight]\nvehicle = "my.toml"\n')).drone.name == "my"
    assert faults(tmp_path, '[flight]\nvehicle = "my"\n') == [
        "flight.vehicle: my is neither a shipped vehicle nor a file; vehicles are "
        f"{', '.join(VEHICLES.names())}, and `mambo-nmpc vehicles NAME` prints one to start from "
        "(did you mean my.toml?)"
    ]
    assert faults(tmp_path, '[flight]\nvehicle = "crazyflie"\nsensors = "mambo"\n') == [
        'flight.sensors = "mambo" needs its figures, [sensors], in the file of vehicle crazyflie'
    ]
    both = written(tmp_path, '[flight]\nvehicle = "mambo"\nsensors = "mambo"\n')
    assert campaign_file.read(both, "crazyflie").file.flight.sensors == "mocap"
    assert campaign_file.read(both, "mambo").file.flight.sensors == "mambo"
