"""Headless Chromium, driven over a pipe by the DevTools protocol: tests and pictures of pages."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
"""Path of the browser; None without one."""

_OPTIONS = (
    "--headless", "--no-sandbox", "--remote-debugging-pipe", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--hide-scrollbars", "--autoplay-policy=no-user-gesture-required", "--no-first-run",
)  # fmt: skip


class Browser:
    """Page in a browser.

    Parameters
    ----------
    page : Path
        HTML file.
    size : (int, int)
        Width and height of the window (pixels).
    """

    def __init__(self, page: Path, size: tuple[int, int] = (1300, 900)) -> None:
        self.errors: list[str] = []
        self._number = 0
        self._read: list[dict[str, Any]] = []
        self._buffer = b""
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        there_read, here_write = os.pipe()
        here_read, there_write = os.pipe()

        def inherit() -> None:  # Chromium reads file 3 and writes file 4
            high = [os.dup2(end, 20 + end) for end in (there_read, there_write)]
            os.dup2(high[0], 3)
            os.dup2(high[1], 4)

        profile = f"--user-data-dir={self._profile.name}"
        self._process = subprocess.Popen(
            [str(CHROMIUM), *_OPTIONS, profile, f"--window-size={size[0]},{size[1]}", "about:blank"],
            preexec_fn=inherit, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(there_read)
        os.close(there_write)
        self._here = (here_read, here_write)
        targets = self._call("Target.getTargets")["targetInfos"]
        target = next(of["targetId"] for of in targets if of["type"] == "page")
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Page"):
            self._call(f"{domain}.enable")
        self._call("Page.navigate", url=page.resolve().as_uri())
        self.wait("document.readyState === 'complete'")

    def run(self, script: str) -> Any:
        """Return the value of a script, which may be a promise; an exception in it is a RuntimeError."""
        for _ in range(3):
            answer = self._call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
            if answer.get("lost"):
                continue
            if "exceptionDetails" in answer:
                raise RuntimeError(str(answer["exceptionDetails"].get("exception", {}).get("description")))
            return answer["result"].get("value")
        raise RuntimeError("the page was left while a script ran")

    def wait(self, condition: str) -> None:
        """Wait until a condition of JavaScript holds, a minute at most."""
        check = f"const check = () => {condition} || Date.now() > end ? done() : setTimeout(check, 50)"
        self.run(f"new Promise((done) => {{ const end = Date.now() + 60000; {check}; check(); }})")
        if not self.run(f"Boolean({condition})"):
            raise RuntimeError(f"not within a minute: {condition}")

    def picture(self, path: Path, selector: str = "", *, scale: float = 1.0) -> Path:
        """Write a picture (PNG) of an element, or of the window."""
        clip: dict[str, Any] = {}
        if selector:
            self.run(f"document.querySelector({selector!r}).scrollIntoView({{block: 'start', behavior: 'instant'}})")
            self.run("new Promise((done) => setTimeout(done, 1200))")
            box = self.run(
                f"(({{left, top, width, height}}) => ({{x: left + scrollX, y: top + scrollY, width, height}}))"
                f"(document.querySelector({selector!r}).getBoundingClientRect())"
            )
            clip = {"clip": {**box, "scale": scale}, "captureBeyondViewport": True}
        path.write_bytes(base64.b64decode(self._call("Page.captureScreenshot", format="png", **clip)["data"]))
        return path

    def paper(self, width: float, height: float) -> None:
        """Lay the page out as a printer receives it.

        Parameters
        ----------
        width, height : float
            Size of the paper (inches) with margins of 0.4 inches.
        """
        inner = {name: round(96 * (size - 0.8)) for name, size in (("width", width), ("height", height))}
        self._call("Emulation.setEmulatedMedia", media="print")
        self.run("window.dispatchEvent(new Event('beforeprint'))")
        self._call("Emulation.setDeviceMetricsOverride", **inner, deviceScaleFactor=1, mobile=False)

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Return the answer to a command; errors of the page are kept on the way."""
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": parameters}
        if hasattr(self, "_session"):
            message["sessionId"] = self._session
        os.write(self._here[1], json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._number:
                if "error" in answer:
                    if "context was destroyed" in answer["error"]["message"]:
                        return {"lost": True}
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                found: dict[str, Any] = answer["result"]
                return found
            if answer.get("method") == "Runtime.exceptionThrown":
                details = answer["params"]["exceptionDetails"]
                self.errors.append(details.get("exception", {}).get("description") or details["text"])
            elif answer.get("method") == "Log.entryAdded" and answer["params"]["entry"]["level"] == "error":
                self.errors.append(answer["params"]["entry"]["text"])

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            piece = os.read(self._here[0], 1 << 20)
            if not piece:
                raise RuntimeError("the browser has ended")
            self._buffer += piece
        message, self._buffer = self._buffer.split(b"\0", 1)
        found: dict[str, Any] = json.loads(message)
        return found

    def __enter__(self) -> Browser:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.terminate()
        self._process.wait()
        for end in self._here:
            os.close(end)
        self._profile.cleanup()


def main(arguments: list[str]) -> None:
    """Write a picture of the first screen of a page: PAGE OUT.png [WIDTH HEIGHT]."""
    page, out, *size = arguments
    width, height = map(int, size or (1300, 857))
    with Browser(Path(page), (width, height)) as browser:
        emulated = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        browser._call("Emulation.setDeviceMetricsOverride", **emulated)
        browser.run("new Promise((done) => setTimeout(done, 3000))")
        browser.picture(Path(out))


if __name__ == "__main__":
    main(sys.argv[1:])
