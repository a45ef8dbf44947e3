"""What is found while a robot is read: problems that stop it, all told at once, and notes on what was decided."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from plancurate.errors import PlancurateError

Value = TypeVar("Value")


@dataclass
class Findings:
    """Problems, each with its remedy, and notes; both are sentences for the user."""

    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def attempt(self, read: Callable[[], Value], otherwise: Value) -> Value:
        """Return what `read` does; its PlancurateError becomes a problem, and `otherwise` is returned."""
        try:
            return read()
        except PlancurateError as error:
            self.problems.append(str(error))
            return otherwise

    def stop_at_problems(self, where: object) -> None:
        """Raise one PlancurateError with all the problems, if there are any."""
        problems = list(dict.fromkeys(self.problems))
        if len(problems) == 1:
            raise PlancurateError(f"{where}: {problems[0]}")
        if problems:
            told = "; ".join(f"({number}) {problem}" for number, problem in enumerate(problems, 1))
            raise PlancurateError(f"{where}: {len(problems)} problems: {told}")
