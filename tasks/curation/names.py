"""What selections and the stages of making one are called."""

from __future__ import annotations

from collections.abc import Mapping

STAGES = ("prepare", "base_policy", "rollouts", "cluster", "score", "select")


def labelled(selector: str, params: Mapping[str, object]) -> str:
    """Name a selector with the parameters it was given, such as `BehaviorRetrieval(task=shortest)`."""
    given = ", ".join(f"{name}={value}" for name, value in sorted(params.items()))
    return f"{selector}({given})" if given else selector


def unlabelled(name: str) -> str:
    """The selector's own name, without the parameters that it was given."""
    return name.partition("(")[0]


def label(selector: str, budget: int | None) -> str:
    """Name a selection for a person."""
    return selector if budget is None else f"{selector} k={budget}"
