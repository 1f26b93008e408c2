"""Sheets to print for raters, and the files into which they are typed afterwards."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import masrel
from masrel._files import write_files
from masrel.errors import ParameterError
from masrel.lab._study_files import csv_text
from masrel.lab.paper._form import Form, form_of, has_answers
from masrel.lab.protocol import Protocol, Question, StudyPaths, scale_of
from masrel.lab.run._rehearsal import practice_presentations
from masrel.lab.run.console import _instruction
from masrel.lab.schedule.sheets import _drawn_schedule
from masrel.pages._sections import template_environment
from masrel.scales import published_scale

_MOST_BOXES = 12  # answers of a question that are boxes; for more there is a blank


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperSheets:
    """The files that were made of sheets.

    Attributes
    ----------
    html : Path
        Every sheet, to be printed; each begins on a new page.
    typed : tuple of Path
        For each sheet the file into which it is typed.
    unchanged : tuple of Path
        Those of them in which something has been typed: they stay as they are.
    """

    html: Path
    typed: tuple[Path, ...]
    unchanged: tuple[Path, ...]


def write_sheets(
    study: StudyPaths,
    protocol: Protocol,
    *,
    raters: Sequence[str] = (),
    sessions: Sequence[str] = (),
    sites: Sequence[str] = (),
) -> PaperSheets:
    """Write sheets of drawn schedules to print, and files to type them into.

    Parameters
    ----------
    study : StudyPaths
        Where the study is; its schedules are drawn.
    protocol : Protocol
        The study's protocol.
    raters, sessions, sites : sequence of str, optional
        Whose sheets; all that are drawn unless given.

    Returns
    -------
    PaperSheets
        What was written, in ``sheets/``. No file names a model.

    Raises
    ------
    ParameterError
        If the protocol has no such rater, session or site, or not these together.
    ScheduleError
        If no schedule is drawn, or that of a rater who is named is not, or one is
        damaged or stale.
    OSError
        If the system refuses a folder or file.
    """
    forms = [
        form_of(protocol, _drawn_schedule(study, protocol, rater, session))
        for rater, session in _places(study, protocol, raters, sessions, sites)
    ]
    html = study.sheets / "sheets.html"
    typed = tuple(study.typed_file(form.rater, form.session) for form in forms)
    unchanged = tuple(path for path in typed if path.exists() and has_answers(path))
    texts = {
        path: _typed_text(form)
        for path, form in zip(typed, forms, strict=True)
        if path not in unchanged
    }
    write_files({**texts, html: _page(protocol, forms)}, within=study.root)
    return PaperSheets(html=html, typed=typed, unchanged=unchanged)


def _places(
    study: StudyPaths,
    protocol: Protocol,
    raters: Sequence[str],
    sessions: Sequence[str],
    sites: Sequence[str],
) -> list[tuple[str, str]]:
    # rater and session of each sheet
    site_of = {rater.id: rater.site for rater in protocol.raters}
    known = {
        "rater": (raters, list(site_of)),
        "session": (sessions, [session.id for session in protocol.sessions]),
        "site": (sites, sorted({site for site in site_of.values() if site})),
    }
    for name, (chosen, ids) in known.items():
        for each in chosen:
            if each not in ids:
                raise ParameterError(
                    f"{name}: needed one of {', '.join(ids) or 'none'}, got {each!r}"
                )
    places = [
        (rater, session.id)
        for session in protocol.sessions
        for rater in session.raters
        if (not sessions or session.id in sessions)
        and (not raters or rater in raters)
        and (not sites or site_of[rater] in sites)
    ]
    if not places:
        raise ParameterError(
            "rater: needed a rater of the session and the site, got none in both"
        )
    # those that were not named may be drawn later, or elsewhere
    drawn = [place for place in places if study.schedule_file(*place).exists()]
    return places if raters or not drawn else drawn


def _typed_text(form: Form) -> str:
    """Return a sheet as the text of the file that it is typed into."""
    blank = [""] * (len(form.columns) - 3)
    rows = ((form.id, place, code, *blank) for place, code in form.places)
    return f"# format: 1\n{csv_text([form.columns, *rows])}"


def _boxes(question: Question) -> tuple[str, ...]:
    if question.type == "choice":
        return question.choices
    if question.type != "whole" or question.range is None:
        return ()
    low, high = question.range
    answers = range(low, high + 1)
    return tuple(map(str, answers)) if len(answers) <= _MOST_BOXES else ()


def _page(protocol: Protocol, forms: Sequence[Form]) -> str:
    folder = Path(__file__).with_name("templates")
    environment = template_environment(folder)
    scale = published_scale(scale_of(protocol))
    grades, anchors = protocol.scale.grades, protocol.scale.anchors
    texts = anchors or (scale.meanings if scale else {})
    return environment.get_template("sheet.html").render(
        version=masrel.__version__,
        style=(folder / "sheet.css").read_text(encoding="utf-8"),
        title=protocol.study.title,
        study=protocol.study.id,
        instructions=[p for p in protocol.occasions.instructions.split("\n\n") if p],
        scale=scale,
        scale_name=protocol.scale.name,
        meanings=[(grade, texts[grade]) for grade in grades if grade in texts],
        anchors=anchors,
        grades=grades,
        how=_instruction(protocol.presentation, on_paper=True),
        practice=[shown.code for shown in practice_presentations(protocol)],
        boxes_of=_boxes,
        of_presentation=forms[0].questions["presentation"],
        sheets=[
            {
                "form": form,
                "rows": _rows(protocol, form),
                "afterwards": [
                    (f"After the {when}", form.questions[when])
                    for when in form.afterwards
                ],
            }
            for form in forms
        ],
    )


def _rows(protocol: Protocol, form: Form) -> list[dict[str, object]]:
    # position, code, and what comes after the presentation
    after, n_presentations = protocol.occasions.break_after, len(form.codes)
    breaks = range(after, n_presentations, after) if after is not None else ()
    pause = f"Break of {protocol.occasions.break_minutes:g} min"
    return [
        {"position": at, "code": code, "pause": pause if at in breaks else None}
        for at, code in enumerate(form.codes, start=1)
    ]
