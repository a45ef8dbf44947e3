"""The MLflow store of a home: its database, made if missing, or a server or database that the environment names.

MLflow takes seconds to import, so functions import it when they are called.
"""

from __future__ import annotations

import fcntl
import logging
import os
import sqlite3
import urllib.error
import urllib.request
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from plancurate.errors import IncompleteError, PlancurateError, shown
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.artifact_roots import adopt_artifacts

if TYPE_CHECKING:
    from mlflow import MlflowClient

# A saved view of the page of runs, opened by a link to its name; experiments that have it are ours.
VIEW = "mlflow.sharedViewState.results"
REACH_TIMEOUT_S = 5.0

# Without these MLflow reports its use, asks a slow server for minutes and looks for a uv project to copy.
ENVIRONMENT = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "2",
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "20",
    "MLFLOW_UV_AUTO_DETECT": "false",
}


def ensure_store(database: Path) -> str:
    """URI of the MLflow store: `MLFLOW_TRACKING_URI` where it is set, else the SQLite file, made if missing.

    A home that was copied or moved finds its models and artifacts in its own folder from then on.
    Raises PlancurateError for a server that does not answer or a database that this MLflow can't use.
    """
    configured = os.environ.get("MLFLOW_TRACKING_URI")
    if configured:
        check_reachable(configured)
        if is_server(configured):
            return configured
    database.parent.mkdir(parents=True, exist_ok=True)
    uri = configured or f"sqlite:///{database}"
    from mlflow.exceptions import MlflowException
    from sqlalchemy.exc import SQLAlchemyError

    with database.with_suffix(".lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # two processes that make the tables at once both fail
        try:
            open_client(uri)
            if not configured:
                adopt_artifacts(database, Home(database.parent).artifacts, VIEW)
        except (MlflowException, SQLAlchemyError, sqlite3.Error) as error:
            reason = " ".join(str(error).split())
            raise PlancurateError(
                f"{shown(uri)}: not a database that this MLflow can use: {reason}"
            ) from None
    return uri


def open_client(uri: str) -> MlflowClient:
    """A client of the store, with MLflow told to keep to itself."""
    for variable, value in ENVIRONMENT.items():
        os.environ.setdefault(variable, value)
    with warnings.catch_warnings():  # importing MLflow's model format warns about MLflow's own type hints
        warnings.simplefilter("ignore")
        import mlflow.pyfunc  # noqa: F401
        from mlflow import MlflowClient

    logging.getLogger("mlflow").setLevel(logging.ERROR)
    logging.getLogger("alembic").setLevel(logging.ERROR)
    return MlflowClient(tracking_uri=uri)


def is_server(uri: str) -> bool:
    """Whether a store is an MLflow server, which decides itself where it keeps files."""
    return uri.startswith(("http://", "https://"))


def check_reachable(uri: str) -> None:
    """Raise PlancurateError for a configured MLflow server, or the server of a configured database, without answer."""
    if uri.startswith("postgresql"):
        _check_database(uri)
    if not is_server(uri):
        return
    try:
        urllib.request.urlopen(f"{uri.rstrip('/')}/health", timeout=REACH_TIMEOUT_S).close()
    except urllib.error.HTTPError:
        return  # somebody answers; what it refuses here, the client may be allowed
    except (OSError, ValueError) as error:
        raise PlancurateError(
            f"MLFLOW_TRACKING_URI={shown(uri)}: no MLflow server answers there ({getattr(error, 'reason', error)}); "
            "start it, or unset the variable to record in the home folder"
        ) from None


def _check_database(uri: str) -> None:
    """MLflow itself would try for minutes."""
    from sqlalchemy import create_engine
    from sqlalchemy.exc import SQLAlchemyError
    from sqlalchemy.pool import NullPool

    try:
        engine = create_engine(
            uri, poolclass=NullPool, connect_args={"connect_timeout": int(REACH_TIMEOUT_S)}
        )
        engine.connect().close()
    except ImportError:
        raise PlancurateError(
            f"MLFLOW_TRACKING_URI={shown(uri)}: PostgreSQL's client is missing; pip install 'plancurate[postgres]'"
        ) from None
    except SQLAlchemyError as error:
        reason = " ".join(str(getattr(error, "orig", error)).split())
        raise PlancurateError(f"MLFLOW_TRACKING_URI={shown(uri)}: no connection: {reason}") from None


@contextmanager
def said_when_lost() -> Iterator[None]:
    """Say of whatever fails in here while the configured MLflow server is gone that it is; as an IncompleteError."""
    try:
        yield
    except Exception as failure:
        try:
            check_reachable(os.environ.get("MLFLOW_TRACKING_URI", ""))
        except PlancurateError as lost:
            raise IncompleteError(
                f"{lost}; what was finished is in the lake, and the same command goes on from here"
            ) from failure
        raise
