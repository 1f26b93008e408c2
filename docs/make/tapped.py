"""The pages of a study with nobody at them: what raters would tap is sent to them.

``python -m docs.make.tapped STUDY SESSION RATER=GRADE,GRADE…`` takes the place of
``masrel serve STUDY`` and of whoever sits at its pages, for one session each.
"""

import asyncio
import sys
from pathlib import Path
from typing import Any

from masrel.lab.protocol import StudyPaths
from tests.lab.serve.pages import ANSWERS, SessionManager, Tablet, with_tablets

ANSWER = 8  # to whatever is asked


def graded(root: Path, session: str, grades: dict[str, list[str]]) -> None:
    """Have raters grade a session each, one after the other, at the pages."""

    async def act(_: SessionManager, desk: Tablet, *tablets: Tablet) -> None:
        for (rater, script), tablet in zip(grades.items(), tablets, strict=True):
            await desk.done("start", rater=rater, session=session)
            while (state := await tablet.state())["screen"] != "over":
                if state["ask"] is None:
                    await asyncio.sleep(0.05)
                else:
                    await tablet.answer(state, **_answer(state, script))

    with_tablets(StudyPaths(root), act, *grades, coordinated=True)


def _answer(state: dict[str, Any], script: list[str]) -> dict[str, Any]:
    if state["screen"] == "question":
        return {"answer": ANSWER}
    if state["screen"] == "grade" and not state["practice"]:
        return {"grade": script[state["position"] - 1], "stretch": None}
    return dict(ANSWERS[state["screen"]])


if __name__ == "__main__":
    study, its_session, *given = sys.argv[1:]
    pairs = (each.split("=") for each in given)
    graded(Path(study), its_session, {r: of.split(",") for r, of in pairs})
