"""A study with PostgreSQL under Prefect and MLflow has the rows of one with SQLite files, and says no password."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import pytest

from plancurate.errors import PlancurateError
from plancurate.flows.server.prefect_server import prefect_server
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.mlflow_store import ensure_store

from ..integration.conftest import Command
from .conftest import PASSWORD, Postgres, holds
from .tiny_study import Rows, rows, words


def variables(server: Postgres) -> dict[str, str]:
    return {
        "PREFECT_API_DATABASE_CONNECTION_URL": server.url("prefect", "postgresql+asyncpg"),
        "MLFLOW_TRACKING_URI": server.url("mlflow"),
    }


def count(server: Postgres, database: str, question: str) -> int:
    import psycopg2

    with closing(psycopg2.connect(server.url(database))) as connection, connection.cursor() as cursor:
        cursor.execute(question)
        return int(cursor.fetchone()[0])


def values(server: Postgres, database: str) -> str:
    """Everything that a database's tables hold."""
    import psycopg2

    with closing(psycopg2.connect(server.url(database))) as connection, connection.cursor() as cursor:
        cursor.execute("SELECT table_name FROM information_schema.tables WHERE table_schema = 'public'")
        said = []
        for (table,) in cursor.fetchall():
            cursor.execute(f'SELECT t::text FROM "{table}" t')
            said += [row for (row,) in cursor.fetchall()]
    return "\n".join(said)


def test_a_study_with_postgresql(
    plancurate: Command, on_threads: Rows, postgres: Postgres, tmp_path: Path
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    done = plancurate(*words(home, "tiny", "threads"), folder=tmp_path, **variables(postgres))
    assert done.returncode == 0, done.stderr
    assert rows(home, "tiny") == on_threads
    assert not list(home.rglob("*.db"))
    assert not (tmp_path / "mlruns").exists()

    assert count(postgres, "prefect", "SELECT count(*) FROM flow_run WHERE state_type = 'COMPLETED'") >= 6
    assert (
        count(postgres, "prefect", "SELECT count(*) FROM task_run WHERE name LIKE 'plan %'") == 2
    )  # one a planner
    assert count(postgres, "mlflow", "SELECT count(*) FROM runs WHERE status = 'FINISHED'") == 7
    models = "SELECT count(*) FROM logged_models WHERE artifact_location LIKE "
    assert count(postgres, "mlflow", f"{models}'{(home / 'artifacts').as_uri()}%'") == 4

    assert PASSWORD not in done.stdout + done.stderr
    assert not holds(home, PASSWORD)
    assert PASSWORD not in values(postgres, "prefect") + values(postgres, "mlflow")


def test_a_wrong_password_of_mlflow_is_said_without_it(
    postgres: Postgres, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MLFLOW_TRACKING_URI", postgres.url("mlflow", password="mistyped"))
    with pytest.raises(PlancurateError, match="password authentication failed") as said:
        ensure_store(tmp_path / "mlflow.db")
    assert "mistyped" not in str(said.value)
    assert "\n" not in str(said.value)


def test_a_wrong_password_of_prefect_is_said_without_it(
    postgres: Postgres, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, expected_in_logs: list[str]
) -> None:
    reason = "password authentication failed"
    expected_in_logs.append(reason)
    wrong = postgres.url("prefect", "postgresql+asyncpg", "mistyped")
    monkeypatch.setenv("PREFECT_API_DATABASE_CONNECTION_URL", wrong)
    with pytest.raises(PlancurateError, match=reason) as said, prefect_server(Home(tmp_path)):
        pass
    assert "\n" not in str(said.value)
    assert not holds(tmp_path, "mistyped")
