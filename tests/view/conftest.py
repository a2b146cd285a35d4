"""A page in headless Chromium, and what it said.

Screenshots are kept in $GOUGH_ARTEFACTS, or in runs/view where that is not set.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from gough import Platform
from gough.view.viewer import Viewer

if TYPE_CHECKING:  # a second, which tests without the browser need not wait
    from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Locator, Page

ARTEFACTS = Path(os.environ.get("GOUGH_ARTEFACTS", Path(__file__).parents[2] / "runs" / "view"))
PATIENCE = 120_000  # [ms] a busy machine may compile and draw in software
WINDOW = {"width": 1360, "height": 900}


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    import chromium

    found = chromium.find()
    if found is None:
        pytest.skip(chromium.MISSING)
    with chromium.running(found) as browser:
        yield browser


class Tab:
    """A page that fails its test if it complains, or asks for anything from elsewhere."""

    def __init__(self, context: BrowserContext, name: str) -> None:
        self.page: Page = context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self._name, self._shots = name, 0
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", self._hear)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))

    def _hear(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self.errors.append(message.text)

    def open(self, url: str) -> None:
        self.page.goto(url)
        self.page.wait_for_selector("canvas")
        self.page.wait_for_selector("[data-gough=status]")
        warning = self.page.get_by_text("Software WebGL rendering detected")
        warning.wait_for()
        self.page.locator(".mantine-Notification-closeButton").click()
        warning.wait_for(state="hidden")

    def shot(self, what: str) -> None:
        """Keep a picture of the page for people to look at."""
        ARTEFACTS.mkdir(parents=True, exist_ok=True)
        self.settle()
        self.page.screenshot(path=ARTEFACTS / f"{self._name}-{what}.png")

    def settle(self) -> None:
        """Wait until what has arrived is drawn."""
        frames = "() => new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"
        self.page.evaluate(frames)

    def elsewhere(self, home: str) -> list[str]:
        """Requests to other places than the page's own."""
        inside = ("data:", "blob:", home)
        return [url for url in self.requests if not url.startswith(inside)]

    # ---- the panel --------------------------------------------------------------------

    @property
    def status(self) -> str:
        return self.page.inner_text("[data-gough=status]")

    def await_status(self, text: str) -> None:
        """Wait until the status begins with a text."""
        pattern = re.compile(re.escape(text))
        self.page.locator("[data-gough=status]", has_text=pattern).wait_for()

    def await_ready(self) -> None:
        """Wait until the solver is compiled."""
        self.page.locator("[data-gough=note]").wait_for(state="detached")

    def number(self, row: int) -> Locator:
        """The box beside a slider: legs 0 to 5, then x, y, z, rx, ry, rz."""
        return self.page.locator(".mantine-NumberInput-input").nth(row)

    def numbers(self) -> list[float]:
        """What all boxes say."""
        boxes = self.page.locator(".mantine-NumberInput-input")
        return [float(boxes.nth(i).input_value()) for i in range(boxes.count())]

    def await_other(self, row: int, value: str) -> None:
        """Wait until a box says something else than `value`."""
        boxes = "document.querySelectorAll('.mantine-NumberInput-input')"
        self.page.wait_for_function(f"v => {boxes}[{row}].value != v", arg=value)

    def await_took(self, text: str) -> None:
        """Wait until the line below the status says what was computed."""
        self.page.locator("[data-gough=took]", has_text=text).wait_for()

    def mode(self, number: int) -> Locator:
        """The button of a mode in the list."""
        return self.page.get_by_role("button", name=re.compile(rf"^{number}:"))

    def tab(self, name: str) -> None:
        self.page.get_by_role("tab", name=name).click()

    def click(self, text: str) -> None:
        self.page.get_by_role("button", name=text).click()

    def click_box(self, label: str) -> None:
        row = self.page.locator(".mantine-Flex-root", has_text=re.compile(rf"^{label}$"))
        row.locator("input[type=checkbox]").click()


@pytest.fixture
def tab(browser: Browser, request: pytest.FixtureRequest) -> Iterator[Tab]:
    """An empty tab; in the end it must not have complained."""
    name = re.sub(r"\W+", "-", request.node.name.removeprefix("test_")).strip("-")
    context = browser.new_context(viewport=WINDOW, offline="offline" in request.keywords)  # pyright: ignore[reportArgumentType]
    tab = Tab(context, name)
    yield tab
    context.close()
    assert tab.errors == []


@pytest.fixture
def show(tab: Tab) -> Iterator[Callable[..., Viewer]]:
    """Serve a machine and open its page."""
    with ExitStack() as stack:

        def show(name: str, **options) -> Viewer:
            viewer = stack.enter_context(closing(Viewer(Platform.load(name), port=0, **options)))
            tab.open(f"http://localhost:{viewer.port}")
            return viewer

        yield show
