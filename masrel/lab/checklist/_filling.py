"""The guidelines by name, and a checklist filled from a study."""

import hashlib
from collections.abc import Callable

import masrel
from masrel.errors import ParameterError
from masrel.lab._bounded_files import MAX_TABLE, read_regular
from masrel.lab.checklist._cosmin import cosmin_items
from masrel.lab.checklist._facts import StudyFacts, gather_facts
from masrel.lab.checklist._grras import grras_items
from masrel.lab.checklist._items import Checklist, ChecklistItem
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
