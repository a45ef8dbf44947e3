"""How far this study agrees with the publication: each selector's gain over General, here and there."""

from __future__ import annotations

from collections.abc import Sequence

from scipy import stats

from plancurate.tasks.report import text
from plancurate.tasks.report.comparisons import outcomes, published
from plancurate.tasks.report.contents import Table
from plancurate.tasks.report.published import published_results
from plancurate.tasks.report.rows import AgreementRow
from plancurate.tasks.report.source import Source, is_base, selection
from plancurate.tasks.report.tables import STARS
from plancurate.tasks.study.results import BASELINE
from plancurate.tasks.study.statistics import Difference, effect_difference, rate_difference

SURE = 0.05


def agreement_rows(source: Source) -> list[AgreementRow]:
    """A row for each selection whose selector the publication has, best first; none without General."""
    rows = source.rows("by_selector")
    base = next((outcomes(row) for row in rows if is_base(row)), None)
    if base is None:
        return []
    found_base = published_results()[BASELINE].success
    compared = []
    for row in rows:
        known = published(row)
        if known is None or is_base(row):
            continue
        ours = rate_difference(outcomes(row), base)
        theirs = rate_difference(known.success, found_base)
        apart = effect_difference(outcomes(row), base, known.success, found_base)
        compared.append(
            AgreementRow(
                *selection(row),
                gain=ours.value,
                interval=ours.interval,
                stars=ours.test.stars,
                published_gain=theirs.value,
                published_stars=theirs.test.stars,
                difference=apart.value,
                difference_interval=apart.interval,
                verdict=verdict(ours, theirs, apart),
            )
        )
    return compared


def verdict(ours: Difference, published: Difference, apart: Difference) -> str:
    """Say in plain words how two gains over General agree in sign, significance and size."""
    here, there = effect(ours), effect(published)
    both = f"{here} in both" if here == there else f"{there} in the publication, {here} here"
    if apart.test.p >= SURE:
        return f"{both}; the sizes agree within chance"
    more = "higher" if apart.value > 0 else "lower"
    return f"{both}; {100 * abs(apart.value):.1f} points {more} here, beyond chance"


def effect(gain: Difference) -> str:
    """A gain over General in words."""
    if gain.test.p >= SURE:
        return "no sure effect"
    return "better than General" if gain.value > 0 else "worse than General"


def agreement_table(source: Source) -> Table[AgreementRow]:
    """The side by side."""
    rows = agreement_rows(source)
    return Table(
        key="agreement",
        title="Gain over General, here and in the publication",
        note=f"In percentage points of success, with Newcombe's interval; the publication's is over its four policies "
        f"and 320 tests. {STARS} Beyond chance: the two gains differ with p below 0.05 if all tests were "
        "independent; tests of one network are not, so that is said too easily.",
        rows=rows,
        headers=("selector", "k", "gain", "95 %", "published gain", "ours less theirs", "95 %", "in words"),
        cells=[
            [
                row.selector,
                text.budget(row.budget),
                f"{text.points(row.gain)} {row.stars}",
                text.percents(row.interval),
                f"{text.points(row.published_gain)} {row.published_stars}",
                text.points(row.difference),
                text.percents(row.difference_interval),
                row.verdict,
            ]
            for row in rows
        ],
        queries=[source.query("by_selector")],
    )


def summary(rows: Sequence[AgreementRow]) -> str:
    """One sentence over the rows of one budget; nothing without rows."""
    if not rows:
        return ""
    signs = sum(row.gain * row.published_gain > 0 for row in rows)
    sure = sum(row.gain * row.published_gain > 0 and _sure(row) for row in rows)
    sentence = (
        f"Against the publication: {signs} of {len(rows)} selectors have the published sign of their gain over "
        f"General, {sure} with the published answer on whether it is beyond chance"
    )
    rank = stats.spearmanr([row.gain for row in rows], [row.published_gain for row in rows]).statistic
    return f"{sentence}; rank correlation of the gains {rank:.2f}." if len(rows) > 2 else f"{sentence}."


def _sure(row: AgreementRow) -> bool:
    return (row.stars == "ns") == (row.published_stars == "ns")
