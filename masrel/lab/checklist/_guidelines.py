"""Checklists of guidelines: what is asked for, what the record says, and their forms.

Kottner et al. (2011), GRRAS: 15 items. Mokkink et al. (2020), COSMIN: six design
standards of studies on reliability, which the author grades and masrel does not.
Topics are in our words; ``templates/facts.txt`` has what the record says to each.
"""

import hashlib
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import masrel
from masrel._files import write_file
from masrel.errors import ParameterError
from masrel.lab._study_files import MAX_TABLE, read_regular
from masrel.lab.checklist._facts import StudyFacts, gather_facts, words_of
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.report._pages import converted

if TYPE_CHECKING:
    from jinja2 import Environment

State = Literal["filled", "in part", "authors"]
"""Who fills an item: the record, both, or the authors alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChecklistItem:
    """One item of a guideline.

    Attributes
    ----------
    number : str
        Its number in the guideline.
    topic : str
        What it asks for, in our words.
    state : {"filled", "in part", "authors"}
        Whether the record of the study answers it.
    facts : tuple of str
        What the record says, one sentence or more each.
    to_add : str
        What the authors have to add; empty where nothing.
    sources : tuple of Path
        The files that say so, from the study's folder.
    """

    number: str
    topic: str
    state: State
    facts: tuple[str, ...] = ()
    to_add: str = ""
    sources: tuple[Path, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Checklist:
    """A guideline with what the record of a study says to each of its items.

    Attributes
    ----------
    guideline : str
        Its short name, of `GUIDELINES`.
    title : str
        Its name.
    reference : str
        Where it is published.
    study : str
        The title of the study.
    items : tuple of ChecklistItem
        In the guideline's order.
    notes : tuple of str
        What a reader must know before the items.
    files : mapping of str to str
        SHA-256 of each file that an item names.
    masrel_version : str
        The version that filled it.
    """

    guideline: str
    title: str
    reference: str
    study: str
    items: tuple[ChecklistItem, ...]
    notes: tuple[str, ...]
    files: Mapping[str, str] = field(hash=False)
    masrel_version: str


_Source = Literal["protocol", "logs", "ratings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Entry:
    """An item, what fills it, and what only the authors know."""

    topic: str
    facts: tuple[str, ...] = ()  # macros of the template; none where nothing is known
    sources: tuple[_Source, ...] = ("protocol",)
    to_add: str = ""  # beside the facts


_GRADE = "Very good, adequate, doubtful or inadequate: the authors grade this."


def _standard(topic: str, *facts: str) -> _Entry:
    sources: tuple[_Source, ...] = ("protocol", "logs")
    return _Entry(topic=topic, facts=facts, sources=sources, to_add=_GRADE)


_GUIDELINES: dict[str, tuple[str, str, tuple[_Entry, ...]]] = {
    "grras": (
        "Guidelines for Reporting Reliability and Agreement Studies (GRRAS)",
        "Kottner et al. 2011, J Clin Epidemiol 64:96-106, "
        "doi 10.1016/j.jclinepi.2010.03.002",
        (
            _Entry(topic="Title or abstract names agreement or reliability"),
            _Entry(
                topic="Device or scale",
                facts=("device",),
                to_add="Why this scale and this device; what is known of both.",
            ),
            _Entry(topic="Subjects: the population that is of interest"),
            _Entry(
                topic="Raters: the population that is of interest",
                facts=("raters", "characteristics"),
                to_add="Whom these raters stand for: profession, experience, training.",
            ),
            _Entry(topic="What is known already, and why this study is needed"),
            _Entry(topic="Planned subjects, raters, replicates", facts=("sizes",)),
            _Entry(
                topic="How subjects and raters were sampled",
                facts=("sampling",),
                to_add="How the raters were recruited, and how the models were chosen.",
            ),
            _Entry(
                topic="The process of measurement and rating",
                facts=("order", "blinding", "stretches", "dates"),
                sources=("protocol", "logs"),
            ),
            _Entry(
                topic="Whether ratings were independent",
                facts=("independence",),
                sources=("logs",),
            ),
            _Entry(topic="Statistical analysis", facts=("analysis",)),
            _Entry(
                topic="Actual numbers",
                facts=("numbers", "remarks"),
                sources=("ratings",),
            ),
            _Entry(
                topic="Characteristics of raters and subjects",
                facts=("subjects", "characteristics"),
                to_add="Characteristics of the raters, as far as the protocol has "
                "none.",
            ),
            _Entry(
                topic="Estimates with their uncertainty",
                facts=("estimates",),
                sources=("ratings",),
            ),
            _Entry(topic="Relevance for practice"),
            _Entry(topic="Detailed results", facts=("details",), sources=("ratings",)),
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

GUIDELINES = tuple(_GUIDELINES)
"""Names of the guidelines."""


def fill_checklist(study: StudyPaths, protocol: Protocol, guideline: str) -> Checklist:
    """Fill the checklist of a reporting guideline from the record of a study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is; it may have no ratings yet.
    protocol : Protocol
        The study's protocol.
    guideline : {"grras", "cosmin"}
        Kottner et al. (2011), 15 items; or the design standards of Mokkink et al.
        (2020), 6 items, to which no grade is given.

    Returns
    -------
    Checklist
        Every item with what the record says of it.

    Raises
    ------
    ParameterError
        If there is no such guideline.
    RatingsError
        If the ratings are damaged, or not what the session logs say.
    SessionLogError
        If a log is damaged.
    ScheduleError
        If a schedule is damaged, or that of a log is missing or stale.

    Examples
    --------
    >>> from pathlib import Path
    >>> from masrel.lab.protocol import StudyPaths, read_protocol
    >>> study = StudyPaths(Path("studies/hess2012"))
    >>> filled = fill_checklist(study, read_protocol(study.protocol), "grras")
    >>> [item.number for item in filled.items if item.state == "filled"]
    ['6', '10', '11', '13', '15']
    """
    if guideline not in _GUIDELINES:
        raise ParameterError(
            f"guideline: needed one of {', '.join(_GUIDELINES)}, got {guideline!r}"
        )
    title, reference, entries = _GUIDELINES[guideline]
    facts = gather_facts(study, protocol)
    say = _environment().overlay(finalize=_in_one_line).get_template("facts.txt")
    macros = say.make_module(words_of(facts, protocol))
    items = tuple(
        _item(facts, str(number), entry, lambda name: str(getattr(macros, name)()))
        for number, entry in enumerate(entries, start=1)
    )
    named = sorted({file for item in items for file in item.sources})
    return Checklist(
        guideline=guideline,
        title=title,
        reference=reference,
        study=protocol.study.title,
        items=items,
        notes=_notes(facts),
        files={
            file.as_posix(): hashlib.sha256(
                read_regular(study.root / file, most=MAX_TABLE)
            ).hexdigest()
            for file in named
        },
        masrel_version=masrel.__version__,
    )


def _item(
    facts: StudyFacts, number: str, entry: _Entry, say: Callable[[str], str]
) -> ChecklistItem:
    to_add, names = entry.to_add, entry.facts
    if "ratings" in entry.sources and facts.ratings is None:
        to_add, names = "There are no ratings yet.", ()
    elif not names:
        to_add = "For the authors to say."
    elif "logs" in entry.sources and not (facts.sessions or to_add):
        to_add = "What no log of a session says."
    if not names:
        return ChecklistItem(
            number=number, topic=entry.topic, state="authors", to_add=to_add
        )
    lines = (line.strip() for name in names for line in say(name).split("\n"))
    return ChecklistItem(
        number=number,
        topic=entry.topic,
        state="in part" if to_add else "filled",
        facts=tuple(line for line in lines if line),
        to_add=to_add,
        sources=tuple(file for key in entry.sources for file in facts.files[key]),
    )


def _in_one_line(value: object) -> object:
    # a line of a template is a fact, whatever a protocol's texts hold
    return " ".join(value.splitlines()) if isinstance(value, str) else value


def _notes(facts: StudyFacts) -> tuple[str, ...]:
    if facts.ratings is None:
        return ("No session has begun: what follows is the plan.",)
    if not facts.ratings.simulated:
        return ()
    if facts.ratings.n_from_persons:
        return ("SIMULATED DEVICE: not all of these grades were given on hardware.",)
    return ("SIMULATED DATA: no person gave these grades.",)


_HEADINGS = ("Item", "Asks for", "State", "What the record says", "Files")

_STATES: dict[State, str] = {
    "filled": "filled from the record",
    "in part": "filled in part",
    "authors": "for the authors alone",
}


def write_checklist(checklist: Checklist, path: Path) -> None:
    """Write a checklist as a file whose form its ending says.

    Parameters
    ----------
    checklist : Checklist
        What `fill_checklist` returned.
    path : Path
        A file that ends in ``.html``, ``.md`` or ``.docx``. The same checklist gives
        the same bytes.

    Raises
    ------
    ParameterError
        If the ending is another, the file is a study's primary record, or pandoc
        is needed and is not installed.
    OSError
        If the file cannot be written.
    """
    if path.suffix not in _FORMS:
        raise ParameterError(
            f"output: needed a file that ends in {', '.join(_FORMS)}, got {path}"
        )
    write_file(path, _FORMS[path.suffix](checklist))


def checklist_markdown(checklist: Checklist) -> str:
    """Return a checklist as Markdown.

    Parameters
    ----------
    checklist : Checklist
        What `fill_checklist` returned.

    Returns
    -------
    str
        A section for each item, then the files with their hashes.
    """
    lines = [f"# {_plain(checklist.study)}", ""]
    lines += [f"{_plain(text)}\n" for text in _introduction(checklist)]
    for item in checklist.items:
        lines += [f"## {item.number}. {_plain(item.topic)}", ""]
        lines += [f"*{_STATES[item.state]}*", ""]
        lines += [f"- {_plain(fact)}" for fact in item.facts]
        lines += [f"- **Authors:** {_plain(item.to_add)}"] * bool(item.to_add)
        lines += ["", f"Files: {names}"] if (names := _numbers(checklist, item)) else []
        lines.append("")
    lines += ["## Files", ""]
    lines += [
        f"{number}. {_plain(file)}: `{digest}`"
        for number, (file, digest) in enumerate(checklist.files.items(), start=1)
    ]
    return "\n".join([*lines, "", f"Made by masrel {checklist.masrel_version}.", ""])


_ESCAPES = str.maketrans({letter: f"\\{letter}" for letter in "\\`*_|<>[]#"})


def _plain(text: str) -> str:
    return " ".join(text.translate(_ESCAPES).split())


def _introduction(checklist: Checklist) -> tuple[str, ...]:
    head = f"{checklist.title}: {checklist.reference}. Topics are in our words."
    return (head, *checklist.notes, _summary(checklist))


def _summary(checklist: Checklist) -> str:
    counts = Counter(item.state for item in checklist.items)
    parts = [f"{counts[state]} {text}" for state, text in _STATES.items()]
    return f"Of {len(checklist.items)} items {', '.join(parts)}."


def _numbers(checklist: Checklist, item: ChecklistItem) -> str:
    # of the files an item names, such as "1, 3-24" where they follow each other
    places = list(checklist.files)
    ranges: list[list[int]] = []
    for number in sorted(places.index(file.as_posix()) + 1 for file in item.sources):
        if ranges and number == ranges[-1][-1] + 1:
            ranges[-1].append(number)
        else:
            ranges.append([number])
    return ", ".join(
        f"{each[0]}–{each[-1]}" if len(each) > 2 else ", ".join(map(str, each))
        for each in ranges
    )


def _environment() -> "Environment":
    # Imported here: what is only imported loads no templates.
    from jinja2 import (
        Environment,
        PackageLoader,
        StrictUndefined,
        select_autoescape,
    )

    return Environment(
        loader=PackageLoader("masrel.lab.checklist"),
        autoescape=select_autoescape(["html"]),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )


def _html(checklist: Checklist) -> str:
    style = files("masrel.pages").joinpath("templates/page.css")
    return (
        _environment()
        .get_template("checklist.html")
        .render(
            list=checklist,
            headings=_HEADINGS,
            summary=_summary(checklist),
            style=style.read_text(encoding="utf-8"),
            files=lambda item: _numbers(checklist, item),
        )
    )


_FORMS: dict[str, Callable[[Checklist], str | bytes]] = {
    ".html": _html,
    ".md": checklist_markdown,
    ".docx": lambda made: converted(checklist_markdown(made), "docx", pictures={}),
}
