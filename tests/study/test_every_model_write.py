"""A network that is stored by a process that is killed or out of room at any write is there whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from plancurate.tasks.lake.manifest import folder_damage
from plancurate.tasks.lake.parts import sweep
from plancurate.tasks.learning.policies import load_policy
from plancurate.tasks.study.networks import keep

from ..learning.policies.test_trained import trained
from ..write_faults import WriteFaults, files


def store(root: Path) -> None:
    keep(trained("BC_MLP"), root / "network", None)


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "fewest"), [("kill", 8), ("full", 5)])
def test_a_fault_at_any_write_of_a_network(
    fault: str, fewest: int, tmp_path: Path, write_faults: WriteFaults
) -> None:
    (tmp_path / "before").mkdir()
    places = (tmp_path / "faults", tmp_path / "before")
    faulted, undisturbed = write_faults.at_every_write(fault, store, *places)
    assert len(faulted) >= fewest
    load_policy(undisturbed / "network")
    for root in faulted:
        assert fault == "kill" or not list(root.iterdir())
        if (root / "network").exists():
            assert folder_damage(root / "network") == []
        store(root)
        sweep(root, older_than_s=0)
        assert files(root) == files(undisturbed)
