"""The record of proofs and alarms: it holds for the C that Frama-C read, and for no other."""

from pathlib import Path

import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.verify.check import CheckOutcome, Subject
from tests.support import proven
from tests.support.alarms import UNCHECKED_HEADING, Alarm, Fault
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import Harm, subject
from tests.support.tools import require

COMMENT = Harm("nmpc.c", r"    return status;\n", r"    /* Done. */\n\g<0>")
CONTRACT = Harm("proof/nmpc_proof.c", r"/\*@ assert [^*]*<=[^*]*\*/", "")
INDEX = Harm("nmpc.c", r"= self->plan_rad\[1\]", "= self->plan_rad[0]")


@pytest.fixture(autouse=True)
def _frama_c() -> None:
    require("frama-c", "frama-c-base")


@pytest.fixture
def record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the test a record of its own, which is empty."""
    monkeypatch.setattr(proven, "RECORD", tmp_path / "proven.txt")
    monkeypatch.delenv(proven.ANEW, raising=False)
    return tmp_path / "proven.txt"


def harmed(folder: Path, *harms: Harm) -> Subject:
    """Return a subject in a folder of its own."""
    folder.mkdir()
    return subject(with_option(ONE_NORM, "horizon.prediction", 5), folder, *harms)


def test_the_digest_depends_on_code_and_contracts_and_on_nothing_else(tmp_path: Path) -> None:
    """Not on comments."""
    right = proven.digest(harmed(tmp_path / "right"))
    assert proven.digest(harmed(tmp_path / "again")) == right
    assert proven.digest(harmed(tmp_path / "comment", COMMENT)) == right
    others = [
        proven.digest(harmed(tmp_path / name, harm))
        for name, harm in {"contract": CONTRACT, "index": INDEX}.items()
    ]
    assert len({right, *others}) == 3


@pytest.mark.usefixtures("record")
def test_c_that_the_record_lacks_is_proven(tmp_path: Path) -> None:
    """Frama-C finds that this one cannot be read."""
    wrong = harmed(tmp_path / "wrong", Harm("nmpc.c", r"\bstatic const\b", "statik const"))
    result = proven.check(wrong)
    assert result.outcome is CheckOutcome.FAILED
    assert "frama-c failed" in result.evidence


def test_c_that_the_record_has_is_not_proven_again(tmp_path: Path, record: Path) -> None:
    """Unless all proofs are to be made."""
    wrong = harmed(tmp_path / "wrong", Harm("nmpc.c", r"\bstatic const\b", "statik const"))
    record.write_text(f"{proven.digest(wrong)} 7 some test\n", "utf-8")
    assert proven.check(wrong).figures == {"promises": 7, "promises_proven": 7}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(proven.ANEW, "anew")
        assert proven.check(wrong).outcome is CheckOutcome.FAILED
    assert record.read_text("utf-8").count("\n") == 1


def test_faults_that_the_record_has_are_not_tried_again(tmp_path: Path, record: Path) -> None:
    """But another line or kind of alarm is; this one none raises."""
    faults = {"none": Fault("refuse_nan", UNCHECKED_HEADING, Alarm("nmpc.c", "no such line", "mem_access"))}
    wrong = harmed(tmp_path / "wrong", UNCHECKED_HEADING)
    assert proven.unnoticed(wrong, faults) == ["none"]
    record.write_text(f"{proven.alarm_digest(wrong, faults)} 1 some test\n", "utf-8")
    assert proven.unnoticed(wrong, faults) == []
    others = {"none": faults["none"]._replace(alarm=Alarm("nmpc.c", "no such line", "shift"))}
    assert proven.unnoticed(wrong, others) == ["none"]


def test_what_a_test_proves_takes_the_place_of_what_it_proved_before(record: Path) -> None:
    """So the record grows by no line when the C changes; lines of other tests stay."""
    record.write_text("0a 7 some test\n", "utf-8")
    for key in ("1b", "2c"):
        proven._record(key, 5)
    first, second = record.read_text("utf-8").splitlines()
    assert first == "0a 7 some test"
    assert second.startswith("2c 5 tests/verify/test_proven.py::test_what_a_test_proves_takes")
