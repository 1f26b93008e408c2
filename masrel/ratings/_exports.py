"""Exports of annotation tools as long tables, one row a rating.

Each tool has a function from its records to `_Ratings`: who gave which item which
category. Only categories of whole documents are read; several of them at once, spans
and relations are refused.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from masrel.errors import ParameterError, RatingsError


@dataclass(frozen=True, slots=True, kw_only=True)
class Export:
    """The ratings of an export, and what was read of it."""

    frame: pd.DataFrame  # columns item, rater, the grade, and text where it has any
    facts: dict[str, Any]
    dropped: dict[str, int]  # why annotations are left out, and how many


@dataclass(slots=True)
class _Ratings:
    """What is collected from the records of an export."""

    name: str  # of the file, for messages
    chosen: str | None  # the field that the caller takes for the grade
    rows: list[tuple[Any, Any, Any, Any]] = field(default_factory=list)
    dropped: Counter[str] = field(default_factory=Counter)

    def error(self, message: str) -> RatingsError:
        return RatingsError(f"{self.name}: {message}")

    def add(self, item: Any, rater: Any, grade: Any, text: Any) -> None:
        where = f"annotation {len(self.rows) + 1}" if item is None else f"item {item}"
        for role, value in (("item", item), ("annotator", rater)):
            if value is None or value == "":
                raise self.error(f"{where}: needed its {role}, got none")
        labels = grade if isinstance(grade, list) else [grade]
        if any(isinstance(label, dict | list) for label in labels):
            raise self.error(
                f"{where}: needed a category of the whole, got {str(grade)[:60]}; "
                "spans, regions and relations are not read"
            )
        if len(labels) > 1:
            raise self.error(
                f"{where}: needed one category of each annotator, {rater} gave "
                f"{len(labels)}: {', '.join(map(str, labels))[:60]}; annotations with "
                "several labels are not read"
            )
        grade = labels[0] if labels else None
        self.rows.append((item, rater, grade, text))

    def choose(self, fields: Iterable[str], what: str) -> str:
        """Return the field that is the grade: the one there is, or that is named."""
        names = list(dict.fromkeys(fields))
        listed = ", ".join(names) or "none"
        if self.chosen is None and len(names) == 1:
            return names[0]
        if self.chosen is None and not names:
            raise self.error(
                f"needed {what}, got none; spans, regions and relations are not read"
            )
        if self.chosen is None:
            raise self.error(f"needs --grade with one of its {what}, {listed}")
        if self.chosen not in names:
            raise self.error(
                f"--grade: needed one of its {what}, {listed}, got {self.chosen!r}"
            )
        return self.chosen


def read_export(
    name: str, source: str, files: list[tuple[str, list[Any]]], grade: str | None
) -> Export:
    """Read the export of a tool: the values of its files, each by the file's name."""
    if source not in _TOOLS:
        raise ParameterError(f"--from: needed {', '.join(_TOOLS)}, got {source!r}")
    ratings = _Ratings(name, grade)
    records = [(who, value) for who, values in files for value in values]
    if not records or not all(isinstance(value, dict) for _, value in records):
        raise ratings.error(f"needed the records of {source}, got no list of objects")
    try:
        of = _TOOLS[source](ratings, records)
    except (TypeError, AttributeError, KeyError, StopIteration) as error:
        raise ratings.error(
            f"is no export of {source}, or damaged: a record after "
            f"{len(ratings.rows)} annotations has another shape ({error})"
        ) from error
    if not ratings.rows:
        raise ratings.error(f"needed ratings of {of}, got none")
    frame = pd.DataFrame(
        ratings.rows, columns=["item", "rater", "grade", "text"], dtype=object
    )
    if frame["text"].isna().all() or grade == "text":
        frame = frame.drop(columns="text")
    if grade in ("item", "rater"):
        raise ratings.error(f"--grade: a field cannot be called {grade!r} here")
    return Export(
        frame=frame.rename(columns={"grade": grade or "grade"}),
        facts={"format": f"{source} export", "field": of},
        dropped=dict(ratings.dropped),
    )


_Records = list[tuple[str, dict[str, Any]]]  # name of the file, or "", and a record

# Label Studio's results that are categories of a whole task, and the key of the value.
_CATEGORIES = {
    "choices": "choices",
    "rating": "rating",
    "number": "number",
    "taxonomy": "taxonomy",
    "pairwise": "selected",
}
# What its JSON-MIN has beside the task's data and the results.
_ABOUT = ("id", "annotator", "annotation_id", "created_at", "updated_at", "lead_time")


def _label_studio(ratings: _Ratings, records: _Records) -> str:
    if all("annotator" in task and "annotations" not in task for _, task in records):
        return _label_studio_min(ratings, records)
    annotations = [  # task, annotation
        (task, annotation)
        for _, task in records
        for annotation in task.get("annotations") or task.get("completions") or ()
        if isinstance(annotation, dict)
    ]
    if not annotations:
        raise ratings.error("needed tasks with annotations: the JSON export, got none")
    of = ratings.choose(
        (field for _, annotation in annotations for field in _categories(annotation)),
        "fields of categories",
    )
    for task, annotation in annotations:
        if annotation.get("was_cancelled") or annotation.get("skipped"):
            ratings.dropped["skipped"] += 1
            continue
        who = annotation.get("completed_by")
        if isinstance(who, dict):
            who = who.get("email") or who.get("id")
        grades = _categories(annotation).get(of)
        ratings.add(task.get("id"), who, grades, _text_of(task.get("data")))
    return of


def _categories(annotation: dict[str, Any]) -> dict[str, list[Any]]:
    # of the whole task by field; beside those of a region stands its place
    grades: dict[str, list[Any]] = {}
    for result in annotation.get("result") or ():
        value, key = result.get("value"), _CATEGORIES.get(str(result.get("type")))
        if isinstance(value, dict) and key is not None and set(value) == {key}:
            of = grades.setdefault(str(result.get("from_name")), [])
            of += _grades_of(key, value[key])
    return grades


def _grades_of(key: str, value: Any) -> list[Any]:
    if key == "taxonomy":  # paths from the root
        return ["/".join(map(str, p)) if isinstance(p, list) else p for p in value]
    return value if isinstance(value, list) else [value]


def _text_of(data: object) -> Any:
    # what was annotated, where there is no doubt which of the data that is
    if not isinstance(data, dict):
        return None
    text = data.get("text", next(iter(data.values())) if len(data) == 1 else None)
    return None if isinstance(text, dict | list) else text


def _label_studio_min(ratings: _Ratings, records: _Records) -> str:
    # one object an annotation, its data and its results side by side
    fields = (key for _, task in records for key in task if key not in _ABOUT)
    of = ratings.choose(fields, "fields")
    for _, task in records:
        grade = task.get(of)
        if isinstance(grade, list) and len(grade) == 1:
            grade = grade[0]
        for key in _CATEGORIES.values():
            if isinstance(grade, dict) and set(grade) == {key}:
                grade = _grades_of(key, grade[key])
        ratings.add(task.get("id"), task.get("annotator"), grade, task.get("text"))
    return of


def _doccano(ratings: _Ratings, records: _Records) -> str:
    of = ratings.choose(
        (
            key
            for _, example in records
            for key in ("label", "labels", "cats", "annotations")
            if key in example
        ),
        "labels of whole examples",
    )
    for who, example in records:
        grades: dict[Any, list[Any]] = {}
        labels = example.get(of)
        if of == "annotations":  # old exports: labels and users by their numbers
            for label in labels or ():
                grade = label if "start_offset" in label else label.get("label")
                grades.setdefault(label.get("user"), []).append(grade)
        else:
            rater = example.get("username", example.get("user", who or None))
            if rater is None:
                raise ratings.error(
                    "needed to know who gave the labels, got one file without it: "
                    "doccano writes one for each annotator, in a zip, unless a "
                    "project's annotations are shared"
                )
            grades[rater] = labels if isinstance(labels, list) else [labels]
        for rater, labels in grades.items():
            text = example.get("text", example.get("filename"))
            ratings.add(example.get("id"), rater, labels, text)
    return of


def _prodigy(ratings: _Ratings, records: _Records) -> str:
    is_choice = any("accept" in task for _, task in records)
    labels = dict.fromkeys(
        str(task["label"])
        for _, task in records
        if not is_choice and task.get("label") is not None
    )
    if is_choice:
        of = ratings.choose(["accept"], "fields")
    elif labels:  # the answer is to a label: several labels are several questions
        of = ratings.choose(labels, "labels")
    else:
        of = ratings.choose(["answer"], "fields")
    for who, task in records:
        answer = task.get("answer")
        if answer == "ignore" or (is_choice and answer != "accept"):
            ratings.dropped[f"answered {answer or 'nothing'}"] += 1
            continue
        if labels and task.get("label") != of:
            ratings.dropped["of other labels"] += 1
            continue
        regions = task.get("spans") or task.get("relations")
        grade = task.get("accept", []) if is_choice else answer
        if regions and not is_choice and not labels:
            grade = regions[0]
        rater = task.get("_annotator_id") or task.get("_session_id") or who
        ratings.add(task.get("_input_hash"), rater, grade, task.get("text"))
    return of


def _inception(ratings: _Ratings, records: _Records) -> str:
    columns = {key for _, row in records for key in row}
    if not {"doc", "user"} <= columns:
        raise ratings.error(
            "needed doc, user and label: the CSV or JSON export of the agreement page, "
            f"got {', '.join(sorted(map(str, columns)))[:60]}"
        )
    if columns - {"doc", "user", "label"}:
        raise ratings.error(
            "needed labels of documents, got those of a layer of spans, relations or "
            f"chains ({', '.join(sorted(map(str, columns - {'doc', 'user'})))})"
        )
    of = ratings.choose(["label"] if "label" in columns else [], "labels of a feature")
    grades: dict[tuple[Any, Any], list[Any]] = {}
    for _, row in records:
        document, rater = row.get("doc"), row.get("user")
        if rater in ("CURATION_USER", "INITIAL_CAS"):
            ratings.dropped["of the curator or the source"] += 1
        else:
            grades.setdefault((document, rater), []).append(row.get("label"))
    for (document, rater), labels in grades.items():
        ratings.add(document, rater, labels, None)
    return of


_TOOLS: dict[str, Callable[[_Ratings, _Records], str]] = {
    "label-studio": _label_studio,
    "doccano": _doccano,
    "prodigy": _prodigy,
    "inception": _inception,
}
