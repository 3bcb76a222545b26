"""The page in a real browser: quiet, offline, bodies that turn, nothing wider than the window."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from paxel_design.report.content import Section
from paxel_design.report.html import write_html

PLOTLY_HINT = "willReadFrequently"
"""Chromium's advice on how plotly measures texts; every page with a plotly scene has it."""

LIVE = "document.querySelector('#{0} .live canvas') !== null && document.querySelector('#{0} .live').layout?.scene"


@pytest.fixture(scope="module")
def page(sections: Callable[[], list[Section]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("html") / "report & page.html"
    write_html(path, sections(), title="Report", subtitle="a test", bench="virtual bench", writer="paxel", date="today")
    return path


def complaints(events: list[dict[str, Any]]) -> list[str]:
    """Errors and warnings in the console, exceptions included."""
    found = []
    for event in events:
        params = event["params"]
        if event["method"] == "Runtime.exceptionThrown":
            found.append(str(params["exceptionDetails"]))
        elif event["method"] == "Runtime.consoleAPICalled" and params["type"] in {"error", "warning", "assert"}:
            found.append(str(params["args"]))
        elif event["method"] == "Log.entryAdded" and params["entry"]["level"] in {"error", "warning"}:
            found.append(params["entry"]["text"])
    return [text for text in found if PLOTLY_HINT not in text]


def requests(events: list[dict[str, Any]]) -> set[str]:
    """What was asked for, other than data in the page itself."""
    urls = (e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent")
    return {url for url in urls if not url.startswith(("data:", "blob:"))}


def start(chromium: Any, name: str) -> None:
    """Come to a scene and wait until it is drawn."""
    chromium.value(f"document.getElementById('{name}').scrollIntoView()")
    chromium.until(LIVE.format(name))


def pixels(chromium: Any) -> NDArray[np.int64]:
    with Image.open(io.BytesIO(chromium.screenshot())) as image:
        return np.asarray(image.convert("RGB")).astype(np.int64)


def press(chromium: Any, selector: str) -> None:
    chromium.value(f"document.querySelector(`{selector}`).click()")


def test_bodies_turn_and_the_legend_hides_them_without_a_word_or_a_request(
    chromium: Any, page: Path, tmp_path: Path
) -> None:
    chromium.events.clear()
    chromium.open(page, width=640, height=600)  # software draws the pixels
    start(chromium, "scene-0")
    eye = "Object.values(document.querySelector('#scene-0 .live').layout.scene.camera.eye)"
    box = chromium.value(
        "(() => { const b = document.querySelector('#scene-0 .live').getBoundingClientRect();"
        " return [b.left + b.width / 2, b.top + b.height / 2]; })()"
    )
    before = np.array(chromium.value(eye))
    chromium.mouse("Pressed", *box)
    for step in range(1, 6):
        chromium.mouse("Moved", box[0] + 20 * step, box[1] + 4 * step)
    chromium.mouse("Released", box[0] + 100, box[1] + 20)
    chromium.until(f"Math.abs({eye}[0] - {before[0]}) > 0.05")
    turned = np.array(chromium.value(eye))
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(before), rel=1e-6), (
        "it turns, and does not come closer"
    )

    def blue() -> int:
        """Pixels in the inner body's colour, #1f4e9c in any shade."""
        red, green, b = np.moveaxis(pixels(chromium), 2, 0)
        return int(((b > 1.5 * green) & (green > 1.5 * red) & (b > 40)).sum())

    shown = blue()
    press(chromium, "#scene-0 [data-body='1']")
    chromium.until("document.querySelector('#scene-0 .live').data[1].visible === false")
    assert chromium.value("document.querySelector(`#scene-0 [data-body='1']`).getAttribute('aria-pressed')") == "false"
    assert blue() < shown / 20, "the swatch may stay, the body goes"
    assert np.allclose(chromium.value(eye), turned), "what the reader sees does not jump"
    press(chromium, "#scene-0 [data-body='1']")
    chromium.until("document.querySelector('#scene-0 .live').data[1].visible === true")
    press(chromium, "#scene-0 [data-do='view-0']")
    chromium.until(f"Math.abs({eye}[0] - {before[0]}) < 1e-9")
    chromium.value("document.querySelector('#scene-0 .live').focus()")
    for kind in ("keyDown", "keyUp"):
        chromium.call("Input.dispatchKeyEvent", type=kind, key="ArrowRight")
    chromium.until(f"Math.abs({eye}[0] - {before[0]}) > 0.05")

    chromium.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path), eventsEnabled=False)
    press(chromium, "#scene-0 [data-do='save']")
    chromium.until_true(lambda: (tmp_path / "scene-0.png").exists())
    with Image.open(tmp_path / "scene-0.png") as picture:
        assert picture.size == (1200, 800)
        colors = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    assert np.any(np.all(np.abs(colors.astype(int) - (0x1F, 0x4E, 0x9C)) < 40, axis=1)), "the inner body is in it"

    # All others too: no more live at once than browsers bear, and the last one is.
    for name in ("scene-1", "scene-2", "scene-3"):
        start(chromium, name)
    assert chromium.value("document.querySelectorAll('.live:not([hidden])').length") == 3
    assert chromium.value("document.querySelectorAll('.live[hidden]:empty').length") == 1, "one still is back"
    assert not complaints(chromium.events)
    assert requests(chromium.events) == {page.as_uri()}


def test_nothing_is_wider_than_the_window(chromium: Any, page: Path) -> None:
    width = "document.documentElement.scrollWidth"
    contents = "document.getElementById('contents').getBoundingClientRect().height > 0"
    chromium.open(page, width=1280)
    assert chromium.value(width) <= 1280
    assert chromium.value(contents), "contents stand at the side"
    chromium.resize(390, 844, phone=True)
    chromium.until("innerWidth === 390")
    assert chromium.value(width) <= 390
    chromium.until(f"!({contents})")
    press(chromium, ".fold")
    assert chromium.value(contents)
    table = "document.querySelector('#volumes .scroll')"
    chromium.until(f"{table}.scrollWidth > {table}.clientWidth && {table}.tabIndex === 0")
    press(chromium, "#crops .enlarge")
    assert chromium.value("document.querySelector('dialog').open")
    wide = chromium.value("document.querySelector('dialog img').clientWidth")
    assert wide == 390 // 30 * 30, "pixels are enlarged by a whole number, as much as the window takes"
    press(chromium, "dialog")
    assert not chromium.value("document.querySelector('dialog').open")
    chromium.value("document.getElementById('scene-0').scrollIntoView()")
    started = "new Promise(done => setTimeout(() => done(document.querySelector('canvas') !== null), 600))"
    assert not chromium.value(started), "under a finger that scrolls no scene starts"


def test_the_page_forbids_itself_the_network_and_scripts_of_others(chromium: Any, page: Path) -> None:
    if chromium.value("location.href") != page.as_uri():
        chromium.open(page)
    refused = (
        "new Promise(done => {{ addEventListener('securitypolicyviolation', e => done(e.effectiveDirective)); {0} }})"
    )
    assert chromium.value(refused.format("fetch('https://paxel.invalid/').catch(() => {});")) == "connect-src"
    stranger = "const s = document.createElement('script'); s.textContent = 'let t = 1;'; document.body.append(s);"
    assert chromium.value(refused.format(stranger)) == "script-src-elem"


def test_without_webgl_or_scripts_stills_and_a_word_remain(chromium: Any, page: Path) -> None:
    chromium.call("Page.enable")
    without = chromium.call(
        "Page.addScriptToEvaluateOnNewDocument",
        source="HTMLCanvasElement.prototype.getContext = () => null",
    )
    chromium.open(page)
    chromium.call("Page.removeScriptToEvaluateOnNewDocument", identifier=without["identifier"])
    assert "no WebGL" in chromium.value("document.querySelector('#scene-0 [role=status]').innerText")
    still = "document.querySelector('#scene-0 .stage img')"
    assert chromium.value(f"{still}.complete && {still}.naturalWidth > 0 && {still}.clientWidth > 300")

    chromium.call("Emulation.setScriptExecutionDisabled", value=True)
    chromium.open(page, width=390, height=844)
    assert "Scripts are off" in chromium.value("document.querySelector('#scene-0').innerText")
    assert chromium.value("document.getElementById('contents').getBoundingClientRect().height > 0")
    chromium.call("Emulation.setScriptExecutionDisabled", value=False)
