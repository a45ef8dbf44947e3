"""A selector as a study names it: plain, or with parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, model_serializer, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from plancurate.tasks.curation.names import labelled

if TYPE_CHECKING:
    from plancurate.tasks.curation.selectors.base import Selector


class SelectorChoice(BaseModel):
    """A selector's name; every other field is one of its parameters."""

    model_config = ConfigDict(frozen=True, extra="allow")

    name: str

    @classmethod
    def read(cls, value: object) -> object:
        """Take a plain name for a choice without parameters."""
        return {"name": value} if isinstance(value, str) else value

    @model_validator(mode="after")
    def _is_known(self) -> SelectorChoice:
        settings = self.selector.parse(self.params)
        if self.model_extra:  # numbers as numbers: a study's key must not depend on how they were written
            self.model_extra.update(settings.model_dump(mode="json", include=set(self.model_extra)))
        return self

    @model_serializer
    def _plain_where_it_can_be(self) -> str | dict[str, Any]:
        return {"name": self.name, **self.params} if self.params else self.name

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Say in forms that a name alone will do."""
        from plancurate.tasks.curation.selectors.base import selector_names  # DuckDB, as below

        named = {"type": "string", "title": "Registered", "enum": selector_names()}
        mapping = {
            "type": "object",
            "title": "With parameters",
            "properties": {"name": named},
            "required": ["name"],
            "additionalProperties": True,
        }
        return {"title": "Selector", "anyOf": [named, mapping]}

    @property
    def params(self) -> dict[str, Any]:
        """Parameters that differ from the selector's own."""
        return dict(self.model_extra or {})

    @property
    def selector(self) -> Selector:
        """The selector; UnknownNameError where none has the name."""
        from plancurate.tasks.curation.selectors.base import (
            find_selector,
        )  # imports DuckDB, which no --help needs

        return find_selector(self.name)

    @property
    def label(self) -> str:
        """Name in tables, such as `BehaviorRetrieval(task=shortest)`."""
        return labelled(self.name, self.params)
