"""Made studies that tested the same targets under other numbers."""

from __future__ import annotations

import pytest

from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.comparison import compare_studies

from ..studies import StudyMaker

XS = [0.1 * i for i in range(40)]
OUTCOMES = "S." * 20


@pytest.mark.slow
def test_the_same_target_is_paired_whatever_its_number(maker: StudyMaker, small_lake: Lake) -> None:
    a, b, c = (maker.record(name, f"{name}{name}") for name in "abc")
    maker.test(a, "KMeans", 20, "BC_MLP", OUTCOMES, kind="unseen", xs=XS)
    maker.test(b, "KMeans", 20, "BC_MLP", OUTCOMES[::-1], kind="unseen", xs=XS[::-1])  # as a, place by place
    maker.test(c, "KMeans", 20, "BC_MLP", OUTCOMES[::-1], kind="unseen", xs=XS)  # the other half
    (same,) = compare_studies(small_lake, a, b, "unseen").results
    (other,) = compare_studies(small_lake, a, c, "unseen").results
    assert same.difference == other.difference == 0
    assert same.interval.high < 0.4 * other.interval.high  # only the imagined targets speak for a difference
