"""A small report with every kind of block, and headless Chromium, driven through the DevTools protocol.

Over a pipe: that needs the standard library only, no port and no web socket.
"""

import base64
import contextlib
import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest

from paxel_design.gamut.meshes import GamutMesh
from paxel_design.gamut.scenes import SceneBody
from paxel_design.report.charts.style import new_figure, style
from paxel_design.report.content import (
    Bullets,
    Chart,
    Heading,
    Paragraph,
    Picture,
    Pictures,
    Quantity,
    Scene,
    Section,
    Table,
    Verdict,
    Verdicts,
)

Sections = Callable[[], list[Section]]

_FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",  # WebGL without a graphics card
    "--enable-unsafe-swiftshader",
    "--remote-debugging-pipe",
)

_LAUNCH = "import os, sys; a = sys.argv; os.dup2(int(a[1]), 3); os.dup2(int(a[2]), 4); os.execv(a[3], a[3:])"
"""Gives Chromium its pipes under the numbers that it expects."""

PATIENCE_S = 90.0
"""How long a condition may take before it counts as failed: twenty times what an idle core needs, and no cost else."""


class Chromium:
    """One browser with one page, on one pipe.

    Messages are JSON that ends with a zero byte, to the browser's file descriptor 3 and from its 4; answers carry the
    id of their call, everything else is an event and is kept in `events`.
    """

    def __init__(self, program: str, profile: Path) -> None:
        import fcntl  # not on Windows, where these tests do not run

        to_browser, self._write = os.pipe()
        self._read, from_browser = os.pipe()
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (to_browser, from_browser)]  # clear of 3 and 4
        self._process = subprocess.Popen(
            [
                sys.executable,
                "-ISc",
                _LAUNCH,
                *map(str, ends),
                program,
                *_FLAGS,
                f"--user-data-dir={profile}",
                "about:blank",
            ],
            pass_fds=ends,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for end in (*ends, to_browser, from_browser):
            os.close(end)
        self._calls = 0
        self._unread = b""
        self._session: str | None = None
        self.events: list[dict[str, Any]] = []
        try:
            self._attach()
        except BaseException:
            self.close()
            raise

    def _attach(self) -> None:
        pages = self.call("Target.getTargets")["targetInfos"]
        target = next(page["targetId"] for page in pages if page["type"] == "page")
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """What the browser answers to a call; fails where it answers with an error."""
        self._calls += 1
        message: dict[str, Any] = {"id": self._calls, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while (answer := self._next()).get("id") != self._calls:
            self.events.append(answer)
        assert "error" not in answer, f"{method}: {answer['error']}"
        result = answer["result"]
        assert isinstance(result, dict)
        return result

    def _next(self) -> dict[str, Any]:
        deadline = time.monotonic() + PATIENCE_S
        while b"\0" not in self._unread:
            ready, _, _ = select.select([self._read], [], [], max(0.0, deadline - time.monotonic()))
            assert ready, f"Chromium is silent since {PATIENCE_S:g} s"
            chunk = os.read(self._read, 1 << 20)
            assert chunk, "Chromium has ended"
            self._unread += chunk
        message, self._unread = self._unread.split(b"\0", 1)
        parsed = json.loads(message)
        assert isinstance(parsed, dict)
        return parsed

    def value(self, script: str) -> Any:
        """What an expression in the page is; promises are awaited."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, f"{script}: {answer['exceptionDetails']}"
        return answer["result"].get("value")

    def until(self, script: str) -> None:
        """Wait for an expression in the page to become true."""
        self.until_true(lambda: bool(self.value(script)), script)

    def until_true(self, condition: Callable[[], bool], words: str = "") -> None:
        """Wait for a condition outside the page."""
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline, f"still false after {PATIENCE_S:g} s: {words}"
            time.sleep(0.02)

    def open(
        self, path: Path, *, width: int = 1280, height: int = 900, dark: bool = False, phone: bool = False
    ) -> None:
        """Load a page into a window of this size and wait until its scripts have run."""
        scheme = "dark" if dark else "light"
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.resize(width, height, phone=phone)
        self.call("Page.navigate", url=path.as_uri())
        self.until(f"location.href.startsWith({path.as_uri()!r}) && document.readyState === 'complete'")

    def resize(self, width: int, height: int, *, phone: bool = False) -> None:
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=phone)
        self.call("Emulation.setTouchEmulationEnabled", enabled=phone)

    def mouse(self, kind: str, x: float, y: float) -> None:
        """`kind`: Pressed, Moved or Released, with the left button."""
        held = {"button": "left", "buttons": 0 if kind == "Released" else 1, "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, **held)

    def screenshot(self) -> bytes:
        """The window as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def close(self) -> None:
        with contextlib.suppress(AssertionError, OSError):
            self._session = None
            self.call("Browser.close")
        try:
            self._process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._write)
        os.close(self._read)


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("needs Chromium to open the page (Debian: apt-get install chromium)")
    browser = Chromium(program, tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


def octahedron(radius: float, lightness: float = 50.0) -> GamutMesh:
    """A closed body about (lightness, 0, 0); its volume is 4/3 r^3."""
    Lab = np.array([[lightness, 0, 0]]) + radius * np.concatenate((np.eye(3), -np.eye(3)))
    faces = [(0, 1, 2), (0, 2, 4), (0, 4, 5), (0, 5, 1), (3, 2, 1), (3, 4, 2), (3, 5, 4), (3, 1, 5)]
    volume = 4 / 3 * radius**3
    return GamutMesh(Lab, np.array(faces), volume, 0.0, volume, 1, 0)


@pytest.fixture(scope="session")
def sections() -> Sections:
    """Makes the sections of a small report with every kind of block, anew at each call."""

    def make() -> list[Section]:
        quantities = {
            "summary.dE": Quantity(0.12431, "dE00", "calibration/accuracy.json#/pattern/dE00_mean"),
            "summary.volume": Quantity(833512.3, "CIELAB^3", "gamut/full.on-pattern.json#/volume", 4),
            "gamut.range": Quantity((19.02, 42.0), "L*", "gamut/lightness.json#/rectangle/L_pattern"),
            "summary.name": Quantity('<b>"A & B"</b>'),
        }
        verdicts = (
            Verdict("Prediction", "summary.dE", "good", "good up to 0.5 dE00", "Nothing to do."),
            Verdict("Volume", "summary.volume", "usable", "good from 1 000 000 CIELAB^3", "A darker ink."),
            Verdict("Range", "gamut.range", "weak", "good from 30 L*", "Larger dots."),
        )
        with matplotlib.rc_context(style()):
            figure = new_figure(60.0)
            axes = figure.subplots(1, 2)
            for k, panel in enumerate(axes):
                panel.plot([0, 1, 2], [0, k, 1], label="a < b & c")
                panel.legend()
        ramp = np.arange(20 * 30 * 3, dtype=np.uint8).reshape(20, 30, 3)
        large, small = SceneBody(octahedron(40.0), "full gamut"), SceneBody(octahedron(15.0), "<sub> & gamut")
        scenes = tuple(
            Scene(f"scene-{k}", f"Bodies {k}", bodies)
            for k, bodies in enumerate(((small, large), (large,), (large, small), (small, large)))
        )
        wide_row = ("full", *["{summary.volume}"] * 9)
        return [
            Section(
                "summary",
                "What it shows & <hides>",
                (
                    Paragraph(
                        "Error {summary.dE} dE00 of {summary.volume} for {summary.name}, <script>alert(1)</script>."
                    ),
                    Verdicts("verdicts", "Verdicts", verdicts),
                    Bullets(("One {summary.dE}", "Two")),
                    Paragraph("Small & fine.", small=True),
                ),
                quantities,
                verdicts,
            ),
            Section(
                "gamut",
                "Gamuts",
                (
                    Heading("The bodies"),
                    *scenes,
                    Table("volumes", "Volumes", ("Gamut", *["A long header"] * 9), (wide_row, wide_row)),
                    Chart("curve", "A chart with <signs>", figure),
                    Heading("Words"),
                    Table("glossary", "Words", ("Word", "Meaning"), (("dE00", "A difference. " * 30),), words=True),
                    Pictures(
                        "crops",
                        "Crops",
                        (
                            Picture(ramp, "True scale", "{summary.dE}", width_mm=60.0, pixelated=True),
                            Picture(ramp, "Pixels", pixelated=True),
                        ),
                    ),
                ),
            ),
        ]

    return make
