"""What two analyses of a study say differently, number by number.

In: two documents as `as_analysis_document` makes them. Out: every value that differs,
by the name of what it is of, and every input whose hash differs.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from masrel.errors import ParameterError
from masrel.lab._bounded_files import MAX_TABLE, parse_json, read_regular
from masrel.lab.analysis._analysis_json import ANALYSIS_FORMAT

# inputs are compared by themselves; notes say in words what numbers beside them say
_LEFT_OUT = ("format", "inputs", "masrel_version", "notes")
_NAMES = ("id", "questionnaire", "question", "session", "model", "rater", "name",
          "label", "stretch")  # fmt: skip
"""Fields that tell the elements of a list apart."""

_WITHIN = ("estimates", "estimate", "interval")
"""Parts of a place that say nothing beside the name of a line of the plan."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One value that differs; None where an analysis does not have it."""

    of: str  # what it is of, such as a line of the plan
    field: str
    old: str | float | None
    new: str | float | None

    @property
    def difference(self) -> float | None:
        """The new number less the old one, if both are numbers."""
        old, new = self.old, self.new
        if isinstance(old, bool | str) or isinstance(new, bool | str):
            return None
        return None if old is None or new is None else new - old


def read_old_analysis(place: Path, study: str, *, option: str) -> dict[str, Any]:
    """Read the analysis of a report's folder, of a study, or of a file of its own."""
    within = (place / "analysis.json", place / "report" / "analysis.json")
    file = next((p for p in within if p.is_file()), place)
    if file.is_dir() or not file.exists():
        raise ParameterError(
            f"{option}: needs an analysis.json, or a folder that has one, as that of a "
            f"report or a study, got {place}"
        )
    try:
        document = parse_json(read_regular(file, most=MAX_TABLE))
    except ValueError as error:
        raise ParameterError(f"{option}: {file}: is no analysis: {error}") from error
    if not isinstance(document, dict) or not isinstance(document.get("study"), str):
        raise ParameterError(f"{option}: {file}: is no analysis of a study")
    if document.get("format", 1) != ANALYSIS_FORMAT:
        raise ParameterError(
            f"{option}: {file}: needs format {ANALYSIS_FORMAT}, got "
            f"{document['format']!r}"
        )
    if document["study"] != study:
        raise ParameterError(
            f"{option}: needs an analysis of the study {study!r}, {file} is of "
            f"{document['study']!r}"
        )
    return document


def changes_between(
    old: Mapping[str, Any], new: Mapping[str, Any]
) -> tuple[Change, ...]:
    """Return every value that two analyses do not have in common."""
    before, after = dict(_values(old)), dict(_values(new))
    places = [*after, *(place for place in before if place not in after)]
    changes = (
        Change(
            of=" ".join(p for p in place[:-1] if p not in _WITHIN).replace("_", " "),
            field=place[-1].replace("_", " "),
            old=before.get(place),
            new=after.get(place),
        )
        for place in places
        if before.get(place) != after.get(place)
    )
    # once where an estimate repeats what its line of the plan says
    return tuple(dict.fromkeys(changes))


def changed_inputs(old: Mapping[str, Any], new: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a line for each input whose hash differs, and for another masrel."""
    lines = []
    before, after = old.get("inputs") or {}, new.get("inputs") or {}
    for name in dict.fromkeys([*after, *before]):
        if before.get(name) != after.get(name):
            what = name.removesuffix("_sha256").replace("_", " ")
            hashes = (
                str(d[name])[:12] if d.get(name) else "none" for d in (before, after)
            )
            lines.append(f"{what}: SHA-256 {' before, now '.join(hashes)}")
    versions = [str(d.get("masrel_version")) for d in (old, new)]
    if versions[0] != versions[1]:
        lines.append(f"masrel: {' before, now '.join(versions)}")
    return tuple(lines)


def _values(
    value: Any, place: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any]]:
    # every value by its place: names of fields, and of elements of lists
    if isinstance(value, Mapping):
        for name, part in value.items():
            if name not in _LEFT_OUT:
                yield from _values(part, (*place, name))
    elif isinstance(value, list) and any(isinstance(part, Mapping) for part in value):
        met: Counter[str] = Counter()
        for part in value:
            name = " ".join(str(part[k]) for k in _NAMES if part.get(k) is not None)
            met[name] += 1
            which = f"{name} ({met[name]})" if met[name] > 1 else name
            yield from _values(part, (*place, which))
    elif isinstance(value, list):
        yield place, ", ".join(map(str, value))
    else:
        yield place, value
