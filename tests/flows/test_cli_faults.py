"""A disk without room: what a command says of it."""

from __future__ import annotations

import errno

import pytest

from plancurate.flows.cli import app


@pytest.mark.parametrize(
    ("error", "named"),
    [
        (OSError(errno.ENOSPC, "Error writing bytes to file", "lake/part-a.parquet"), "lake/part-a.parquet"),
        (OSError(errno.EDQUOT, "Disk quota exceeded"), "a file could not be written"),
    ],
    ids=["a file", "no file is named"],
)
def test_a_full_disk_is_one_line_that_says_to_make_room(
    error: OSError, named: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(app, "app", fail)
    with pytest.raises(SystemExit) as stopped:
        app.main(["lake", "status"])
    said = capsys.readouterr().err.splitlines()
    assert stopped.value.code == 2
    assert len(said) == 1
    assert said[0].startswith(f"plancurate: {named}: ")
    assert said[0].endswith("make room, and the same command goes on from here")
