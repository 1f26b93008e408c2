"""The table of ratings and the analysis, held against what they were made from."""

import json
import warnings
from collections.abc import Iterator

from masrel.errors import MasrelError, MasrelWarning
from masrel.protocol import Protocol, StudyPaths
from masrel.verification._finding import Finding, broken, doubt

_SHOWN = 20  # differences of the table that are listed


def output_findings(study: StudyPaths, protocol: Protocol) -> Iterator[Finding]:
    """Yield what is wrong with everything that was made from the logs."""
    # pandas is loaded only when there is such a thing
    has_logs = any(study.sessions.glob("*.jsonl"))
    if study.ratings_file.is_file() and not has_logs:
        yield doubt(study.ratings_file, "no session log stands behind this table")
    elif study.ratings_file.is_file():
        yield from _table_findings(study, protocol)
    if study.analysis_file.is_file():
        yield from _analysis_findings(study, protocol)


def _table_findings(study: StudyPaths, protocol: Protocol) -> Iterator[Finding]:
    from masrel.ratings import ratings_from_logs, table_differences

    path = study.ratings_file
    try:
        ratings = ratings_from_logs(study, protocol)
    except MasrelError as error:
        yield broken(path, f"cannot be held against the logs: {error}")
        return
    differences = list(table_differences(path, ratings))
    for difference in differences[:_SHOWN]:
        yield broken(path, difference)
    if len(differences) > _SHOWN:
        yield broken(path, f"there are {len(differences) - _SHOWN} more differences")


def _analysis_findings(study: StudyPaths, protocol: Protocol) -> Iterator[Finding]:
    from masrel.analysis import analyze, as_analysis_document
    from masrel.ratings import read_study_data

    path = study.analysis_file
    try:
        document = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        document = None
    if not isinstance(document, dict):
        yield broken(path, "needed a JSON object, got none")
        return
    try:
        data = read_study_data(study, protocol)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MasrelWarning)  # of statistics
            analysis = analyze(protocol, data.ratings, in_person=data.in_person)
    except MasrelError as error:
        yield broken(path, f"cannot be computed again: {error}")
        return
    needed = json.loads(json.dumps(as_analysis_document(analysis)))
    if document.get("masrel_version") != needed["masrel_version"]:
        yield doubt(
            path,
            f"is of masrel {document.get('masrel_version')}, this is "
            f"{needed['masrel_version']}: only what it was made from is looked at",
        )
        document, needed = ({"inputs": d.get("inputs")} for d in (document, needed))
    place = _first_difference(document, needed)
    if place is not None:
        yield broken(path, f"{place}, computed again from {data.read}")


def _first_difference(got: object, needed: object, place: str = "") -> str | None:
    # where two documents differ first, in words
    if isinstance(got, dict) and isinstance(needed, dict):
        names = [*needed, *(name for name in got if name not in needed)]
        pairs = [(f"{place}.{n}".lstrip("."), got.get(n), needed.get(n)) for n in names]
    elif isinstance(got, list) and isinstance(needed, list) and len(got) == len(needed):
        both = enumerate(zip(got, needed, strict=True))
        pairs = [(f"{place}[{index}]", *pair) for index, pair in both]
    elif got == needed and type(got) is type(needed):
        return None
    else:
        return f"{place}: got {json.dumps(got):.60}, but {json.dumps(needed):.60}"
    differences = (_first_difference(g, n, p) for p, g, n in pairs)
    return next((difference for difference in differences if difference), None)
