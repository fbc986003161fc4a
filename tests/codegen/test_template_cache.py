"""The cache of compiled templates: it never changes what is rendered."""

from pathlib import Path

import jinja2
import pytest

from mambo_codegen.bundle.template_cache import TemplateCache


def rendered(text: str) -> str:
    """Render a template in a new environment, which knows no template yet."""
    loader = jinja2.DictLoader({"one.j2": text})
    return (
        jinja2.Environment(loader=loader, bytecode_cache=TemplateCache()).get_template("one.j2").render(x=3)
    )


def test_a_template_is_compiled_once(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Then its code comes from the cache; a changed text is compiled again."""
    assert rendered("{{ x + 1 }}") == "4"
    assert len(list((empty_cache / "templates").iterdir())) == 1
    with monkeypatch.context() as patch:
        patch.setattr(jinja2.Environment, "compile", None)
        assert rendered("{{ x + 1 }}") == "4"
    assert rendered("{{ x + 2 }}") == "5"


@pytest.mark.parametrize("damage", [b"", b"no code", None])
def test_a_damaged_cache_costs_time_only(empty_cache: Path, damage: bytes | None) -> None:
    """A file that is cut short is replaced."""
    rendered("{{ x + 1 }}")
    (file,) = (empty_cache / "templates").iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[:-3] if damage is None else damage)
    assert rendered("{{ x + 1 }}") == "4"
    assert file.read_bytes() == whole


def test_a_cache_that_cannot_be_used_costs_time_only(empty_cache: Path) -> None:
    """Others may write to it."""
    empty_cache.mkdir(mode=0o700)
    empty_cache.chmod(0o777)
    assert rendered("{{ x + 1 }}") == "4"
    assert not list(empty_cache.iterdir())
