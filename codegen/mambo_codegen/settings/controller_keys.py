"""The keys of controller.toml, from the JSON schema of the settings; messages and comments use them."""

from typing import Final

from pydantic.fields import FieldInfo

from mambo_codegen.settings.fields import SettingsSection, type_of
from mambo_codegen.settings.key import Form, Key, key_of
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.renamed_keys import OF_BEFORE

SECTIONS: dict[str, str] = {}
"""The description of each section, in the order of the file."""

KEYS: dict[str, Key] = {}
"""Every setting by its dotted path, in the order of the file."""


def _collect(path: str, section: FieldInfo) -> None:
    """Add the section at `path`, its keys, and then the sections in it."""
    SECTIONS[path] = section.description or ""
    model = type_of(section)
    schemas = model.model_json_schema()["properties"]
    inner = {
        name: field
        for name, field in model.model_fields.items()
        if isinstance(field.default, SettingsSection)
    }
    for name in model.model_fields:
        if name not in inner:
            KEYS[f"{path}.{name}"] = key_of(f"{path}.{name}", schemas[name])
    for name, field in inner.items():
        _collect(f"{path}.{name}", field)


for _name, _field in Settings.model_fields.items():
    _collect(_name, _field)

SETTINGS: Final = Form(SECTIONS, KEYS, renamed=OF_BEFORE)
"""What messages on a controller.toml need."""
