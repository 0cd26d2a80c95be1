"""Debian's chromium without a screen, spoken to by the DevTools protocol over a pipe.

A pipe needs neither a port nor a package: messages are JSON, each ended by a zero byte.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
PATIENCE_S = 120.0
OPTIONS = (
    "--headless=new",
    "--remote-debugging-pipe",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--hide-scrollbars",
    "--no-first-run",
)


def program() -> str | None:
    """Where chromium is; None where it is not installed."""
    found = (shutil.which(name) for name in PROGRAMS)
    return next((path for path in found if path), None)


class Browser:
    """A running browser with one page.

    Args:
        commands: File descriptor that the browser reads.
        answers: File descriptor that it writes.
    """

    def __init__(self, commands: int, answers: int) -> None:
        self.complaints: list[str] = []
        self._commands, self._answers = commands, answers
        self._received, self._number, self._session = b"", 0, ""
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        attached = self._call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self._call(f"{domain}.enable")

    def open(self, file: Path, width: int, height: int) -> None:
        """Show a file in a window of this size [CSS px], a phone's where it is narrow."""
        self._call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        self._call("Page.navigate", url=file.resolve().as_uri())
        until = time.monotonic() + PATIENCE_S
        while self.ask("document.readyState + location.protocol") != "completefile:":
            if time.monotonic() > until:
                raise TimeoutError(f"{file} does not load")
            time.sleep(0.05)

    def ask(self, expression: str) -> Any:
        """The value of an expression in the page, waited for if it is a promise."""
        said = self._call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in said, said["exceptionDetails"]
        return said["result"].get("value")

    def screenshot(self, file: Path) -> None:
        """The whole page as PNG, what is below the window included."""
        drawn = self._call("Page.captureScreenshot", format="png", captureBeyondViewport=True)
        file.write_bytes(base64.b64decode(drawn["data"]))

    def _call(self, method: str, **words: object) -> dict[str, Any]:
        self._number += 1
        message = {"id": self._number, "method": method, "params": words}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._commands, json.dumps(message).encode() + b"\0")
        while True:
            received = self._receive()
            if received.get("id") == self._number:
                assert "error" not in received, received["error"]
                return received["result"]
            self._notice(received)

    def _notice(self, event: dict[str, Any]) -> None:
        """Keep what a page complains of: exceptions, failed loads, errors in its log."""
        words = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            self.complaints.append(str(words["exceptionDetails"]))
        elif event.get("method") == "Log.entryAdded" and words["entry"]["level"] == "error":
            self.complaints.append(words["entry"]["text"])

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self._received:
            ready, _, _ = select.select([self._answers], [], [], PATIENCE_S)
            part = os.read(self._answers, 1 << 20) if ready else b""
            if not part:
                raise TimeoutError("chromium does not answer")
            self._received += part
        first, _, self._received = self._received.partition(b"\0")
        return json.loads(first)


@contextmanager
def browser(profile: Path) -> Iterator[Browser]:
    """Start chromium with a profile folder of its own, and end it after use."""
    found = program()
    assert found is not None
    to_read, commands = os.pipe()
    answers, to_write = os.pipe()
    # The protocol's pipes are its descriptors 3 and 4; the shell moves them there.
    move = f'exec "$@" 3<&{to_read} 4>&{to_write}'
    process = subprocess.Popen(
        ["bash", "-c", move, "chromium", found, *OPTIONS, f"--user-data-dir={profile}"],
        pass_fds=(to_read, to_write),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(to_read)
    os.close(to_write)
    try:
        yield Browser(commands, answers)
    finally:
        process.terminate()
        process.wait()
        os.close(commands)
        os.close(answers)
