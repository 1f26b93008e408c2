"""Browsers at the pages of a study: a rater's tablet, a coordinator's screen."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import BrowserContext, ConsoleMessage, Request

WITHIN_MS = 15_000
ASKS = ("instructions", "ready", "grade", "break", "question")

# What Chromium itself writes on the console where the network is off or a server down
LOST = re.compile(r"net::ERR_|status of 503")
# ... and where an answer is refused
REFUSED = re.compile(r"status of 4(01|03|09|22)")

SHOWN = """screens => {
    const { screen } = document.getElementById("screen").dataset;
    return screens.includes(screen) && screen;
}"""

POST = """async ([path, fields]) => {
    fields.id = crypto.randomUUID();  // of the act
    const csrf = document.querySelector('meta[name="csrf"]').content;
    const headers = {"Content-Type": "application/json", "X-Masrel-CSRF": csrf};
    const body = JSON.stringify(fields);
    const answer = await fetch(path, {method: "POST", headers, body});
    return [answer.status, await answer.json()];
}"""

# Whether an element has said anything since, for however short a time
LISTEN = """selector => {
    const element = document.querySelector(selector);
    window.hasSpoken = false;
    const look = () => { window.hasSpoken ||= element.textContent !== ""; };
    new MutationObserver(look).observe(element, {childList: true, subtree: true});
}"""


class Visitor:
    """A browser with cookies of its own, at one page; what goes wrong in it is noted.

    Attributes
    ----------
    problems : list of str
        Errors on the console, exceptions, and requests that leave the host.
    tolerated : re.Pattern or None
        Which errors on the console are what the flow is about.
    """

    def __init__(self, context: BrowserContext, address: str) -> None:
        self.context = context
        self.problems: list[str] = []
        self.tolerated: re.Pattern[str] | None = None
        self._origin = address.rpartition("/")[0] + "/"
        context.set_default_timeout(WITHIN_MS)
        context.on("request", self._note_request)
        context.on("console", self._note_console)
        context.on("weberror", lambda error: self.problems.append(f"{error.error}"))
        self.page = context.new_page()
        self.page.goto(address)
        self.page.wait_for_selector('meta[name="csrf"]', state="attached")

    def _note_request(self, request: Request) -> None:
        is_inside = request.url.split(":")[0] in ("data", "blob", "about")
        if not is_inside and not request.url.startswith(self._origin):
            self.problems.append(f"left the host: {request.url}")

    def _note_console(self, message: ConsoleMessage) -> None:
        text = f"{message.type}: {message.text} {message.location.get('url', '')}"
        is_tolerated = self.tolerated is not None and self.tolerated.search(text)
        if message.type in ("error", "warning") and not is_tolerated:
            self.problems.append(text)

    def go_offline(self, banner: str) -> None:
        """Cut the network, and return when this banner has said so.

        Of a stream that is open Chromium lets a page still hear, and whatever is heard
        takes the words away again.
        """
        self.page.evaluate(LISTEN, banner)
        self.context.set_offline(True)
        self.page.wait_for_function("window.hasSpoken")

    def post(self, path: str, **fields: Any) -> tuple[int, dict[str, Any]]:
        """Send something as the page would -> its status and body."""
        status, body = self.page.evaluate(POST, [path, fields])
        return status, body


class Coordinator(Visitor):
    """A coordinator, who starts sessions for the rater's tablet."""

    def start(self, rater: str, *, rehearsal: bool = False) -> None:
        """Start a session as the page does."""
        fields = {"rater": rater, "session": "test", "rehearsal": rehearsal}
        status, body = self.post("/coordinator/start", **fields)
        assert status == 200, body

    def leave(self) -> None:
        """Stop the session if one runs, and wait until it is over."""
        self.tolerated = REFUSED
        self.post("/coordinator/leave")


class Rater(Visitor):
    """A rater who answers whatever the page asks, by what a person sees and taps.

    Attributes
    ----------
    grade : str
        Which grade is given.
    screens : list of str
        What was answered.
    """

    def __init__(self, context: BrowserContext, address: str) -> None:
        super().__init__(context, address)
        self.grade = "2"
        self.screens: list[str] = []

    @property
    def screen(self) -> str:
        """Which screen is shown."""
        return self.page.locator("#screen").get_attribute("data-screen") or ""

    @property
    def text(self) -> str:
        """What the screen says."""
        return self.page.locator("#screen").inner_text()

    @property
    def banner(self) -> str:
        """What stands above it."""
        return self.page.locator("#banner").inner_text()

    def wait_for(self, *screens: str) -> str:
        """Wait until one of these screens is shown -> it."""
        return str(self.page.wait_for_function(SHOWN, arg=screens).json_value())

    def tap(self, name: str | re.Pattern[str]) -> None:
        """Tap a button."""
        is_exact = isinstance(name, str)
        self.page.get_by_role("button", name=name, exact=is_exact).tap()

    def choose(self, text: str) -> None:
        """Choose one of what is offered, by a tap on its text."""
        exactly = re.compile(f"^{re.escape(text)}$")
        self.page.locator("label.choice").filter(
            has=self.page.locator("b", has_text=exactly)
        ).first.tap()

    def begin(self) -> None:
        """Begin a presentation, and return when it is shown."""
        self.wait_for("ready")
        self.tap("Begin")
        self.wait_for("presenting")

    def answer(self) -> None:
        """Answer what is asked now, and return when something else is shown."""
        with self.shown_anew():
            self.act()

    @contextmanager
    def shown_anew(self) -> Iterator[None]:
        """Wait at the end of a block until another screen is shown than before it."""
        heading = self.page.query_selector("#screen h1")
        yield
        self.page.wait_for_function("shown => !shown.isConnected", arg=heading)

    def act(self) -> None:
        """Tap an answer to what is asked now."""
        self.screens.append(self.screen)
        match self.screen:
            case "instructions" | "break":
                self.tap(re.compile("^Continue"))
            case "ready":
                self.tap("Begin")
            case "grade":
                self.choose(self.grade)
                self.tap("Save")
            case "question":
                self._fill_in()
                self.tap("Save")
            case other:
                raise AssertionError(f"nothing is asked at {other}: {self.text}")

    def _fill_in(self) -> None:
        kinds = ("input[type=range]", "textarea", "input[type=number]", "label.choice")
        field = self.page.locator(",".join(f"#screen {kind}" for kind in kinds)).first
        match field.get_attribute("type"), field.evaluate("it => it.tagName"):
            case "number", _:
                field.fill("12")
            case _, "TEXTAREA":
                field.fill("The second one stuck a little.")
            case _:
                field.tap()

    def go_until(self, *screens: str) -> str:
        """Answer until one of these screens is shown -> it."""
        while (shown := self.wait_for(*screens, *ASKS, "fault", "over")) in ASKS:
            if shown in screens:
                return shown
            self.answer()
        assert shown in screens, f"came to {shown}, not to {screens}: {self.text}"
        return shown
