"""Checklists of reporting guidelines, filled from the record of a study.

In: a study. Out: the items of a guideline, each with what masrel knows of it and the
files that say so; what only the authors know is left to them.

Kottner et al. (2011), GRRAS: 15 items. Mokkink et al. (2020), COSMIN: six design
standards of studies on reliability, which the author grades and masrel does not.
Topics are in our words; what the record says is in ``report/templates/facts.txt``.
"""

import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Literal

import masrel
from masrel._files import write_file
from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab._study_files import MAX_TABLE, read_regular, sha256_of
from masrel.lab.analysis import Analysis, analyze
from masrel.lab.conduct._plan_versions import plan_changes, plan_versions
from masrel.lab.progress import (
    RaterProgress,
    SessionProgress,
    rater_progress,
    session_progress,
)
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import Ratings, corrections_of, read_study_data, study_remarks
from masrel.lab.report._design import size_sentence
from masrel.lab.report._material import TARGETS, coefficient_name, lines_of, macros
from masrel.lab.report._pages import TEMPLATES, as_markdown, converted
from masrel.lab.run._state import read_session
from masrel.lab.schedule._orders import orders_in_words
from masrel.lab.schedule.presentation import _read_drawn
from masrel.pages._sections import template_environment
from masrel.tables._estimate_words import sentence
from masrel.tables._tables import number

__all__ = ["checklist_markdown", "fill_checklist", "write_checklist"]

# What must be the same for like conditions: fields of a log's head, and their names
_CONDITIONS = {
    "device": "Device",
    "grades": "Grades from",
    "clock": "Clock of the device",
    "masrel_version": "Version of masrel",
    "presented_sha256": "SHA-256 of what is presented",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _StudyFacts:
    """What the record of a study says."""

    # None before there are ratings
    ratings: Ratings | None
    analysis: Analysis | None
    sessions: tuple[SessionProgress, ...]
    # of sessions that have begun: the days, UTC, and heads by the keys of `_CONDITIONS`
    days: Sequence[date]
    heads: Sequence[Mapping[str, str]]
    days_between: Sequence[int]  # of a rater's session and the one before, sorted
    n_corrections: int
    remarks: tuple[str, ...]
    raters: tuple[RaterProgress, ...]
    frozen: Sequence[object]  # events which kept the plan, that of the first draw first
    changes: Sequence[object]  # of the plan
    n_schedules: int  # drawn
    n_concealed: int  # of these, those drawn from a secret that is not published
    files: Mapping[str, Sequence[Path]]  # by what they are, from the study's folder


def _gather_facts(paths: StudyPaths, protocol: Protocol) -> _StudyFacts:
    """Read everything of a study that a guideline asks for, for a template."""
    ratings = analysis = None
    tables = [f for f in (paths.ratings_file, paths.published_file) if f.is_file()]
    if paths.logs() or tables:
        data = read_study_data(paths, protocol)
        ratings = data.ratings
        analysis = analyze(
            protocol, ratings, in_person=data.in_person, excluded=data.excluded
        )
    pairs = protocol.rater_sessions
    drawn = [schedule for _, schedule in _read_drawn(paths, pairs)]
    is_published = paths.published_secret_file.is_file()
    begun = [
        (rater, log, *read_session(log))
        for rater, session in pairs
        if (log := paths.log_file(rater, session)).is_file()
    ]
    begun = [each for each in begun if each[3].header]
    days: dict[str, list[date]] = {}
    for rater, _, events, _ in begun:
        day = date.fromisoformat(events[0].time_utc[:10])
        days.setdefault(rater, []).append(day)
    sessions = session_progress(paths, protocol)
    named = {
        "protocol": [paths.protocol],
        "conduct": paths.conduct_logs(),
        "logs": [log for _, log, _, _ in begun],
        "ratings": tables[:1],
    }
    return _StudyFacts(
        ratings=ratings,
        analysis=analysis,
        sessions=sessions,
        days=[day for of_rater in days.values() for day in of_rater],
        heads=[
            {name: str(state.header.get(name)) for name in _CONDITIONS}
            for _, _, _, state in begun
        ],
        days_between=sorted(
            (after - before).days
            for of_rater in days.values()
            for before, after in pairwise(sorted(of_rater))
        ),
        n_corrections=len(corrections_of(paths, protocol)),
        remarks=study_remarks(paths, protocol, include=()),
        raters=rater_progress(paths, protocol, sessions),
        frozen=[event for _, event in plan_versions(paths)],
        changes=plan_changes(paths, protocol),
        n_schedules=len(drawn),
        n_concealed=sum(s.commitment is not None for s in drawn) * (not is_published),
        files={
            key: [file.relative_to(paths.root) for file in files]
            for key, files in named.items()
        },
    )


def _words_of(facts: _StudyFacts, protocol: Protocol) -> dict[str, object]:
    """Return what a template says facts with."""
    orders = "an order of their own, all orders equally likely"
    if protocol.schedule.scheme != "random-order":
        orders = orders_in_words(protocol.schedule)
    fields = protocol.rater_fields.items()
    return {
        "facts": facts,
        "protocol": protocol,
        "orders": orders,
        "not_public": listed(f.title or name for name, f in fields if not f.public),
        "names_of_conditions": _CONDITIONS,
        "targets": TARGETS,
        "tally": _tally,
        "range_of": _range_of,
        "sentence": sentence,
        "size_sentence": size_sentence,
        "coefficient_name": coefficient_name,
    }


def _tally(values: Iterable[object], form: str) -> list[str]:
    """Return each value with how often it comes, in the order of first coming."""
    return [form.format(value, n) for value, n in Counter(map(str, values)).items()]


def _range_of(values: Sequence[float], unit: str) -> str:
    if not values:
        return "not known"
    ends = f"{number(min(values), None)} to {number(max(values), None)} {unit}"
    return f"{ends.strip()}, median {number(statistics.median(values), None)}"


# Who fills an item: the record, both, or the authors alone
_State = Literal["filled", "in part", "authors"]


_Source = Literal["protocol", "conduct", "logs", "ratings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Item:
    """One item of a guideline, as it is asked for and once it is filled."""

    topic: str  # what it asks for, in our words
    # macros of the template, none where nothing is known; then what they say
    facts: tuple[str, ...] = ()
    sources: tuple[_Source, ...] = ("protocol",)  # what the facts are from
    to_add: str = ""  # what the authors have to add
    number: str = ""  # in the guideline
    state: _State = "authors"
    files: tuple[Path, ...] = ()  # that say so, from the study's folder


@dataclass(frozen=True, slots=True, kw_only=True)
class _Checklist:
    """A guideline with what the record of a study says to each of its items."""

    guideline: str
    title: str
    reference: str  # where it is published
    study: str  # its title
    items: tuple[_Item, ...]
    notes: tuple[str, ...]  # what a reader must know before the items
    files: Mapping[str, str] = field(hash=False)  # SHA-256 of each that an item names
    masrel_version: str


_GRADE = "The authors rate this as very good, adequate, doubtful or inadequate."


def _standard(topic: str, *facts: str) -> _Item:
    return _Item(topic=topic, facts=facts, sources=("protocol", "logs"), to_add=_GRADE)


_GUIDELINES: dict[str, tuple[str, str, tuple[_Item, ...]]] = {
    "grras": (
        "Guidelines for Reporting Reliability and Agreement Studies (GRRAS)",
        "Kottner et al. 2011, J Clin Epidemiol 64:96-106, "
        "doi 10.1016/j.jclinepi.2010.03.002",
        (
            _Item(topic="Title or abstract names agreement or reliability"),
            _Item(
                topic="Device or scale",
                facts=("device",),
                to_add="Why this scale and this device; what is known about both.",
            ),
            _Item(topic="Subjects: the population that is of interest"),
            _Item(
                topic="Raters: the population that is of interest",
                facts=("raters", "characteristics"),
                to_add="Whom these raters represent: profession, experience, training.",
            ),
            _Item(topic="What is known already, and why this study is needed"),
            _Item(topic="Planned subjects, raters, replicates", facts=("sizes",)),
            _Item(
                topic="How subjects and raters were sampled",
                facts=("sampling",),
                to_add="How the raters were recruited, and how the models were chosen.",
            ),
            _Item(
                topic="The process of measurement and rating",
                facts=("order", "blinding", "stretches", "dates"),
                sources=("protocol", "logs"),
            ),
            _Item(
                topic="Whether ratings were independent",
                facts=("independence",),
                sources=("logs",),
            ),
            _Item(
                topic="Statistical analysis",
                facts=("analysis", "plan"),
                sources=("protocol", "conduct"),
            ),
            _Item(
                topic="Actual numbers",
                facts=("numbers", "remarks"),
                sources=("ratings",),
            ),
            _Item(
                topic="Characteristics of raters and subjects",
                facts=("subjects", "characteristics"),
                to_add="Characteristics of the raters that the protocol does not have.",
            ),
            _Item(
                topic="Estimates with their uncertainty",
                facts=("estimates",),
                sources=("ratings",),
            ),
            _Item(topic="Relevance for practice"),
            _Item(topic="Detailed results", facts=("details",), sources=("ratings",)),
        ),
    ),
    "cosmin": (
        "COSMIN Risk of Bias tool: studies on reliability",
        "Mokkink et al. 2020, BMC Med Res Methodol 20:293, "
        "doi 10.1186/s12874-020-01179-5",
        (
            _standard("Patients were stable between the measurements", "stability"),
            _standard("The time between the measurements was appropriate", "dates"),
            _standard("The conditions of the measurements were similar", "conditions"),
            _standard(
                "Measurements were made without knowledge of other scores",
                "order",
                "independence",
            ),
            _standard(
                "Scores were given without knowledge of other scores", "blinding"
            ),
            _standard(
                "No other important flaws in design or conduct", "flaws", "remarks"
            ),
        ),
    ),
}


def fill_checklist(study: StudyPaths, protocol: Protocol, guideline: str) -> _Checklist:
    """Fill the checklist of a reporting guideline from the record of a study.

    Before there are ratings, it states what is known of the plan. A damaged record is
    refused.
    """
    if guideline not in _GUIDELINES:
        raise ParameterError(
            f"guideline: needed one of {', '.join(_GUIDELINES)}, got {guideline!r}"
        )
    title, reference, asked_for = _GUIDELINES[guideline]
    facts = _gather_facts(study, protocol)
    say = macros("facts.txt", _words_of(facts, protocol))
    items = tuple(
        _filled(facts, str(number), item, lambda name: lines_of(getattr(say, name)()))
        for number, item in enumerate(asked_for, start=1)
    )
    named = sorted({file for item in items for file in item.files})
    return _Checklist(
        guideline=guideline,
        title=title,
        reference=reference,
        study=protocol.study.title,
        items=items,
        notes=_notes(facts),
        files={
            file.as_posix(): sha256_of(read_regular(study.root / file, most=MAX_TABLE))
            for file in named
        },
        masrel_version=masrel.__version__,
    )


def _filled(
    facts: _StudyFacts, number: str, item: _Item, say: Callable[[str], list[str]]
) -> _Item:
    to_add, names = item.to_add, item.facts
    if "ratings" in item.sources and facts.ratings is None:
        to_add, names = "There are no ratings yet.", ()
    elif not names:
        to_add = "To be stated by the authors."
    elif "logs" in item.sources and not (facts.days or to_add):
        to_add = "What the session logs do not record."
    item = replace(item, number=number, facts=(), to_add=to_add)
    if not names:
        return item
    return replace(
        item,
        state="in part" if to_add else "filled",
        facts=tuple(line for name in names for line in say(name)),
        files=tuple(file for key in item.sources for file in facts.files[key]),
    )


def _notes(facts: _StudyFacts) -> tuple[str, ...]:
    if facts.ratings is None:
        return ("No session has begun yet; this is the plan.",)
    counts = facts.ratings.simulated_counts
    return (counts,) if counts else ()


_STATES: dict[_State, str] = {
    "filled": "filled from the record",
    "in part": "filled in part",
    "authors": "for the authors alone",
}


def write_checklist(checklist: _Checklist, path: Path) -> None:
    """Write a checklist as .html, .md or .docx; the same one gives the same bytes."""
    if path.suffix not in _FORMS:
        raise ParameterError(
            f"output: needed a file that ends in {', '.join(_FORMS)}, got {path}"
        )
    write_file(path, _FORMS[path.suffix](checklist))


def checklist_markdown(checklist: _Checklist) -> str:
    """Return a checklist as Markdown: a section an item, then files with hashes."""
    return _rendered(checklist, "md")


def _rendered(checklist: _Checklist, form: str) -> str:
    environment = template_environment(TEMPLATES)
    environment.filters["md"] = as_markdown
    counts = Counter(item.state for item in checklist.items)
    of_states = ", ".join(f"{counts[state]} {text}" for state, text in _STATES.items())
    return environment.get_template(f"checklist.{form}").render(
        list=checklist,
        states=_STATES,
        summary=f"Of {len(checklist.items)} items {of_states}.",
        style=files("masrel.pages").joinpath("templates/page.css").read_text("utf-8"),
        files=lambda item: _numbers(checklist, item),
    )


def _numbers(checklist: _Checklist, item: _Item) -> str:
    # of the files an item names, such as "1, 3-24" where they follow each other
    places = list(checklist.files)
    ranges: list[list[int]] = []
    for place in sorted(places.index(file.as_posix()) + 1 for file in item.files):
        if ranges and place == ranges[-1][-1] + 1:
            ranges[-1].append(place)
        else:
            ranges.append([place])
    return ", ".join(
        f"{each[0]}–{each[-1]}" if len(each) > 2 else ", ".join(map(str, each))
        for each in ranges
    )


_FORMS: dict[str, Callable[[_Checklist], str | bytes]] = {
    ".html": lambda made: _rendered(made, "html"),
    ".md": checklist_markdown,
    ".docx": lambda made: converted(checklist_markdown(made), "docx", pictures={}),
}
