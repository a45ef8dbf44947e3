"""How far a study agrees with the publication: each selector's gain over General, here and there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from plancurate.tasks.study.against import BASELINE, SURE
from plancurate.tasks.study.published import PublishedResult
from plancurate.tasks.study.rows import Gain, SummaryRow
from plancurate.tasks.study.selection_rows import AgreementRow
from plancurate.tasks.study.statistics import Estimate, effect_difference, two_proportion_test


def agreement_rows(
    summaries: Sequence[SummaryRow], published: Mapping[str, PublishedResult]
) -> list[AgreementRow]:
    """A row for each selection whose selector the publication has; none without General."""
    return [
        _agreement_row(row, row.gain, published[row.selector], published[BASELINE])
        for row in summaries
        if row.gain is not None and row.selector in published
    ]


def _agreement_row(
    row: SummaryRow, gain: Gain, known: PublishedResult, known_base: PublishedResult
) -> AgreementRow:
    published_gain = known.success.rate - known_base.success.rate
    published_p = two_proportion_test(known.success, known_base.success).p
    apart = effect_difference(Estimate(gain.value, gain.error), known.success, known_base.success)
    return AgreementRow(
        *row.cell,
        gain=gain.value,
        interval=gain.interval,
        p=gain.p,
        published_gain=published_gain,
        published_p=published_p,
        difference=apart.value,
        difference_interval=apart.interval(2.0),
        verdict=verdict(effect(gain.value, gain.p), effect(published_gain, published_p), apart),
    )


def effect(gain: float, p: float) -> str:
    """A gain over General in words."""
    if p >= SURE:
        return "no sure effect"
    return "better than General" if gain > 0 else "worse than General"


def verdict(here: str, there: str, apart: Estimate) -> str:
    """Say how two gains over General agree in sign, significance and size."""
    both = f"{here} in both" if here == there else f"{there} in the publication, {here} here"
    if apart.test.p >= SURE:
        return f"{both}; the sizes agree within chance"
    more = "higher" if apart.value > 0 else "lower"
    return f"{both}; {100 * abs(apart.value):.1f} points {more} here, beyond chance"


def agreement_sentence(rows: Sequence[AgreementRow]) -> str:
    """How many gains of one scene and budget have the published sign, and how their order agrees; empty for none."""
    from scipy import stats  # most of a second, which no --help needs

    if not rows:
        return ""
    same = [row for row in rows if row.gain * row.published_gain > 0]
    sure = sum((row.p < SURE) == (row.published_p < SURE) for row in same)
    sentence = (
        f"Against the publication: {len(same)} of {len(rows)} selectors have the published sign of their gain over "
        f"General, {sure} with the published answer on whether it is beyond chance"
    )
    if len(rows) < 3 or len({row.gain for row in rows}) < 2:
        return f"{sentence}."
    rank = stats.spearmanr([row.gain for row in rows], [row.published_gain for row in rows]).statistic
    return f"{sentence}; rank correlation of the gains {rank:.2f}."
