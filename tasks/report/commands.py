"""A query of the report as a command line that anybody can run against the same lake."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from plancurate.sql import load

_PARAMETER = re.compile(r"\$(\w+)")
_SPECIAL = re.compile(r'([\\"$`])')  # what a shell reads inside double quotes


@dataclass(frozen=True)
class Query:
    """A file of sql/ and the values bound to it."""

    name: str
    parameters: Mapping[str, object]

    @property
    def statement(self) -> str:
        """The query on one line, its values written out. For people to run; we bind them."""
        lines = (line.split("--", 1)[0] for line in load(self.name).splitlines())
        text = " ".join(" ".join(lines).split()).rstrip(";")
        return _PARAMETER.sub(lambda match: literal(self.parameters[match[1]]), text)

    @property
    def command(self) -> str:
        """The command line that prints the query's rows."""
        escaped = _SPECIAL.sub(r"\\\1", self.statement)
        return f'plancurate sql "{escaped}"'


def literal(value: object) -> str:
    """A value as SQL writes it: NULL, true, 3, 'text' or [a, list]."""
    if value is None:
        return "NULL"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(literal(item) for item in value)}]"
    return "'" + str(value).replace("'", "''") + "'"
