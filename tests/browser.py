"""A headless Chromium for tests, driven over its own debugging protocol with the websockets that Prefect brings."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
START_TIMEOUT_S = 120.0
FOUND_TIMEOUT_S = 120.0
CLICK = """text => {
    const found = [...document.querySelectorAll('a, button, li')].filter(
        item => item.innerText.trim().split('\\n').includes(text));
    const item = found.find(item => !found.some(other => other !== item && item.contains(other)));
    item?.removeAttribute('target');
    item?.click();
    return Boolean(item);
}"""
OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run", "--no-proxy-server",
    "--disable-dev-shm-usage", "--disable-background-networking", "--disable-extensions",
    "--remote-debugging-port=0", "about:blank",
)  # fmt: skip


class Page:
    """One page of a browser."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection, self._number = connection, 0

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the DevTools protocol and return its result; RuntimeError where it fails."""
        self._number += 1
        self._connection.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while (answer := json.loads(self._connection.recv(timeout=FOUND_TIMEOUT_S))).get(
            "id"
        ) != self._number:
            pass
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return dict(answer["result"])

    def resize(self, width: int, height: int) -> None:
        """Give the page this size in pixels."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def open(self, url: str) -> None:
        """Go to an address."""
        self.call("Page.navigate", url=url)

    def ask(self, expression: str) -> Any:
        """Return what a JavaScript expression gives; RuntimeError where it throws."""
        done = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in done:
            raise RuntimeError(done["exceptionDetails"]["exception"]["description"])
        return done["result"].get("value")

    def wait_for(self, expression: str, seconds: float = FOUND_TIMEOUT_S) -> Any:
        """Return what an expression gives once it is true; AssertionError with the page's text where it stays false."""
        deadline = time.monotonic() + seconds
        while not (found := self.ask(expression)):
            assert time.monotonic() < deadline, f"{expression} stays false: {self.text()}"
            time.sleep(0.2)
        return found

    def text(self) -> str:
        """Return what a person reads on the page."""
        return str(self.ask("(document.body ?? {}).innerText ?? ''"))

    def wait_for_text(self, text: str, seconds: float = FOUND_TIMEOUT_S) -> None:
        """Wait until the page shows a text."""
        self.wait_for(f"document.body?.innerText.includes({json.dumps(text)})", seconds)

    def press(self, text: str, seconds: float = FOUND_TIMEOUT_S) -> None:
        """Click the first link, button or tab of that text, once there is one; no link opens a second page."""
        self.wait_for(f"({CLICK})({json.dumps(text)})", seconds)

    def screenshot(self, path: Path) -> None:
        """Write what is visible to a PNG file."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))


@contextmanager
def browser(folder: Path, width: int, height: int) -> Iterator[Page]:
    """A page of a Chromium that keeps what it stores in a folder and ends with the context."""
    assert CHROMIUM is not None
    command = [CHROMIUM, f"--user-data-dir={folder}", *OPTIONS]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            with connect(_address(folder / "DevToolsActivePort"), max_size=None, proxy=None) as connection:
                page = Page(connection)
                page.resize(width, height)
                yield page
        finally:
            process.terminate()


def _address(note: Path) -> str:
    """Address of the first page's protocol, once the browser has written down its port."""
    deadline = time.monotonic() + START_TIMEOUT_S
    while not (note.exists() and "\n" in note.read_text()):
        assert time.monotonic() < deadline, f"{note}: the browser does not start"
        time.sleep(0.1)
    port = note.read_text().split("\n")[0]
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with opener.open(f"http://127.0.0.1:{port}/json/list") as answer:
        return str(next(page for page in json.load(answer) if page["type"] == "page")["webSocketDebuggerUrl"])
