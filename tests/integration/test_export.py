"""Curated data handed on from a real study: the mask and the filter give exactly what the lake says was selected."""

from __future__ import annotations

from pathlib import Path

import duckdb
import h5py
import numpy as np
import pandas as pd
import pytest

from plancurate.flows.cli.app import main

from .conftest import Studied
from .test_bad_input import complaint

SELECTION = "KMeans_Hybrid-k2-s0"


@pytest.fixture(scope="module")
def selected(smoke: Studied) -> list[str]:
    """Ids of what the selection keeps, as the catalog says."""
    with duckdb.connect(str(smoke.untouched / "lake" / "catalog.duckdb"), read_only=True) as connection:
        rows = connection.execute(
            "SELECT trajectory_id FROM selections WHERE starts_with(selection_id, $1) ORDER BY 1", [SELECTION]
        ).fetchall()
    return [row[0] for row in rows]


def export(smoke: Studied, folder: Path, to: str) -> None:
    words = ("--selection", SELECTION, "--selection", "General", "--to", to, "--home", str(smoke.untouched))
    with pytest.raises(SystemExit) as stopped:
        main(("export", str(folder), *words))
    assert stopped.value.code == 0


def test_robomimics_mask_is_the_selection(smoke: Studied, selected: list[str], tmp_path: Path) -> None:
    export(smoke, tmp_path / "out", "robomimic")
    with h5py.File(tmp_path / "out" / "demonstrations.hdf5") as file:
        masks = {
            name.rpartition("-")[0]: [demo.decode() for demo in mask] for name, mask in file["mask"].items()
        }
        ids = [file["data"][demo].attrs["trajectory_id"] for demo in masks[SELECTION]]
        actions = np.concatenate([demo["actions"][:] for demo in file["data"].values()])
        assert sorted(ids) == selected
        assert sorted(masks["General-all-s0"]) == sorted(file["data"])
        assert 0.5 < np.abs(actions).max() <= 1


def test_lerobots_filter_is_the_selection(smoke: Studied, selected: list[str], tmp_path: Path) -> None:
    export(smoke, tmp_path / "out", "lerobot")
    episodes = pd.read_parquet(tmp_path / "out" / "meta" / "episodes")
    column = next(name for name in episodes if name.startswith(f"kept/{SELECTION}"))
    kept = episodes[episodes[column]]
    assert sorted(kept["trajectory_id"]) == selected
    assert sorted(kept[column.replace("kept/", "rank/")]) == [1, 1, 2, 2]


def test_an_unknown_selection_is_answered_with_the_known_ones(
    smoke: Studied, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def said(*words: str) -> str:
        fixed = ("--to", "lerobot", "--home", str(smoke.untouched))
        return complaint(capsys, "export", str(tmp_path / "out"), *fixed, *words)

    assert "did you mean KMeans-k2" in said("--selection", "KMaens-k2")
    assert "2 begin so" in said("--selection", "Hierarchical")
    unknown = said("--selection", "General", "--observation", "joints")
    assert "unknown observation term 'joints'" in unknown
    assert not (tmp_path / "out").exists()


def test_a_home_without_a_lake_and_a_folder_that_is_taken_are_refused(
    smoke: Studied, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--selection", "General", "--to", "robomimic")
    assert "no lake" in complaint(capsys, "export", str(tmp_path / "out"), *words, "--home", str(tmp_path))
    taken = str(smoke.untouched)
    assert "something already" in complaint(capsys, "export", taken, *words, "--home", taken)
