"""A served study with a coordinator at work, on which flows are played.

On the real clock, with hands that are quick.
"""

import tomllib
from pathlib import Path
from typing import Any

import tomli_w
from playwright.sync_api import Browser

from masrel.lab._event_log import Event, read_log
from masrel.lab.conduct import allot_schedules
from masrel.lab.protocol import StudyPaths, copy_template, read_protocol
from tests.lab.serve.browser.visitors import LOST, Coordinator, Rater, Visitor
from tests.lab.serve.terminal import Server

TABLET = {"width": 820, "height": 1180}
LAPTOP = {"width": 1366, "height": 768}


# A busy machine is late, which is no fault of the pages.
PATIENT = {
    "jump_limit_deg": 5.0,
    "missed_ticks_limit": 100_000,
    "missed_replies_limit": 20,
    "missed_replies_per_100_limit": 100,
    "stale_limit_ms": 50.0,
    "watchdog_ms": 100.0,
    "torque_rate_limit_nm_s": 100_000.0,
    "end_ramp_ms": 20.0,
}
QUICK = {"mean_speed_deg_s": 150.0, "speed_sd_deg_s": 0.0}

OCCASIONS = {
    "instructions": "Stretch the arm once, as fast as you would a patient's.",
    "practice": ["HM1"],
    "break_after": 2,
    "break_minutes": 0.5,
}
REALISM = {
    "id": "realism",
    "title": "How real it felt",
    "when": "session",
    "questions": [
        {
            "id": "score",
            "text": "How real was it?",
            "type": "visual-analogue",
            "low_label": "not at all",
            "high_label": "as a patient",
        },
        {
            "id": "years",
            "text": "How many years have you worked with patients?",
            "type": "whole",
            "low": 0,
            "high": 60,
        },
        {
            "id": "hand",
            "text": "Which hand did you use?",
            "type": "choice",
            "choices": ["right", "left", "both"],
        },
        {
            "id": "remark",
            "text": "What else did you notice?",
            "type": "text",
            "required": False,
        },
    ],
}


def make_study(
    root: Path,
    *,
    template: str = "small",
    n_raters: int = 2,
    n_models: int | None = None,
    **changes: Any,
) -> StudyPaths:
    """Write a study whose schedules are drawn; `changes` are tables of its protocol."""
    paths = StudyPaths(root)
    copy_template(template, root)
    protocol = tomllib.loads(paths.protocol.read_text(encoding="utf-8"))
    protocol["models"] = protocol["models"][:n_models]
    raters = [f"R{number}" for number in range(1, 1 + n_raters)]
    protocol["raters"] = [{"id": rater} for rater in raters]
    protocol["sessions"] = [{"id": "test", "raters": raters}]
    protocol["analysis"]["estimates"] = [
        line
        for line in protocol["analysis"]["estimates"]
        if line["kind"] == "inter-rater" and line["interval"] != "posterior"
    ]
    protocol["device"] |= PATIENT
    protocol["simulated_raters"] |= QUICK
    protocol["stretch"] = {"start_deg": 120.0, "end_deg": 146.0}
    protocol["presentation"] = {"stretches": 1}
    for name, table in changes.items():
        kept = protocol.get(name)
        is_table = isinstance(table, dict) and isinstance(kept, dict)
        protocol[name] = {**kept, **table} if is_table else table
    paths.protocol.write_text(tomli_w.dumps(protocol), encoding="utf-8")
    allot_schedules(paths, read_protocol(paths.protocol))
    return paths


class Stage:
    """One study, its server, its coordinator; and the rater of the flow.

    Attributes
    ----------
    rater : str
        Whose session the flow is about.
    """

    def __init__(self, browser: Browser, study: StudyPaths) -> None:
        self._browser = browser
        self.study, self.server = study, Server(study.root)
        self.rater = "R1"
        self._visitors: list[Visitor] = []
        self.coordinator = Coordinator(
            browser.new_context(viewport=LAPTOP),
            self.server.new_address("coordinator"),
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
        self.server.end()

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

    def start_again(self) -> None:
        """Start the server as before, and go on with the session."""
        self.server.start()
        self.coordinator.page.reload()
        self.coordinator.start(self.rater)

    def log(self) -> list[Event]:
        """Return what is in the log of the session."""
        return read_log(self.study.log_file(self.rater, "test"))

    def kinds(self) -> list[str]:
        """Return the kinds of its events."""
        return [event.kind for event in self.log()]

    def grades(self) -> list[str]:
        """Return the grades of the study in the log, in order."""
        return [event.fields["grade"] for event in self.log() if event.kind == "grade"]

    def is_complete(self) -> bool:
        """Return whether each presentation has one grade, and the session is over."""
        events = self.log()
        codes = [event.fields["code"] for event in events if event.kind == "grade"]
        n = len(set(codes))
        return len(codes) == n and events[-1].kind == "complete"
