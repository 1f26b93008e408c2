"""Exports of annotation tools: who gave which item which label."""

import json
import zipfile
from pathlib import Path
from typing import Any

import pytest

from masrel.errors import MasrelError, ParameterError
from masrel.ratings import RatingsFile, read_ratings


def write(path: Path, content: object) -> Path:
    """Write JSON, or lines of JSON where the file is called so."""
    if path.suffix == ".jsonl" and isinstance(content, list):
        text = "".join(json.dumps(value) + "\n" for value in content)
    else:
        text = content if isinstance(content, str) else json.dumps(content)
    path.write_text(text, encoding="utf-8")
    return path


def grades(file: RatingsFile) -> dict[tuple[str, str], str | None]:
    """Return the grade of each item and rater."""
    (part,) = file.parts
    codes = part.ratings.codes
    return {
        (item, rater): None if (code := codes[i, j]) < 0 else file.scale.grades[code]
        for i, item in enumerate(part.items)
        for j, rater in enumerate(part.raters)
    }


def choice(field: str, *labels: str) -> dict[str, Any]:
    return {
        "id": "x1",
        "from_name": field,
        "to_name": "text",
        "type": "choices",
        "value": {"choices": list(labels)},
    }


def annotation(who: object, *results: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "id": 7,
        "completed_by": who,
        "result": list(results),
        "was_cancelled": False,
        "ground_truth": False,
        "lead_time": 4.2,
    } | more


def task(number: int, *annotations: dict[str, Any]) -> dict[str, Any]:
    return {
        "id": number,
        "annotations": list(annotations),
        "drafts": [],
        "predictions": [{"result": [choice("mood", "from a model")]}],
        "data": {"text": f"text {number}"},
        "project": 1,
    }


KIM = {"id": 1, "email": "kim@example.org", "first_name": "", "last_name": ""}
LEE = {"id": 2, "email": "lee@example.org", "first_name": "", "last_name": ""}


class TestLabelStudio:
    def test_each_annotation_is_a_rating_by_who_completed_it(
        self, tmp_path: Path
    ) -> None:
        tasks = [
            task(11, annotation(KIM, choice("mood", "good")), annotation(LEE)),
            task(
                12,
                annotation(KIM, choice("mood", "bad")),
                annotation(LEE, choice("mood", "good")),
            ),
        ]
        file = read_ratings(write(tmp_path / "e.json", tasks), source="label-studio")
        assert grades(file) == {
            ("11", "kim@example.org"): "good",
            ("11", "lee@example.org"): None,  # submitted without a choice
            ("12", "kim@example.org"): "bad",
            ("12", "lee@example.org"): "good",
        }
        assert file.read["format"] == "label-studio export"
        assert file.read["field"] == "mood"
        assert file.read["n_missing"] == 1

    def test_annotators_may_be_numbers(self, tmp_path: Path) -> None:
        tasks = [
            task(
                1,
                annotation(5, choice("mood", "good")),
                annotation(6, choice("mood", "bad")),
            )
        ]
        file = read_ratings(write(tmp_path / "e.json", tasks), source="label-studio")
        assert grades(file) == {("1", "5"): "good", ("1", "6"): "bad"}

    def test_skipped_tasks_are_left_out_and_counted(self, tmp_path: Path) -> None:
        tasks = [
            task(
                1,
                annotation(5, choice("mood", "good")),
                annotation(6, choice("mood", "bad"), was_cancelled=True),
                annotation(7, choice("mood", "bad")),
            )
        ]
        file = read_ratings(write(tmp_path / "e.json", tasks), source="label-studio")
        assert grades(file) == {("1", "5"): "good", ("1", "7"): "bad"}
        assert file.read["dropped"] == {"skipped": 1}

    def test_the_completions_of_old_versions_are_annotations(
        self, tmp_path: Path
    ) -> None:
        tasks = [
            {
                "id": 1,
                "completions": [
                    {"completed_by": 5, "result": [choice("mood", "good")]},
                    {"completed_by": 6, "result": [], "skipped": True},
                    {"completed_by": 7, "result": [choice("mood", "bad")]},
                ],
            }
        ]
        file = read_ratings(write(tmp_path / "e.json", tasks), source="label-studio")
        assert grades(file) == {("1", "5"): "good", ("1", "7"): "bad"}
        assert file.read["dropped"] == {"skipped": 1}

    def test_a_project_with_several_fields_needs_one(self, tmp_path: Path) -> None:
        stars = {"from_name": "stars", "type": "rating", "value": {"rating": 4}}
        box = {"from_name": "box", "type": "labels", "value": {"start": 0, "end": 3}}
        few = stars | {"value": {"rating": 2}}
        tasks = [
            task(
                1,
                annotation(5, choice("mood", "good"), stars, box),
                annotation(6, choice("mood", "bad"), few),
            )
        ]
        path = write(tmp_path / "e.json", tasks)
        with pytest.raises(MasrelError, match=r"needs --grade .*, mood, stars"):
            read_ratings(path, source="label-studio")
        with pytest.raises(MasrelError, match=r"--grade: needed one of .* got 'box'"):
            read_ratings(path, source="label-studio", grade="box")
        file = read_ratings(path, source="label-studio", grade="stars")
        assert grades(file) == {("1", "5"): "4", ("1", "6"): "2"}
        assert file.read["grade"] == "stars"

    @pytest.mark.parametrize(
        ("kind", "value", "grade"),
        [
            ("number", {"number": 3}, "3"),
            ("taxonomy", {"taxonomy": [["animal", "dog"]]}, "animal/dog"),
            ("pairwise", {"selected": "left"}, "left"),
        ],
    )
    def test_other_fields_of_one_category(
        self, tmp_path: Path, kind: str, value: dict[str, Any], grade: str
    ) -> None:
        result = {"from_name": "f", "type": kind, "value": value}
        tasks = [task(1, annotation(5, result), annotation(6, result))]
        file = read_ratings(write(tmp_path / "e.json", tasks), source="label-studio")
        assert grades(file) == {("1", "5"): grade, ("1", "6"): grade}

    def test_several_choices_at_once_are_refused(self, tmp_path: Path) -> None:
        tasks = [task(3, annotation(KIM, choice("topic", "war", "sport")))]
        path = write(tmp_path / "e.json", tasks)
        with pytest.raises(MasrelError, match="item 3: needed one category") as refusal:
            read_ratings(path, source="label-studio")
        assert "kim@example.org gave 2: war, sport" in str(refusal.value)

    def test_spans_are_refused(self, tmp_path: Path) -> None:
        span = {
            "from_name": "label",
            "type": "labels",
            "value": {"start": 0, "end": 3, "text": "Kim", "labels": ["PER"]},
        }
        region = choice("quality", "good")
        region["value"] |= {"start": 0, "end": 3}
        tasks = [task(1, annotation(5, span, region))]
        with pytest.raises(MasrelError, match="spans, regions and relations are not"):
            read_ratings(write(tmp_path / "e.json", tasks), source="label-studio")

    def test_items_may_be_texts(self, tmp_path: Path) -> None:
        # two projects of one rater each, with numbers of their own
        tasks = [
            task(1, annotation(5, choice("mood", "good"))),
            task(9, annotation(6, choice("mood", "bad")))
            | {"data": {"text": "text 1"}},
        ]
        path = write(tmp_path / "e.json", tasks)
        file = read_ratings(path, source="label-studio", item="text")
        assert grades(file) == {("text 1", "5"): "good", ("text 1", "6"): "bad"}

    def test_json_min_needs_the_field(self, tmp_path: Path) -> None:
        about = {"annotation_id": 1, "created_at": "t", "lead_time": 1.5}
        rows = [
            {"id": 1, "text": "a", "mood": "good", "stars": [{"rating": 4}]},
            {"id": 1, "text": "a", "mood": {"choices": ["good", "bad"]}},
        ]
        path = write(
            tmp_path / "min.json",
            [row | about | {"annotator": n} for n, row in enumerate(rows, start=5)],
        )
        with pytest.raises(MasrelError, match=r"needs --grade .*text, mood, stars"):
            read_ratings(path, source="label-studio")
        file = read_ratings(path, source="label-studio", grade="stars")
        assert grades(file) == {("1", "5"): "4", ("1", "6"): None}
        with pytest.raises(MasrelError, match="several labels are not read"):
            read_ratings(path, source="label-studio", grade="mood")


class TestDoccano:
    def archive(self, path: Path, **files: list[dict[str, Any]]) -> Path:
        with zipfile.ZipFile(path, "w") as packed:
            for name, rows in files.items():
                text = "".join(json.dumps(row) + "\n" for row in rows)
                packed.writestr(f"{name}.jsonl", text)
        return path

    def test_a_file_for_each_annotator(self, tmp_path: Path) -> None:
        path = self.archive(
            tmp_path / "export.zip",
            ann=[
                {"id": 1, "text": "a", "label": ["good"], "Comments": []},
                {"id": 2, "text": "b", "label": [], "Comments": ["?"]},
            ],
            bo=[
                {"id": 1, "text": "a", "label": ["bad"], "Comments": []},
                {"id": 2, "text": "b", "label": ["good"], "Comments": []},
            ],
        )
        file = read_ratings(path, source="doccano")
        assert grades(file) == {
            ("1", "ann"): "good",
            ("1", "bo"): "bad",
            ("2", "ann"): None,  # not labelled, or not yet
            ("2", "bo"): "good",
        }

    def test_other_files_of_the_archive_are_not_read(self, tmp_path: Path) -> None:
        path = self.archive(
            tmp_path / "export.zip",
            ann=[{"id": 1, "label": ["good"]}],
            bo=[{"id": 1, "label": ["bad"]}],
        )
        with zipfile.ZipFile(path, "a") as packed:
            packed.writestr("__MACOSX/._ann.jsonl", b"\0\5\26\7")
            packed.writestr("notes.txt", "ann is new")
        assert grades(read_ratings(path, source="doccano")) == {
            ("1", "ann"): "good",
            ("1", "bo"): "bad",
        }

    def test_the_annotator_may_stand_in_the_record(self, tmp_path: Path) -> None:
        rows = [
            {"id": 1, "text": "a", "label": "good", "username": "ann"},
            {"id": 1, "text": "a", "label": ["bad"], "username": "bo"},
        ]
        file = read_ratings(write(tmp_path / "all.jsonl", rows), source="doccano")
        assert grades(file) == {("1", "ann"): "good", ("1", "bo"): "bad"}

    def test_the_old_export_has_the_numbers_of_labels_and_users(
        self, tmp_path: Path
    ) -> None:
        rows = [
            {
                "id": 23,
                "text": "a",
                "annotations": [{"label": 2, "user": 1}, {"label": 1, "user": 4}],
                "meta": {},
                "annotation_approver": "kim",
            }
        ]
        file = read_ratings(write(tmp_path / "old.json", rows), source="doccano")
        assert grades(file) == {("23", "1"): "2", ("23", "4"): "1"}

    @pytest.mark.parametrize(
        ("row", "words"),
        [
            ({"label": ["good", "bad"], "username": "ann"}, "several labels"),
            ({"label": [[0, 3, "PER"], [5, 8, "LOC"]], "username": "ann"}, "spans"),
            ({"entities": [{"label": "PER"}], "relations": []}, "spans"),
            ({"label": ["good"]}, "needed to know who gave the labels"),
        ],
    )
    def test_what_is_refused(
        self, tmp_path: Path, row: dict[str, Any], words: str
    ) -> None:
        path = write(tmp_path / "all.jsonl", [{"id": 1, "text": "a"} | row])
        with pytest.raises(MasrelError, match=words):
            read_ratings(path, source="doccano")


def answer(
    item: int, who: str, *labels: str, answer: str = "accept", **more: Any
) -> dict[str, Any]:
    return {
        "text": f"text {item}",
        "_input_hash": item,
        "_task_hash": item + 1,
        "options": [{"id": "A", "text": "a"}, {"id": "B", "text": "b"}],
        "_view_id": "choice",
        "accept": list(labels),
        "answer": answer,
        "_annotator_id": who,
        "_session_id": who,
    } | more


class TestProdigy:
    def test_a_choice_is_a_rating_by_its_annotator(self, tmp_path: Path) -> None:
        rows = [
            answer(-17, "set-kim", "A"),
            answer(-17, "set-lee", "B"),
            answer(40, "set-kim", "B"),
            answer(40, "set-lee", "A", answer="ignore"),
            answer(41, "set-kim", answer="reject"),
        ]
        file = read_ratings(write(tmp_path / "out.jsonl", rows), source="prodigy")
        assert grades(file) == {
            ("-17", "set-kim"): "A",
            ("-17", "set-lee"): "B",
            ("40", "set-kim"): "B",
            ("40", "set-lee"): None,
        }
        dropped = {"answered ignore": 1, "answered reject": 1}
        assert file.read["dropped"] == dropped

    def test_a_decision_on_a_label_is_the_answer(self, tmp_path: Path) -> None:
        def decision(item: int, who: str, word: str, label: str) -> dict[str, Any]:
            return {
                "text": f"text {item}",
                "label": label,
                "_input_hash": item,
                "answer": word,
                "_session_id": who,
            }

        one = [decision(1, "kim", "accept", "ECO"), decision(1, "lee", "reject", "ECO")]
        file = read_ratings(write(tmp_path / "one.jsonl", one), source="prodigy")
        assert grades(file) == {("1", "kim"): "accept", ("1", "lee"): "reject"}

        path = write(
            tmp_path / "two.jsonl", [*one, decision(1, "kim", "accept", "POL")]
        )
        with pytest.raises(MasrelError, match=r"needs --grade .* labels, ECO, POL"):
            read_ratings(path, source="prodigy")
        file = read_ratings(path, source="prodigy", grade="ECO")
        assert grades(file) == {("1", "kim"): "accept", ("1", "lee"): "reject"}
        assert file.read["dropped"] == {"of other labels": 1}

    def test_several_choices_and_spans_are_refused(self, tmp_path: Path) -> None:
        path = write(tmp_path / "several.jsonl", [answer(5, "kim", "A", "B")])
        with pytest.raises(MasrelError, match="item 5: needed one category"):
            read_ratings(path, source="prodigy")
        spans = answer(5, "kim", spans=[{"start": 0, "end": 3, "label": "PER"}])
        del spans["accept"]
        with pytest.raises(MasrelError, match="spans, regions and relations"):
            read_ratings(write(tmp_path / "ner.jsonl", [spans]), source="prodigy")


DOCUMENTS = {
    ("a.txt", "ann"): "good",
    ("a.txt", "bo"): "bad",
    ("b.txt", "ann"): None,
    ("b.txt", "bo"): "good",
}


class TestInception:
    CSV = (
        "doc,user,label\r\na.txt,ann,good\r\na.txt,bo,bad\r\n"
        "b.txt,ann,\r\nb.txt,bo,good\r\nb.txt,CURATION_USER,good\r\n"
    )

    def test_labels_of_documents(self, tmp_path: Path) -> None:
        file = read_ratings(write(tmp_path / "agr.csv", self.CSV), source="inception")
        assert grades(file) == DOCUMENTS
        assert file.read["dropped"] == {"of the curator or the source": 1}

    def test_json_has_the_same(self, tmp_path: Path) -> None:
        rows = [
            {"doc": doc, "user": user, "label": label}
            for (doc, user), label in DOCUMENTS.items()
        ]
        file = read_ratings(write(tmp_path / "agr.json", rows), source="inception")
        assert grades(file) == DOCUMENTS

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("doc,user,begin,end,text,label\na,x,0,3,Kim,PER\n", "layer of spans"),
            ("doc,user,label\na,x,good\na,x,bad\n", "several labels"),
            ("doc,user\na,x\n", "labels of a feature"),
            ("Type,Collection,Document,Flags,x\nDocumentPosition,p,a,USED,l\n", "CSV"),
        ],
    )
    def test_what_is_refused(self, tmp_path: Path, text: str, words: str) -> None:
        with pytest.raises(MasrelError, match=words):
            read_ratings(write(tmp_path / "agr.csv", text), source="inception")


@pytest.mark.parametrize("source", ["label-studio", "doccano", "prodigy", "inception"])
@pytest.mark.parametrize(
    "content", ["[]", "3", '["a"]', '[{"x": 1}]', "a,b\n1,2\n", '{"a":', "{}"]
)
def test_another_file_is_refused_in_one_sentence(
    tmp_path: Path, source: str, content: str
) -> None:
    path = write(tmp_path / "e.json", content)
    with pytest.raises(MasrelError, match=r"e\.json: ") as refusal:
        read_ratings(path, source=source)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("source", ["label-studio", "doccano", "prodigy", "inception"])
def test_who_and_what_must_be_known(tmp_path: Path, source: str) -> None:
    rows = {
        "label-studio": [task(1, annotation(None, choice("mood", "good")))],
        "doccano": [{"text": "a", "label": ["good"], "username": "ann"}],
        "prodigy": [answer(1, "", "A")],
        "inception": [{"doc": None, "user": "ann", "label": "good"}],
    }
    path = write(tmp_path / "e.json", rows[source])
    with pytest.raises(MasrelError, match=r"needed its (item|annotator), got none"):
        read_ratings(path, source=source)


@pytest.mark.parametrize(
    ("source", "rows"),
    [
        ("label-studio", [task(1, annotation(KIM) | {"result": ["x"]})]),
        ("label-studio", [{"id": 1, "annotations": 3}]),
        ("doccano", [{"id": 1, "annotations": ["x"]}]),
        ("doccano", [{"id": [1], "label": ["a"], "user": ["ann"]}]),
        ("prodigy", [answer(5, "kim") | {"accept": {"A": 1}}]),
        ("inception", [{"doc": "a", "user": ["x"], "label": "l"}]),
    ],
)
def test_records_of_another_shape_are_refused(
    tmp_path: Path, source: str, rows: object
) -> None:
    path = write(tmp_path / "e.json", rows)
    with pytest.raises(MasrelError, match=r"e\.json: ") as refusal:
        read_ratings(path, source=source)
    assert "\n" not in str(refusal.value)


def test_the_tool_must_be_known(tmp_path: Path) -> None:
    path = write(tmp_path / "e.json", [{"a": 1}])
    with pytest.raises(ParameterError, match="--from: needed label-studio, doccano"):
        read_ratings(path, source="brat")
