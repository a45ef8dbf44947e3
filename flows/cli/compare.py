"""The command that puts two studies side by side."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any, Literal

from rich.table import Table

from plancurate.flows.cli.console import output, write
from plancurate.flows.cli.options import HomeOptions
from plancurate.flows.cli.pools import say_degenerate
from plancurate.flows.cli.tables import as_markdown
from plancurate.tasks.curation.names import label
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study import text
from plancurate.tasks.study.comparison import (
    FieldDifference,
    RateDifference,
    StudyComparison,
    compare_studies,
)
from plancurate.tasks.study.studies import find_study
from plancurate.tasks.study.trial_results import Kind

NOTE = (
    "Success in percent over seeds and the policies that both tried ({policies}) [95 % interval over seeds and test "
    "targets]; difference: B - A in percentage points; stars: B differs from A with p below 0.05 (*), 0.01 (**), "
    "0.001 (***) after Holm's adjustment for all rows. B lies inside A's interval in {repeated} of {rows} rows."
)
SAME_SETUP = "Both studies are set up alike."
NOTHING_SHARED = "No selection was tested with the same policy in both studies."


def compare(
    study_a: str,
    study_b: str,
    /,
    *,
    format: Literal["table", "markdown", "json"] = "table",
    kind: Kind = "displaced",
    key_a: str | None = None,
    key_b: str | None = None,
    options: HomeOptions = HomeOptions(),
) -> None:
    """Put two studies side by side: what was set up differently, and which success rates differ.

    Args:
        study_a: Name of a study; the one that ran last under it.
        study_b: Name of the study to compare with it.
        format: How to print the comparison.
        kind: Test targets: displaced from trained ones, or unseen.
        key_a: Key of an earlier study of the first name.
        key_b: Key of an earlier study of the second name.
    """
    lake = Lake(options.folder().lake)
    a, b = find_study(lake, study_a, key_a), find_study(lake, study_b, key_b)
    compared = compare_studies(lake, a, b, kind)
    for study in dict.fromkeys((a, b)):
        say_degenerate(lake, study)
    if format == "json":
        write(as_json(compared))
    elif format == "markdown":
        write(as_page(compared))
    else:
        show(compared)


def show(compared: StudyComparison) -> None:
    """Print a comparison for the terminal."""
    output.print(f"A  {compared.a}\nB  {compared.b}\n", highlight=False, soft_wrap=True)
    output.print(terminal_table(setup_rows(compared)) if compared.fields else SAME_SETUP)
    output.print()
    if compared.results:
        output.print(terminal_table(result_rows(compared)))
        output.print(note(compared), style="dim", markup=False, highlight=False)
    else:
        output.print(NOTHING_SHARED)
    for line in unshared(compared):
        output.print(line, highlight=False)


def terminal_table(rows: list[dict[str, str]]) -> Table:
    """Rows of the same fields as a table for the terminal; the first column is never cut."""
    shown = Table(box=None, padding=(0, 1, 0, 0), header_style="bold")
    for number, name in enumerate(rows[0]):
        shown.add_column(name, no_wrap=number == 0, overflow="fold")
    for row in rows:
        shown.add_row(*(value.replace("[", "\\[") for value in row.values()))
    return shown


def as_page(compared: StudyComparison) -> str:
    """Return a comparison as Markdown."""
    setup = as_markdown(setup_rows(compared)) if compared.fields else f"{SAME_SETUP}\n"
    results = (
        f"{as_markdown(result_rows(compared))}\n{note(compared)}\n"
        if compared.results
        else f"{NOTHING_SHARED}\n"
    )
    parts = [
        f"A: {compared.a}  \nB: {compared.b}\n",
        setup,
        results,
        *(f"{line}\n" for line in unshared(compared)),
    ]
    return "\n".join(parts)


def as_json(compared: StudyComparison) -> str:
    """Return a comparison as a JSON object, rates as shares of 1."""
    only = {
        "only_a": [key._asdict() for key in compared.only_a],
        "only_b": [key._asdict() for key in compared.only_b],
    }
    return json.dumps(asdict(compared) | only | {"repeated": compared.repeated}, indent=1)


def note(compared: StudyComparison) -> str:
    """Return how to read the table of success rates."""
    policies = sorted({policy for result in compared.results for policy in result.policies})
    return NOTE.format(policies=", ".join(policies), repeated=compared.repeated, rows=len(compared.results))


def setup_rows(compared: StudyComparison) -> list[dict[str, str]]:
    """What was set up differently, in words."""
    return [
        {"field": field.field, **dict(zip("AB", field_text(field), strict=True))} for field in compared.fields
    ]


def result_rows(compared: StudyComparison) -> list[dict[str, str]]:
    """Success rates and their differences, in words."""
    several = len({result.group for result in compared.results}) > 1
    return [
        ({"scene": text.group(result)} if several else {}) | result_row(result) for result in compared.results
    ]


def result_row(result: RateDifference) -> dict[str, str]:
    """One selection's success rates and their difference, in words."""
    return {
        "selector": result.selector,
        "k": text.budget(result.budget),
        "A": f"{text.percent(result.a.rate)} {text.whole_percents(result.a_interval)}",
        "B": f"{text.percent(result.b.rate)} {text.whole_percents(result.b_interval)}",
        "difference": f"{text.points(result.difference)} {text.whole_percents(result.interval)}",
        "Holm p": f"{result.p_holm:.2g} {result.stars}",
    }


def field_text(field: FieldDifference) -> tuple[str, str]:
    """Return both values in words; of two lists what the other one lacks, unless only their order differs."""
    a, b = field.a, field.b
    if isinstance(a, list) and isinstance(b, list):
        more_a, more_b = [x for x in a if x not in b], [x for x in b if x not in a]
        if more_a or more_b:
            return also_text(more_a), also_text(more_b)
    return value_text(a), value_text(b)


def also_text(more: list[Any]) -> str:
    """Return what one list has and the other lacks."""
    return f"also {', '.join(map(value_text, more))}" if more else ""


def value_text(value: Any) -> str:
    """Return a value of the configuration in words."""
    if value is None:
        return "unset"
    return value if isinstance(value, str) else json.dumps(value)


def unshared(compared: StudyComparison) -> list[str]:
    """Return a line for each study that has selections of its own."""
    sides = (("A", compared.only_a), ("B", compared.only_b))
    return [
        f"only in {side}: {', '.join(dict.fromkeys(label(key.selector, key.budget) for key in only))}"
        for side, only in sides
        if only
    ]
