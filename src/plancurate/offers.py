"""Registered names in the JSON schema of a field, for forms that list what there is to choose from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def offers(names: Callable[[], list[str]], otherwise: str = "") -> Callable[[dict[str, Any]], None]:
    """Extend the schema of a name, or of a list of names, by those that are registered when a form is made.

    otherwise: what may stand instead, such as a file; empty where only registered names will do.
    """

    def extend(schema: dict[str, Any]) -> None:
        place = schema.get("items", schema)
        if otherwise:
            listed = {"type": place.pop("type"), "enum": names(), "title": "Registered"}
            place["anyOf"] = [listed, {"type": "string", "title": otherwise}]
        else:
            place["enum"] = names()

    return extend
