"""The keys of controller.toml, from the JSON schema of the settings; messages and comments use them."""

from typing import Final

from mambo_codegen.settings.key import Form, Key, key_of
from mambo_codegen.settings.model import Settings

SECTIONS: dict[str, str] = {name: field.description or "" for name, field in Settings.model_fields.items()}
"""The description of each section, in the order of the file."""

KEYS: dict[str, Key] = {
    f"{section}.{name}": key_of(f"{section}.{name}", schema)
    for section, field in Settings.model_fields.items()
    for name, schema in field.default.model_json_schema()["properties"].items()
}
"""Every setting by its dotted path, in the order of the file."""

SETTINGS: Final = Form(SECTIONS, KEYS)
"""What messages on a controller.toml need."""
