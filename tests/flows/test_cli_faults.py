"""A disk without room: what a command says of it."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from plancurate.errors import IncompleteError
from plancurate.flows.cli import app
from plancurate.flows.cli.stages import run_flow
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.config import load_config


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


def test_a_server_that_can_not_record_is_one_line_with_its_last_words(tmp_path: Path) -> None:
    import httpx
    from prefect.exceptions import PrefectHTTPStatusError

    (tmp_path / "prefect").mkdir()
    (tmp_path / "prefect" / "server.log").write_text("starts\nsqlite3.OperationalError: disk is full\n")

    def refused(*_: object, **__: object) -> None:
        answer = httpx.Response(500, request=httpx.Request("POST", "http://127.0.0.1/api"))
        raise PrefectHTTPStatusError("refused", request=answer.request, response=answer)

    with pytest.raises(
        IncompleteError, match=r"status 500; .*server.log: .*disk is full\); what was finished"
    ):
        run_flow(refused, load_config("smoke", None, {}), Home(tmp_path))
