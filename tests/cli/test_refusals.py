"""Refused commands: an explained exit 2, and no folder or file left behind."""

import shlex
from pathlib import Path

import pytest

from mambo_sil.cli.command import RENAMED
from tests.support.command import of_installed, run, unwrapped

COMMANDS = of_installed(
    ["generate", "fly", "table2", "footprint", "sweep", "faults", "verify", "campaign", "tune"]
)


@pytest.mark.parametrize("command", [*COMMANDS, "init", "identify"])
def test_an_empty_output_is_refused(command: str, tmp_path: Path) -> None:
    """It would be the current folder."""
    said, talk = run(command, "-o", "", code=2)
    assert (said, "must not be empty" in talk) == ("", True)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("old", "new"), RENAMED.items())
def test_a_command_of_before_names_the_new_one(old: str, new: str) -> None:
    """In one sentence, whatever follows it; and there is a command of that name."""
    for more in ([], ["mambo", "-o", "out"], ["--help"]):
        assert run(old, *more, code=2) == ("", f"mambo-nmpc {old} is now mambo-nmpc {new}\n")
    assert f"mambo-nmpc {new}" in run(new, "--help")[0]


@pytest.mark.parametrize(
    "line",
    of_installed(
        [
            "generate '' --for crazyflie -o a/b",
            "generate -o a/b --for ''",
            "init ''",
            "design ''",
            "fly '' -o a/b",
            "fly --vehicle= -o a/b",
            "fly --on '' -o a/b",
            "fly --trajectory '' -o a/b",
            "fly --repeat '' -o a/b",
            "footprint --board '' -o a/b",
            "check-bits --board mambo --board ''",
            "campaign '' -o a/b",
            "regress '' -o a/b",
            "identify log.csv '' -o a/b",
            "identify --manoeuvre ''",
            "which-controller ''",
            "replay '' -o a/b",
            "diff mambo ''",
            "report ''",
            "playground mambo '' -o a.html",
            "vehicles ''",
        ]
    ),
)
def test_an_empty_name_is_refused(line: str, tmp_path: Path) -> None:
    """It is the unset variable of a script; neither the default nor the current folder takes its place."""
    said, talk = run(*shlex.split(line), code=2)
    assert (said, "must not be empty" in talk) == ("", True), talk
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("line", "option"),
    [
        ("generate -o a/b --output c/d", "--output"),
        ("generate --prefix a --prefix b -o a/b", "--prefix"),
        ("fly --seed 1 --wind gusts --seed=2 -o a/b", "--seed"),
        ("fly --on mega --on crazyflie -o a/b", "--on"),
        ("sweep --vary limits.tilt_rad=0.2:0.3:2 --board mega --board crazyflie -o a/b", "--board"),
        ("check-bits --steps 100 --steps 200", "--steps"),
        ("doctor --json --json", "--json"),
    ],
)
def test_an_option_of_which_only_the_last_would_count_is_refused(
    line: str, option: str, tmp_path: Path
) -> None:
    """Whatever its spelling; nobody learns otherwise that the first was ignored."""
    said, talk = run(*shlex.split(line), code=2)
    assert said == ""
    assert option in talk
    assert "is there more than once" in unwrapped(talk)
    assert not list(tmp_path.iterdir())


def test_an_option_that_may_be_there_again_has_all_its_values() -> None:
    """Two keys of a sweep: the message is about the second."""
    line = "sweep --vary limits.tilt_rad=0.2:0.3:2 --vary horizon.none=1:2:2"
    assert "horizon.none is not a number" in unwrapped(run(*shlex.split(line), code=2)[1])


@pytest.mark.parametrize(
    "line",
    of_installed(
        [
            "fly contoller.toml",
            "generate contoller.toml -o out",
            "diff mambo contoller.toml",
            "margins contoler.toml",
            "fly mambo --vehicle contoller.toml",
            "design contoller.toml",
            "footprint --board contoller.toml",
            "fly mambo --trajectory contoller.csv",
            "fly --repeat contoller.json",
            "campaign contoller.toml",
            "regress contoller.toml",
            "regress --controller contoller.toml",
            "tune contoller.toml",
            "identify contoller.csv",
            "replay contoller.csv mambo",
            "which-controller contoller.elf",
            "report contoller",
        ]
    ),
)
def test_a_misspelt_file_gets_the_name_of_the_one_beside_it(line: str, tmp_path: Path) -> None:
    """As a misspelt key does, in every command that takes a file."""
    (tmp_path / "controller.toml").touch()
    said, talk = run(*line.split(), code=2)
    assert (said, "(did you mean controller.toml?)" in talk) == ("", True), talk


def test_a_misspelt_file_of_a_campaign_is_looked_for_beside_it(tmp_path: Path) -> None:
    """Its names are relative to its own folder; a file like no other gets no guess."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "controller.toml").touch()
    for name, guess in (("contoller.toml", " (did you mean controller.toml?)"), ("other.toml", "")):
        (tmp_path / "mine" / "campaign.toml").write_text(f'controllers = ["{name}"]\n')
        talk = run("campaign", "mine/campaign.toml", code=2)[1]
        assert talk.endswith(f"to start from{guess}\n"), talk


def test_an_empty_program_is_no_controller_of_a_campaign(tmp_path: Path) -> None:
    """It is named with its place, and nothing flies."""
    (tmp_path / "mypid.py").touch()
    (tmp_path / "campaign.toml").write_text('controllers = ["mambo", "mypid.py"]\n')
    talk = run("campaign", "campaign.toml", code=2)[1]
    assert talk.startswith("campaign.toml: controllers: mypid.py must be mypid.py:CLASS, a law of your own")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("fly table1 --controller pd", "table1: --controller pd has no settings; leave it out"),
        (
            "fly --controller pd-feedforward --scalar fixed",
            "--scalar fixed: --controller pd-feed",
        ),
        ("fly --baud 9600", "it needs --port"),
        ("footprint --baud 9600", "it needs --port"),
        ("check-bits --baud 9600", "it needs --port"),
        ("fly --trajectory hover --size-m 3", "--size-m = 3: --trajectory hover has none; leave it out"),
        ("fly --trajectory a.csv --size-m 3", "--size-m = 3: --trajectory a.csv has none; leave it out"),
        (
            "fly --trajectory step --rate-rad-s 3",
            "--rate-rad-s = 3: --trajectory step has none; leave",
        ),
        ("fly --trajectory hover --rate-rad-s 3", "has none; leave it out, or fly bernoulli, gerono, liss"),
        (
            "fly --vehicle crazyflie-flown --motor-lag-s 0.1",
            "--motor-lag-s = 0.1: vehicle crazyflie-flown is simulated without motors",
        ),
    ],
)
def test_an_option_without_effect_is_refused(line: str, message: str, tmp_path: Path) -> None:
    """The message names it and says what to do."""
    said, talk = run(*line.split(), code=2)
    assert (said, message in talk) == ("", True), talk
    assert not list(tmp_path.iterdir())


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    "line",
    of_installed(
        [
            *(f"{command} no.toml -o a/b" for command in COMMANDS if command != "table2"),
            *(
                f"{command} --scalar flat -o a/b"
                for command in COMMANDS
                if command not in ("campaign", "tune")
            ),
            "footprint --optimisation=fast --board crazyflie -o a/b",
            "table2 --sensors --scalar flat -o a/b",
            "campaign --flights 0 -o a/b",
            "campaign --scheduler tcp://127.0.0.1:9 -o a/b",
            "tune --trials 0 -o a/b",
            "tune --storage nowhere -o a/b",
            "identify no.csv --columns x -o a/b",
            "init no-preset -o a/b",
            "design no-drone -o a/b",
        ]
    ),
)
def test_a_refused_command_leaves_nothing(line: str, tmp_path: Path) -> None:
    """Exit 2, a message without traceback, and the folder as it was."""
    said, talk = run(*line.split(), code=2)
    assert (said, bool(talk), "Traceback" in talk) == ("", True, False), talk
    assert not list(tmp_path.iterdir())
