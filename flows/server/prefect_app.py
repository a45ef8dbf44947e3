"""Prefect's API and pages on a socket that listens already: `python -m plancurate.flows.server.prefect_app DESCRIPTOR`.

Whoever starts the server opens the socket, so that nobody else can take its port while the server is imported.
"""

from __future__ import annotations

import socket
import sys

import uvicorn

SHUTDOWN_TIMEOUT_S = 5


def main(descriptor: int) -> None:
    """Serve until a signal says stop."""
    config = uvicorn.Config(
        "prefect.server.api.server:create_app",
        factory=True,
        log_level="warning",
        timeout_graceful_shutdown=SHUTDOWN_TIMEOUT_S,
    )
    uvicorn.Server(config).run(sockets=[socket.socket(fileno=descriptor)])


if __name__ == "__main__":
    main(int(sys.argv[1]))
