"""The settings of one controller: its sections, the rule between sections, and their digest."""

import hashlib
import json
from typing import Any, Self

from pydantic import ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from mambo_nmpc.codegen.fixed_point import refusals
from mambo_nmpc.codegen.settings.sections import Sections, Target


class Settings(Sections):
    """Settings of a mambo-nmpc controller (controller.toml)."""

    @model_validator(mode="after")
    def _representable(self) -> Self:
        refused = refusals(self) if self.code.scalar == "fixed" else []
        if refused:
            raise ValidationError.from_exception_data(
                "Settings",
                [
                    InitErrorDetails(
                        type=PydanticCustomError("fixed", "{rule}", {"rule": refusal.rule}),
                        loc=(refusal.section, refusal.name),
                        input=getattr(getattr(self, refusal.section), refusal.name),
                    )
                    for refusal in refused
                ],
            )
        return self

    @property
    def in_use(self) -> dict[str, dict[str, Any]]:
        """The values by section, without [target] at its default, with which the C has nothing of it."""
        return {
            section: values
            for section, values in self.model_dump().items()
            if section != "target" or self.target != Target()
        }

    @property
    def digest(self) -> str:
        """The SHA-256 of the values in use, in hexadecimal; equal settings have equal digests."""
        canonical = json.dumps(self.in_use, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()

    @classmethod
    def json_schema(cls) -> dict[str, Any]:
        """Return the JSON schema (draft 2020-12) of controller.toml, for editors."""
        return {"$schema": "https://json-schema.org/draft/2020-12/schema", **cls.model_json_schema()}
