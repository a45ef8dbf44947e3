"""A real Prefect server for the time of a run, shared by all runs on one home.

Prefect's own ephemeral server loses task runs and prints tracebacks when it is shut down; without any API URL
there is nothing that a user could open later. So a run without a configured API starts a server process on
127.0.0.1 with its database in the home folder. Runs on the same home share it, and the last one ends it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from plancurate.errors import PlancurateError, shown
from plancurate.flows.server.own_server import own_server
from plancurate.tasks.lake.home import Home

CLIENT_DEFAULTS = {
    "PREFECT_LOGGING_LEVEL": "WARNING",  # two lines a task run cost more than they tell: its states say the same
    "DO_NOT_TRACK": "1",
    "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "CRITICAL",  # run logs go to the API, not to the terminal
    "PREFECT_LOGGING_EXTRA_LOGGERS": "plancurate",
    "PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW": "ignore",
}


@contextmanager
def prefect_server(
    home: Home, port: int = 0, meanwhile: Callable[[], object] = lambda: None
) -> Iterator[str]:
    """Prefect's API URL, set for this process and its children while the context lasts.

    A configured `PREFECT_API_URL` (environment or profile) is used as it is. Otherwise the home's own server
    is joined or started on `port` (0: any free one); `meanwhile` is called while it starts.
    Raises PlancurateError where the configured API does not answer or the server does not start.
    """
    with _environment(CLIENT_DEFAULTS):
        if configured := configured_url():
            with _settings_of_prefect({}):
                check_reachable(configured)
                meanwhile()
                yield configured
            return
        with own_server(home, port, meanwhile) as url, _settings_of_prefect(_client_settings(home, url)):
            from prefect.settings import temporary_settings

            from plancurate.flows.server.recorded import everything_recorded

            # Heartbeats show a server which runs of its workers crashed; each costs its flow up to a second.
            with temporary_settings({"flows.heartbeat_frequency": None}), everything_recorded(url):
                yield url


@contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Environment variables for this process and its children."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.__setitem__(name, value)


@contextmanager
def _settings_of_prefect(variables: Mapping[str, str]) -> Iterator[None]:
    """The environment with these variables as what Prefect goes by; it reads its settings when it is imported.

    Reading them again takes it half a second, so it happens once for all variables, and once in the end.
    """
    with _environment(variables):
        _read_settings()
        if "prefect.main" in sys.modules:
            from prefect.logging.configuration import setup_logging

            setup_logging()
        yield
    _read_settings()


def _read_settings() -> None:
    if "prefect.context" in sys.modules:
        from prefect.context import refresh_global_settings_context

        refresh_global_settings_context()


def _client_settings(home: Home, url: str) -> dict[str, str]:
    return {"PREFECT_API_URL": url, "PREFECT_RESULTS_LOCAL_STORAGE_PATH": str(home.prefect / "results")}


def configured_url() -> str | None:
    """The API URL that the environment or one of Prefect's files sets."""
    if "prefect.context" not in sys.modules and not _may_be_configured():
        return None  # known without importing Prefect, which takes a third of the time of the server's start
    _read_settings()
    from prefect.settings import PREFECT_API_URL

    url: str | None = PREFECT_API_URL.value()
    return url


def _may_be_configured() -> bool:
    """Whether there is anything that Prefect would read settings like an API URL from."""
    profiles = Path(os.environ.get("PREFECT_HOME", "~/.prefect"), "profiles.toml").expanduser()
    files = (Path(os.environ.get("PREFECT_PROFILES_PATH", profiles)), Path(".env"), Path("prefect.toml"))
    named = any(name in os.environ for name in ("PREFECT_API_URL", "PREFECT_PROFILE"))
    pyproject = Path("pyproject.toml")
    described = pyproject.exists() and "[tool.prefect" in pyproject.read_text()
    return named or described or any(file.exists() for file in files)


def check_reachable(url: str) -> None:
    """Raise PlancurateError unless a Prefect API answers at the URL."""
    from prefect.client.orchestration import get_client

    with get_client(httpx_settings={"timeout": 5.0}, sync_client=True) as client:
        problem = client.api_healthcheck()
    if problem is not None:
        raise PlancurateError(
            f"PREFECT_API_URL={shown(url)}: no Prefect API answers there ({problem}); "
            "start that server, or unset the variable to let the command run its own"
        )
