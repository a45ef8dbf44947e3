"""Commands that list what learning is made of: selectors and policies."""

from __future__ import annotations

import inspect

from plancurate.flows.cli.console import output, table
from plancurate.tasks.curation.selectors.base import find_selector, selector_names


def selectors() -> None:
    """List selectors."""
    shown = table("selector", "keeps")
    for name in selector_names():
        shown.add_row(name, find_selector(name).description)
    output.print(shown)


def policies() -> None:
    """List policies with their settings."""
    from plancurate.tasks.learning.policies import kind_of, policy_names  # torch: no --help needs it

    shown = table("policy", "is", "settings")
    for name in policy_names():
        kind = kind_of(name)
        shown.add_row(
            name,
            summary(kind),
            ", ".join(f"{key}={field.default}" for key, field in kind.model_fields.items()),
        )
    output.print(shown)


def summary(thing: object) -> str:
    """First line of a docstring."""
    return (inspect.getdoc(thing) or "").partition("\n")[0]
