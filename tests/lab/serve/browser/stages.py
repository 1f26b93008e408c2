"""A served study with a coordinator at work, on which flows are played."""

from playwright.sync_api import Browser

from masrel.lab.protocol import StudyPaths
from masrel.lab.run import Event, read_log
from tests.lab.serve.browser.serving import Server
from tests.lab.serve.browser.visitors import LOST, Coordinator, Rater, Visitor

TABLET = {"width": 820, "height": 1180}
LAPTOP = {"width": 1366, "height": 768}


class Stage:
    """One study, its server, its coordinator; and the rater of the flow.

    Attributes
    ----------
    rater : str
        Whose session the flow is about.
    """

    def __init__(self, browser: Browser, study: StudyPaths, server: Server) -> None:
        self._browser = browser
        self.study, self.server = study, server
        self.rater = "R1"
        self._visitors: list[Visitor] = []
        self.coordinator = Coordinator(
            browser.new_context(viewport=LAPTOP), server.new_address("coordinator")
        )

    def enter(self, rater: str) -> None:
        """Begin a flow with a rater."""
        self.rater = rater
        self.coordinator.tolerated = LOST  # what the flow before left on its way
        self.coordinator.page.reload()
        self.coordinator.tolerated = None

    def leave(self) -> list[str]:
        """End a flow: leave its session, close its pages -> what went wrong."""
        if not self.server.is_up:
            self.server.start()
            self.coordinator.page.reload()
        self.coordinator.context.set_offline(False)
        self.coordinator.leave()
        visitors = [*self._visitors, self.coordinator]
        problems = [problem for visitor in visitors for problem in visitor.problems]
        for visitor in self._visitors:
            visitor.context.close()
        self._visitors.clear()
        self.coordinator.problems.clear()
        return problems

    def close(self) -> None:
        """Stop the server."""
        self.coordinator.context.close()
        self.server.stop()

    def tablet(self, *, address: str | None = None, **settings: object) -> Rater:
        """Open the rater's page on another tablet."""
        settings = {"viewport": TABLET, "has_touch": True, **settings}
        tablet = Rater(
            self._browser.new_context(**settings),
            address or self.server.new_address("rater"),
        )
        self._visitors.append(tablet)
        return tablet

    def second_coordinator(self, **settings: object) -> Coordinator:
        """Open the coordinator's page in another browser."""
        settings = {"viewport": LAPTOP, **settings}
        second = Coordinator(
            self._browser.new_context(**settings),
            self.server.new_address("coordinator"),
        )
        self._visitors.append(second)
        return second

    def session(self, **settings: object) -> Rater:
        """Start the rater's session -> a tablet that shows it."""
        self.coordinator.start(self.rater)
        return self.tablet(**settings)

    def log(self) -> list[Event]:
        """Return what is in the log of the session."""
        return read_log(self.study.log_file(self.rater, "test"))

    def grades(self) -> list[str]:
        """Return the grades of the study in the log, in order."""
        return [event.fields["grade"] for event in self.log() if event.kind == "grade"]

    def is_complete(self) -> bool:
        """Return whether each presentation has one grade, and the session is over."""
        events = self.log()
        codes = [event.fields["code"] for event in events if event.kind == "grade"]
        n = len(set(codes))
        return len(codes) == n and events[-1].kind == "complete"
