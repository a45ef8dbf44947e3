from __future__ import annotations

from plancurate.tasks.curation.selector_choice import SelectorChoice


def test_a_number_is_the_same_however_it_is_written() -> None:
    written, meant = SelectorChoice(name="DBSCAN", eps_m="1e-9"), SelectorChoice(name="DBSCAN", eps_m=1e-9)
    assert written == meant
    assert written.params == {"eps_m": 1e-9}
    assert written.label == meant.label == "DBSCAN(eps_m=1e-09)"
