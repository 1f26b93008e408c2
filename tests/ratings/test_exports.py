"""Exports of annotation tools: who gave which item which label, or what is refused."""

import io
import json
import re
import zipfile
from pathlib import Path
from typing import Any

import pytest

from masrel.errors import MasrelError
from masrel.ratings import Reading, read_ratings
from tests.ratings.by_hand import grades


def lines(*rows: dict[str, Any]) -> str:
    return "".join(json.dumps(row) + "\n" for row in rows)


def archive(**files: str) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as packed:
        for name, text in files.items():
            packed.writestr(name.replace("__jsonl", ".jsonl"), text)
    return data.getvalue()


# ---- records as the tools write them ----


def choice(field: str, *labels: str, **region: int) -> dict[str, Any]:
    value = {"choices": list(labels), **region}
    return {"id": "x1", "from_name": field, "type": "choices", "value": value}


def field(kind: str, **value: Any) -> dict[str, Any]:
    return {"from_name": "f", "type": kind, "value": value}


def annotation(who: object, *results: Any, **more: Any) -> dict[str, Any]:
    about = {"id": 7, "was_cancelled": False, "ground_truth": False, "lead_time": 4.2}
    return {**about, "completed_by": who, "result": list(results), **more}


def task(number: int, *annotations: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "id": number,
        "annotations": list(annotations),
        "predictions": [{"result": [choice("mood", "from a model")]}],
        "data": {"text": f"text {number}"},
        **more,
    }


def both(*results: dict[str, Any]) -> list[dict[str, Any]]:
    return [task(1, annotation(5, *results), annotation(6, *results))]


def answer(item: int, who: str, *labels: str, **more: Any) -> dict[str, Any]:
    return {
        "text": f"text {item}",
        "_input_hash": item,
        "accept": list(labels),
        "answer": "accept",
        "_annotator_id": who,
        "_session_id": who,
        **more,
    }


def decision(who: str, word: str, label: str) -> dict[str, Any]:
    return {"_input_hash": 1, "label": label, "answer": word, "_session_id": who}


KIM, LEE = ({"id": n, "email": f"{name}@x.org"} for n, name in ((1, "kim"), (2, "lee")))
GOOD, BAD = choice("mood", "good"), choice("mood", "bad")
STARS = {"from_name": "stars", "type": "rating", "value": {"rating": 4}}
SEVERAL = [
    task(
        1,
        annotation(5, GOOD, STARS, field("labels", start=0, end=3)),
        annotation(6, BAD, {**STARS, "value": {"rating": 2}}),
    )
]
ABOUT = {"annotation_id": 1, "created_at": "t", "lead_time": 1.5, "id": 1, "text": "a"}
MIN = [
    {**ABOUT, "mood": "good", "stars": [{"rating": 4}], "annotator": 5},
    {**ABOUT, "mood": {"choices": ["good", "bad"]}, "annotator": 6},
]
ECO = [decision("kim", "accept", "ECO"), decision("lee", "reject", "ECO")]
TWO_LABELS = [*ECO, decision("kim", "accept", "POL")]
OF_TWO = {("1", "5"): "good", ("1", "7"): "bad"}
DOCUMENTS = {
    ("a.txt", "ann"): "good",
    ("a.txt", "bo"): "bad",
    ("b.txt", "ann"): None,
    ("b.txt", "bo"): "good",
}
ANN = {"id": 1, "text": "a", "label": ["good"], "Comments": []}
BO = {"id": 1, "text": "a", "label": ["bad"], "Comments": []}

# tool, name of the file, content, options; grades, and what is left out
READ: dict[str, tuple[str, str, Any, dict[str, Any], Any, dict[str, int]]] = {
    "an annotation is a rating by who completed it": (
        *("label-studio", "e.json"),
        [
            task(11, annotation(KIM, GOOD), annotation(LEE)),
            task(12, annotation(KIM, BAD), annotation(LEE, GOOD)),
        ],
        {},
        {
            ("11", "kim@x.org"): "good",
            ("11", "lee@x.org"): None,  # submitted without a choice
            ("12", "kim@x.org"): "bad",
            ("12", "lee@x.org"): "good",
        },
        {},
    ),
    "annotators are numbers, and skipped tasks are left out": (
        *("label-studio", "e.json"),
        [
            task(
                1,
                annotation(5, GOOD),
                annotation(6, BAD, was_cancelled=True),
                annotation(7, BAD),
            )
        ],
        *({}, OF_TWO, {"skipped": 1}),
    ),
    "completions of old versions": (
        *("label-studio", "e.json"),
        [
            {
                "id": 1,
                "completions": [
                    {"completed_by": 5, "result": [GOOD]},
                    {"completed_by": 6, "result": [], "skipped": True},
                    {"completed_by": 7, "result": [BAD]},
                ],
            }
        ],
        *({}, OF_TWO, {"skipped": 1}),
    ),
    "one of several fields": (
        *("label-studio", "e.json", SEVERAL, {"grade": "stars"}),
        *({("1", "5"): "4", ("1", "6"): "2"}, {}),
    ),
    "a number": (
        *("label-studio", "e.json", both(field("number", number=3)), {}),
        *({("1", "5"): "3", ("1", "6"): "3"}, {}),
    ),
    "a taxonomy": (
        *("label-studio", "e.json"),
        both(field("taxonomy", taxonomy=[["animal", "dog"]])),
        *({}, {("1", "5"): "animal/dog", ("1", "6"): "animal/dog"}, {}),
    ),
    "a pair": (
        *("label-studio", "e.json", both(field("pairwise", selected="left")), {}),
        *({("1", "5"): "left", ("1", "6"): "left"}, {}),
    ),
    "items by their text, of two projects": (
        *("label-studio", "e.json"),
        [
            task(1, annotation(5, GOOD)),
            task(9, annotation(6, BAD), data={"text": "text 1"}),
        ],
        {"item": "text"},
        {("text 1", "5"): "good", ("text 1", "6"): "bad"},
        {},
    ),
    "JSON-MIN": (
        *("label-studio", "min.json", MIN, {"grade": "stars"}),
        *({("1", "5"): "4", ("1", "6"): None}, {}),
    ),
    "a file for each annotator, and others": (
        *("doccano", "export.zip"),
        archive(
            ann__jsonl=lines(ANN, {"id": 2, "label": []}),
            bo__jsonl=lines(BO, {"id": 2, "label": ["good"]}),
            **{"__MACOSX/._ann.jsonl": "\0\5", "notes.txt": "ann is new"},
        ),
        {},
        {
            ("1", "ann"): "good",
            ("1", "bo"): "bad",
            ("2", "ann"): None,  # not labelled, or not yet
            ("2", "bo"): "good",
        },
        {},
    ),
    "the annotator in the record": (
        *("doccano", "all.jsonl"),
        lines({**ANN, "label": "good", "username": "ann"}, {**BO, "username": "bo"}),
        *({}, {("1", "ann"): "good", ("1", "bo"): "bad"}, {}),
    ),
    "numbers of labels and users, as of old": (
        *("doccano", "old.json"),
        [{"id": 23, "annotations": [{"label": 2, "user": 1}, {"label": 1, "user": 4}]}],
        *({}, {("23", "1"): "2", ("23", "4"): "1"}, {}),
    ),
    "a choice by its annotator": (
        *("prodigy", "out.jsonl"),
        lines(
            answer(-17, "kim", "A"),
            answer(-17, "lee", "B"),
            answer(40, "kim", "B"),
            answer(40, "lee", "A", answer="ignore"),
            answer(41, "kim", answer="reject"),
        ),
        {},
        {
            ("-17", "kim"): "A",
            ("-17", "lee"): "B",
            ("40", "kim"): "B",
            ("40", "lee"): None,
        },
        {"answered ignore": 1, "answered reject": 1},
    ),
    "a decision on a label": (
        *("prodigy", "one.jsonl", lines(*ECO), {}),
        *({("1", "kim"): "accept", ("1", "lee"): "reject"}, {}),
    ),
    "a decision on one of two labels": (
        *("prodigy", "two.jsonl", lines(*TWO_LABELS), {"grade": "ECO"}),
        *({("1", "kim"): "accept", ("1", "lee"): "reject"}, {"of other fields": 1}),
    ),
    "labels of documents": (
        *("inception", "agr.csv"),
        "doc,user,label\r\na.txt,ann,good\r\na.txt,bo,bad\r\n"
        "b.txt,ann,\r\nb.txt,bo,good\r\nb.txt,CURATION_USER,good\r\n",
        *({}, DOCUMENTS, {"of the curator or the source": 1}),
    ),
    "labels of documents as JSON": (
        *("inception", "agr.json"),
        [{"doc": d, "user": u, "label": label} for (d, u), label in DOCUMENTS.items()],
        *({}, DOCUMENTS, {}),
    ),
}

SPAN = field("labels", start=0, end=3, text="Kim", labels=["PER"])
DOCCANO = {"id": 1, "text": "a", "username": "ann"}
REFUSED: list[tuple[str, Any, dict[str, Any], str]] = [
    ("label-studio", SEVERAL, {}, "--grade: .* mood, stars, got none"),
    ("label-studio", SEVERAL, {"grade": "box"}, "--grade: .* got 'box'"),
    ("label-studio", MIN, {}, "--grade: .*text, mood, stars"),
    ("label-studio", MIN, {"grade": "mood"}, "several, good, bad"),
    (
        "label-studio",
        [task(3, annotation(KIM, choice("topic", "war", "sport")))],
        {},
        "item 3: needed one category .*kim@x.org gave several, war, sport",
    ),
    (
        "label-studio",
        [task(1, annotation(5, SPAN, choice("quality", "good", start=0, end=3)))],
        {},
        "spans, regions and relations",
    ),
    ("label-studio", [task(1, annotation(None, GOOD))], {}, "needed an annotator"),
    ("label-studio", [task(1, annotation(KIM, "x"))], {}, "another structure"),
    ("label-studio", [{"id": 1, "annotations": 3}], {}, "another structure"),
    ("doccano", [{**DOCCANO, "label": ["good", "bad"]}], {}, "several"),
    ("doccano", [{**DOCCANO, "label": [[0, 3, "PER"], [5, 8, "LOC"]]}], {}, "spans"),
    ("doccano", [{**DOCCANO, "entities": [{"label": "PER"}]}], {}, "spans"),
    ("doccano", [{"id": 1, "label": ["good"]}], {}, "needed an annotator"),
    ("doccano", [{"label": ["good"], "username": "ann"}], {}, "needed an item"),
    ("doccano", [{"id": 1, "annotations": ["x"]}], {}, "another structure"),
    ("doccano", [{"id": [1], "label": ["a"], "user": ["ann"]}], {}, ""),
    ("prodigy", TWO_LABELS, {}, "--grade: .* ECO, POL"),
    ("prodigy", [answer(5, "kim", "A", "B")], {}, "item 5: needed one category"),
    (
        "prodigy",
        [{"_input_hash": 5, "answer": "accept", "spans": [{}], "_session_id": "kim"}],
        {},
        "spans, regions and relations",
    ),
    ("prodigy", [answer(1, "", "A")], {}, "needed an annotator"),
    ("prodigy", [answer(5, "kim", accept={"A": 1})], {}, ""),
    ("inception", [{"doc": None, "user": "a", "label": "b"}], {}, "needed an item"),
    ("inception", [{"doc": "a", "user": ["x"], "label": "l"}], {}, ""),
    ("inception", "doc,user,begin,text,label\na,x,0,Kim,P\n", {}, "columns of spans"),
    ("inception", "doc,user,label\na,x,good\na,x,bad\n", {}, "more than once"),
    ("inception", "doc,user\na,x\n", {}, "another structure"),
    ("inception", "Type,Document\nDocumentPosition,a\n", {}, "another structure"),
    ("brat", [{"a": 1}], {}, "--from: needed one of label-studio, doccano"),
    *(
        (source, content, {}, r"e\.(json|csv): ")
        for source in ("label-studio", "doccano", "prodigy", "inception")
        for content in ([], 3, ["a"], [{"x": 1}], '{"a":', "a,b\n1,2\n", {})
    ),
]


@pytest.mark.parametrize("name", READ)
def test_what_is_read(name: str, tmp_path: Path) -> None:
    source, file_name, content, options, expected, dropped = READ[name]
    if isinstance(content, list):
        content = json.dumps(content)
    path = tmp_path / file_name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    file = read_ratings(path, Reading(source=source, **options))
    assert grades(file) == expected
    assert file.read["dropped"] == dropped
    assert file.read["format"] == f"{source} export"


@pytest.mark.parametrize(("source", "content", "options", "words"), REFUSED)
def test_what_is_refused(
    source: str, content: Any, options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    is_csv = isinstance(content, str) and not content.startswith("{")
    path = tmp_path / ("e.csv" if is_csv else "e.json")
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    with pytest.raises(MasrelError) as refusal:
        read_ratings(path, Reading(source=source, **options))
    assert re.search(words, str(refusal.value))
    assert "\n" not in str(refusal.value)
