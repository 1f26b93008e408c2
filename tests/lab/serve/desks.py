"""A study, the desk of it, and a rater at a page who answers whatever is asked."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, Literal

from masrel.lab.conduct import allot_schedules
from masrel.lab.protocol import StudyPaths, copy_template, read_protocol
from masrel.lab.run import read_log
from masrel.lab.serve._desk import Desk

PATIENCE_S = 60.0

# Half a second each; however late a busy machine is, that shall not end one.
_QUICK = (
    ("start_deg = 30.0", "start_deg = 110.0"),
    ("mean_speed_deg_s = 85.0", "mean_speed_deg_s = 150.0"),
    (
        "missed_ticks_limit = 20\n",
        """
missed_ticks_limit = 100000
jump_limit_deg = 5.0
stale_limit_ms = 50.0
frozen_limit_ms = 100.0
watchdog_ms = 100.0
end_ramp_ms = 20.0
""",
    ),
)

OCCASIONS = """
[occasions]
instructions = "Stretch the arm once."
practice = ["HM1"]
break_after = 2
break_minutes = 0.1

[[questionnaires]]
id = "realism"
title = "How real it felt"
when = "session"

[[questionnaires.questions]]
id = "score"
text = "How real?"
type = "visual-analogue"
"""


def small_study(
    root: Path, added: str = "", *changes: tuple[str, str], quick: bool = False
) -> StudyPaths:
    """Make a study of four models with drawn schedules; a quick one in real time.

    Changes are (old, new) texts of the protocol.
    """
    study = StudyPaths(root)
    copy_template("small", root)
    of_time = _QUICK if quick else ()
    text = study.protocol.read_text()
    for old, new in (('stretches = "free"', "stretches = 1"), *of_time, *changes):
        assert old in text
        text = text.replace(old, new)
    study.protocol.write_text(text + added)
    allot_schedules(study, read_protocol(study.protocol))
    return study


class Page:
    """A rater at a page."""

    def __init__(self, desk: Desk, **answers: Any) -> None:
        self.desk = desk
        self.screens: list[str] = []
        self.answers: dict[str, Any] = {
            "instructions": {"go_on": True},
            "break": {"go_on": True},
            "ready": {"begin": True},
            "grade": {"grade": "2", "stretch": None},
            "question": {"answer": 60},
            "fault": {"again": True},
            **answers,
        }

    async def until(self, *screens: str) -> dict[str, Any]:
        """Answer until one of these screens is shown -> it."""
        while True:
            state = self.desk.state()
            if state["screen"] in screens:
                return state
            if state["ask"] is None:
                await self.desk.changed(state["version"])
            else:
                await self.answer(state)

    async def answer(self, state: dict[str, Any]) -> None:
        """Answer what is asked."""
        self.screens.append(state["screen"])
        await self.desk.answer(state["ask"], self.answers[state["screen"]])


def at(
    study: StudyPaths,
    act: Callable[[Desk], Awaitable[None]],
    clock: Literal["real", "simulated"] = "simulated",
) -> None:
    """Run something at the desk of a study."""

    async def run() -> None:
        desk = Desk(study, clock=clock)
        try:
            await asyncio.wait_for(act(desk), PATIENCE_S)
        finally:
            await desk.close()

    asyncio.run(run())


async def n_sampled(desk: Desk, least: int) -> None:
    """Return when a presentation has so many samples."""
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        if desk.samples is not None and samples_in(desk.samples) >= least:
            return
        await asyncio.sleep(0.002)
    raise AssertionError(f"never {least} samples")


def samples_in(partial: Path) -> int:
    """How many samples a presentation has left so far."""
    try:
        words = partial.read_bytes()[4096:4104]
    except FileNotFoundError:
        return 0
    return int(memoryview(words).cast("d")[0]) if len(words) == 8 else 0


def kinds(study: StudyPaths) -> list[str]:
    """The kinds of events of the first rater's log."""
    return [event.kind for event in read_log(study.log_file("R1", "test"))]
