"""The guidelines by name, and a checklist filled from a study."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import masrel
from masrel.errors import ParameterError
from masrel.lab._bounded_files import MAX_TABLE, read_regular
from masrel.lab.checklist._facts import StudyFacts, gather_facts
from masrel.lab.checklist._guidelines import ChecklistItem, cosmin_items, grras_items
from masrel.lab.protocol import Protocol, StudyPaths

_Items = Callable[[StudyFacts], tuple[ChecklistItem, ...]]

_GUIDELINES: dict[str, tuple[str, str, _Items]] = {
    "grras": (
        "Guidelines for Reporting Reliability and Agreement Studies (GRRAS)",
        "Kottner et al. 2011, J Clin Epidemiol 64:96-106, "
        "doi 10.1016/j.jclinepi.2010.03.002",
        grras_items,
    ),
    "cosmin": (
        "COSMIN Risk of Bias tool: studies on reliability",
        "Mokkink et al. 2020, BMC Med Res Methodol 20:293, "
        "doi 10.1186/s12874-020-01179-5",
        cosmin_items,
    ),
}

GUIDELINES = tuple(_GUIDELINES)
"""Names of the guidelines."""


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
    title, reference, items_of = _GUIDELINES[guideline]
    facts = gather_facts(study, protocol)
    items = items_of(facts)
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


def _notes(facts: StudyFacts) -> tuple[str, ...]:
    if facts.ratings is None:
        return ("No session has begun: what follows is the plan.",)
    if not facts.ratings.simulated:
        return ()
    if facts.ratings.n_from_persons:
        return ("SIMULATED DEVICE: not all of these grades were given on hardware.",)
    return ("SIMULATED DATA: no person gave these grades.",)
