"""What evaluation tools write: who graded which output how, or what is refused."""

import base64
import json
import re
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

from masrel.errors import MasrelError
from masrel.ratings import Reading, read_ratings
from tests.ratings.by_hand import grades
from tests.ratings.test_exports import archive, lines

# written by inspect_ai 0.3.285: two epochs of three samples, two scorers, one edit
LOG = Path(__file__).parent / "evaluations" / "log.eval"
NAN = float("nan")

# ---- records as the tools write them ----


def sample(name: object, epoch: int = 1, **scores: Any) -> dict[str, Any]:
    of = {
        scorer: score
        if isinstance(score, dict) and "value" in score
        else {"value": score}
        for scorer, score in scores.items()
    }
    return {"id": name, "epoch": epoch, "input": "2+2", "scores": of, "events": []}


def log(*samples: dict[str, Any]) -> dict[str, Any]:
    about = {"version": 2, "status": "success", "eval": {"task": "sums"}}
    return {**about, "results": {"scores": []}, "samples": list(samples)}


def edited(value: str, *edits: tuple[str, str]) -> dict[str, Any]:
    # what the scorer gave, and what authors made of it
    by = [{"value": v, "provenance": {"author": who}} for who, v in edits]
    last = [v for v in (value, *(v for _, v in edits)) if v != "UNCHANGED"][-1]
    return {"value": last, "history": [{"value": value}, *by]}


def metrics(doc: int, filtered: str = "none", **values: Any) -> dict[str, Any]:
    about = {"doc_id": doc, "doc": {"q": "?"}, "resps": [["a"]], "filter": filtered}
    return {**about, "metrics": [*values], **values}


def part(type_: str, ok: bool, **more: Any) -> dict[str, Any]:
    assertion = {"type": type_, **more.pop("assertion", {})}
    return {"pass": ok, "score": int(ok), "reason": "", "assertion": assertion, **more}


def output(test: int, place: int, *parts: Any, **more: Any) -> dict[str, Any]:
    ok = all(each["pass"] for each in parts)
    return {
        **{"testIdx": test, "promptIdx": place, "promptId": "c0ffee1234"},
        **{"provider": {"id": f"openai:m{place}"}, "success": ok, "score": int(ok)},
        **{"failureReason": 0 if ok else 1, "namedScores": {}, "vars": {}},
        **{"gradingResult": {"pass": ok, "componentResults": list(parts)}, **more},
    }


def eval_file(*rows: dict[str, Any]) -> dict[str, Any]:
    return {"evalId": "e1", "results": {"version": 3, "results": list(rows)}}


def assessment(kind: str, who: str, value: Any, **more: Any) -> dict[str, Any]:
    source = {"source_type": kind, "source_id": who}
    given = {"assessment_name": "ok", "source": source, "feedback": {"value": value}}
    return {**given, "trace_id": "tr-1", "valid": True, **more}


def trace(name: str, *assessments: Any, **more: Any) -> dict[str, Any]:
    info = {"trace_id": name, "state": "OK", "assessments": list(assessments)}
    return {"info": info, "data": {"spans": [], **more}}


def span(name: str, parent: str | None = None) -> dict[str, Any]:
    ids = (
        base64.b64encode(bytes.fromhex(i)).decode() if i else None
        for i in (name, parent)
    )
    return dict(zip(("span_id", "parent_span_id"), ids, strict=True))


def feedback(run: str | None, kind: str, **more: Any) -> dict[str, Any]:
    user = {"user_id": "u1", "user_name": more.pop("user", None)}
    source = {"type": kind, "metadata": {}, **user}
    of = {"run_id": run, "trace_id": run, "key": "correct", "score": None}
    return {**of, "value": None, "feedback_source": source, **more}


def score(trace_id: str, source: str, value: Any, **more: Any) -> dict[str, Any]:
    of = {"id": "s", "traceId": trace_id, "observationId": None, "name": "tone"}
    kind = {"dataType": "NUMERIC", "stringValue": None, "authorUserId": None}
    return {**of, "source": source, "value": value, **kind, **more}


def verdict(judge: Any, a: str, b: str, winner: str, turn: int = 1) -> dict[str, Any]:
    of = {"question_id": 81, "model_a": a, "model_b": b, "winner": winner}
    return {**of, "judge": judge, "turn": turn, "conversation_a": [{"role": "user"}]}


def pair(first: str, second: str) -> dict[str, Any]:
    of = {"question_id": 81, "model_1": "zed", "model_2": "abe", "turn": 1}
    return {
        **of,
        "judge": ["gpt-4", "pair-v2"],
        "g1_winner": first,
        "g2_winner": second,
    }


def lewidi(annotators: str, annotations: Any) -> dict[str, Any]:
    of = {"text": {"post": "a"}, "annotators": annotators, "annotations": annotations}
    return {**of, "soft_label": {"0": 0.5, "1": 0.5}, "hard_label": "1", "lang": "en"}


SNAKE = {"trace_id": "t1", "name": "tone", "data_type": "CATEGORICAL", "value": 0}
HUMANS: dict[str, dict[str, Any]] = {
    "Kim": {"a": 1, "b": 2, "c": 1},
    "Lee": {"a": 1, "b": 1, "d": None},
}
JUDGES = {"gpt-4o": {"a": 1, "b": 2, "c": 2, "d": 1}}
OF_BOTH = {
    (item, who): str(of[item]) if of.get(item) else None
    for who, of in {**HUMANS, **JUDGES}.items()
    for item in "abcd"
}
AUTHOR = {"authorUserId": "kim"}
LABEL = {"dataType": "CATEGORICAL", "stringValue": "warm"}
Kinds = dict[str, str]

# tool, its records, options; grades, what is left out, and the kinds of raters
READ: dict[str, tuple[str | None, Any, dict[str, Any], Any, dict[str, int], Kinds]] = {
    "a scorer is a rater, and NaN is missing": (
        "inspect-ai",
        log(sample("a", strict="C", loose="C"), sample(7, strict=NAN, loose="I")),
        {},
        {
            ("a", "strict"): "C",
            ("a", "loose"): "C",
            ("7", "strict"): None,
            ("7", "loose"): "I",
        },
        *({}, {}),
    ),
    "a sample without scores, one that is invalidated, and a second epoch": (
        "inspect-ai",
        log(
            {**sample("b"), "scores": None},
            {**sample("c", strict="C"), "invalidation": {"author": "kim"}},
            *(sample("a", epoch, strict="C", loose="I") for epoch in (1, 2)),
        ),
        {},
        {
            (i, who): g
            for i in ("a", "a/2")
            for who, g in (("strict", "C"), ("loose", "I"))
        },
        *({"invalidated": 1}, {}),
    ),
    "the epochs of a sample are a cluster": (
        "inspect-ai",
        log(
            *(sample("a", epoch, s="C", t="I") for epoch in (1, 2)),
            sample("b", s="C", t="C"),
        ),
        {"clusters": "cluster"},
        {
            **{(i, "s"): "C" for i in ("a", "a/2", "b")},
            **{("a", "t"): "I", ("a/2", "t"): "I", ("b", "t"): "C"},
        },
        *({}, {}),
    ),
    "an edit is its author's, and the grade before it the scorer's": (
        "inspect-ai",
        log(
            sample("a", judge=edited("I", ("kim", "C"), ("lee", "UNCHANGED"))),
            sample("b", judge=edited("C", ("kim", "I"), ("kim", "C"))),
        ),
        {},
        {
            ("a", "judge"): "I",
            ("a", "kim"): "C",
            ("b", "judge"): "C",
            ("b", "kim"): "C",
        },
        *({}, {"kim": "human"}),
    ),
    "places of a list are raters": (
        *("inspect-ai", log(sample("a", panel=[1, 0, NAN])), {}),
        {("a", "panel.1"): "1", ("a", "panel.2"): "0", ("a", "panel.3"): None},
        *({}, {}),
    ),
    "one of several fields, of the scorers that have it": (
        "inspect-ai",
        log(
            sample(
                "a", r={"value": {"tone": 2, "fit": 1}}, s={"value": {"tone": 3}}, t="C"
            )
        ),
        {"grade": "tone"},
        *({("a", "r"): "2", ("a", "s"): "3"}, {"of other fields": 1}, {}),
    ),
    "a model is a folder of an archive, a task in the name of its file": (
        "lm-eval",
        archive(
            **{
                f"{m}/samples_arc_easy_2026-05-01T10-00-0{k}.123456__jsonl": lines(
                    metrics(0, acc=k, acc_norm=1.0), metrics(1, acc=1, acc_norm=0.0)
                )
                for k, m in enumerate(("gpt2", "phi"))
            }
        ),
        {"grade": "acc"},
        {
            ("arc_easy/0", "gpt2"): "0",
            ("arc_easy/1", "gpt2"): "1",
            ("arc_easy/0", "phi"): "1",
            ("arc_easy/1", "phi"): "1",
        },
        *({}, {"gpt2": "model", "phi": "model"}),
    ),
    "each filter has metrics of its own": (
        "lm-eval",
        [metrics(0, f, em=e) for f, e in (("strict-match", 0), ("flexible", 1))],
        *({"grade": "em,flexible"}, {("0", "model"): "1"}),
        *({"of other fields": 1}, {"model": "model"}),
    ),
    "an assertion is a rater, one of people, of models or of code": (
        "promptfoo",
        eval_file(
            output(0, 0, part("llm-rubric", True), part("human", False)),
            output(0, 1, part("llm-rubric", False), part("contains", True)),
        ),
        {"grade": "pass"},
        {
            **{("0/0", "llm-rubric"): "true", ("0/0", "human"): "false"},
            **{("0/1", "llm-rubric"): "false", ("0/1", "contains"): "true"},
            **{("0/0", "contains"): None, ("0/1", "human"): None},
        },
        {"of other fields": 2},
        {"llm-rubric": "model", "human": "human", "contains": "code"},
    ),
    "a judge that failed, two assertions of a kind, one with a name": (
        "promptfoo",
        eval_file(
            output(
                *(3, 0),
                part("llm-rubric", False, metadata={"graderError": True}),
                part("not-llm-rubric", True, assertion={"metric": "tone"}),
                *(part("contains", True), part("contains", False)),
                {**part("", True), "assertion": None},
            )
        ),
        {"grade": "score"},
        {
            **{("3/0", "llm-rubric"): None, ("3/0", "tone"): "1"},
            **{("3/0", "contains"): "1", ("3/0", "contains.2"): "0"},
        },
        {"of other fields": 1, "without assertion": 1},
        {
            **{"llm-rubric": "model", "tone": "model"},
            **{"contains": "code", "contains.2": "code"},
        },
    ),
    "an error is missing, and providers answer the same test": (
        "promptfoo",
        eval_file(
            output(0, 0, part("equals", True)),
            output(0, 1, success=False, failureReason=2, gradingResult=None),
        ),
        {"grade": "success"},
        {("0/c0ffee12", "openai:m0"): "true", ("0/c0ffee12", "openai:m1"): None},
        {"of other fields": 1},
        {"openai:m0": "model", "openai:m1": "model"},
    ),
    "people, judges and code apart, and what is invalid left out": (
        "mlflow",
        [
            trace(
                "tr-1",
                assessment("HUMAN", "kim@x.org", True),
                assessment("LLM_JUDGE", "openai:/gpt-4o", False),
                assessment("LLM_JUDGE", "default", True),
                assessment("CODE", "default", None, feedback={"error": {}}),
                assessment("HUMAN", "lee", True, valid=False),
                {**assessment("HUMAN", "lee", 1), "feedback": None, "expectation": {}},
            )
        ],
        {},
        {
            ("tr-1", "kim@x.org"): "true",
            ("tr-1", "openai:/gpt-4o"): "false",
            ("tr-1", "default (model)"): "true",
            ("tr-1", "default (code)"): None,
        },
        {"no longer valid": 1, "of expected values": 1},
        {
            **{"kim@x.org": "human", "openai:/gpt-4o": "model"},
            **{"default (model)": "model", "default (code)": "code"},
        },
    ),
    "a judge whom a person corrects keeps its grade": (
        "mlflow",
        {
            "traces": [
                {
                    "trace_id": "tr-1",
                    "assessments": [
                        assessment(
                            "LLM_JUDGE", "j", "no", assessment_id="1", valid=False
                        ),
                        assessment(
                            "HUMAN",
                            "kim",
                            "no",
                            assessment_id="2",
                            valid=False,
                            overrides="1",
                        ),
                        assessment("HUMAN", "kim", "yes", overrides="2"),
                    ],
                }
            ]
        },
        {},
        {("tr-1", "j"): "no", ("tr-1", "kim"): "yes"},
        *({"no longer valid": 1}, {"j": "model", "kim": "human"}),
    ),
    "a span within a trace is an item, the outermost is the trace": (
        "mlflow",
        trace(
            "tr-1",
            assessment("HUMAN", "kim", 1),
            assessment("LLM_JUDGE", "j", 2, span_id="0a0b"),
            assessment("LLM_JUDGE", "j", 3, span_id="0c0d"),
            spans=[span("0a0b"), span("0c0d", "0a0b")],
        ),
        {},
        {
            ("tr-1", "kim"): "1",
            ("tr-1", "j"): "2",
            ("tr-1/0c0d", "j"): "3",
            ("tr-1/0c0d", "kim"): None,
        },
        *({}, {"kim": "human", "j": "model"}),
    ),
    "a person by name, and a judge not by who runs it": (
        "langsmith",
        [
            feedback("r1", "app", user="Kim", score=1, value="good"),
            feedback("r1", "app", value="0"),
            feedback("r1", "model", user="Kim", score=0),
            feedback("r1", "api", score=1.0),
            feedback("r2", "auto_eval", score=True),
            feedback("r1", "app", key="tone", value="warm"),
        ],
        {"grade": "correct"},
        {
            **{
                ("r1", who): g for who, g in (("Kim", "1"), ("u1", "0"), ("model", "0"))
            },
            **{("r1", "api"): "1", ("r1", "auto_eval"): None},
            **{("r2", who): None for who in ("Kim", "u1", "model", "api")},
            ("r2", "auto_eval"): "1",  # as beside numbers
        },
        {"of other fields": 1},
        {"Kim": "human", "u1": "human", "model": "model", "auto_eval": "model"},
    ),
    "the name of a category and not its number": (
        "langfuse",
        {
            "data": [
                score("t1", "ANNOTATION", 1, **AUTHOR, **LABEL),
                score("t1", "EVAL", 0, **{**LABEL, "stringValue": "cold"}),
                score("t1", "API", 3, observationId="o1"),
                score("t1", "ANNOTATION", 0, **AUTHOR, dataType="CORRECTION"),
            ],
            "meta": {"page": 1},
        },
        {},
        {
            **{("t1", "kim"): "warm", ("t1", "EVAL"): "cold", ("t1", "API"): None},
            **{("t1/o1", "kim"): None, ("t1/o1", "EVAL"): None, ("t1/o1", "API"): "3"},
        },
        *({"of texts or corrections": 1}, {"kim": "human", "EVAL": "model"}),
    ),
    "keys as in files, and subjects as in the third version": (
        "langfuse",
        [
            {**SNAKE, "source": "EVAL", "string_value": "cold"},
            {
                **SNAKE,
                "source": "ANNOTATION",
                "string_value": "warm",
                "author_user_id": "kim",
            },
        ],
        *({}, {("t1", "EVAL"): "cold", ("t1", "kim"): "warm"}, {}),
        {"EVAL": "model", "kim": "human"},
    ),
    "subjects as in the third version": (
        "langfuse",
        [
            {"name": "n", "dataType": "BOOLEAN", "value": ok, "subject": of, **by}
            for by in ({"source": "EVAL"}, {"source": "ANNOTATION", **AUTHOR})
            for ok, of in (
                (True, {"kind": "trace", "id": "t1"}),
                (False, {"kind": "observation", "id": "o1", "traceId": "t1"}),
            )
        ],
        {},
        {
            (i, w): g
            for w in ("EVAL", "kim")
            for i, g in (("t1", "true"), ("t1/o1", "false"))
        },
        *({}, {"EVAL": "model", "kim": "human"}),
    ),
    "a pair the other way round, and ties of both kinds": (
        "mt-bench",
        [
            verdict("expert_1", "zed", "abe", "model_a"),
            verdict("gpt4_pair", "abe", "zed", "model_b"),
            verdict("expert_1", "abe", "zed", "tie", turn=2),
            verdict("gpt4_pair", "zed", "abe", "tie (inconsistent)", turn=2),
        ],
        {},
        {
            (f"81/abe/zed/{turn}", who): grade
            for turn, grade in ((1, "model_b"), (2, "tie"))
            for who in ("expert_1", "gpt4_pair")
        },
        *({}, {"expert_1": "human", "gpt4_pair": "model"}),
    ),
    "both orders by FastChat": (
        "mt-bench",
        [
            *(
                pair("model_1", "model_1"),
                {**pair("model_1", "tie"), "question_id": 82},
            ),
            {**pair("model_1", "error"), "question_id": 83},
        ],
        {},
        {
            ("81/abe/zed/1", "gpt-4"): "model_b",
            ("82/abe/zed/1", "gpt-4"): "tie",
            ("83/abe/zed/1", "gpt-4"): None,
        },
        *({}, {"gpt-4": "model"}),
    ),
    "grades of single answers, -1 where none was found": (
        "mt-bench",
        [
            {"question_id": q, "model": "abe", "judge": ["gpt-4", "v1"], "score": s}
            for q, s in ((81, 7), (82, -1))
        ],
        {},
        {("81/abe/1", "gpt-4"): "7", ("82/abe/1", "gpt-4"): None},
        *({}, {"gpt-4": "model"}),
    ),
    "the alternative annotator test's two files, one behind the other": (
        *(None, json.dumps(HUMANS) + "\n" + json.dumps(JUDGES), {}, OF_BOTH, {}, {}),
    ),
    "Le-Wi-Di 2023, two strings side by side": (
        None,
        {"1": lewidi("Ann1,Ann2", "0,1"), "2": lewidi("Ann2, Ann3", "1,1")},
        {},
        {
            **{("1", "Ann1"): "0", ("1", "Ann2"): "1", ("1", "Ann3"): None},
            **{("2", "Ann1"): None, ("2", "Ann2"): "1", ("2", "Ann3"): "1"},
        },
        *({}, {}),
    ),
    "Le-Wi-Di 2025, more annotators than items": (
        None,
        {"1": lewidi("A,B,B,C", {"A": "-1", "B": "5", "C": "5"})},
        *({}, {("1", "A"): "-1", ("1", "B"): "5", ("1", "C"): "5"}, {}, {}),
    ),
    "Le-Wi-Di 2025, two labels of one annotator": (
        None,
        {"1": lewidi("A,B,B", {"A": "no", "B": "no,yes"})},
        {"set_separator": ","},
        *({("1", "A"): "no", ("1", "B"): "no; yes"}, {}, {}),
    ),
}

NO_EXPORT: list[Any] = [[], 3, ["a"], [{"x": 1}], '{"a":', {}, [[1]], None]
REFUSED: list[tuple[str | None, Any, dict[str, Any], str]] = [
    (
        "inspect-ai",
        log(sample("a", r={"value": {"x": 1, "y": 2}})),
        {},
        "--grade: .* x, y",
    ),
    (
        "inspect-ai",
        log(sample("a", r={"value": {"x": [1, 2]}})),
        {},
        "gave several, 1, 2",
    ),
    ("inspect-ai", log(sample("a")), {}, "got none"),
    ("inspect-ai", {**log(), "samples": [{"id": 1}]}, {}, "another structure"),
    ("lm-eval", [metrics(0, acc=1, f1=0)], {}, "--grade: .* acc, f1, got none"),
    ("lm-eval", [metrics(0, acc=1), metrics(0, acc=0)], {}, "more than once"),
    ("lm-eval", [{**metrics(0), "metrics": ["acc"]}], {}, "another structure"),
    (
        "promptfoo",
        eval_file(output(0, 0)),
        {"grade": "pass"},
        "--grade: .* success, got",
    ),
    ("promptfoo", {"results": {"version": 2, "table": {}}}, {}, "another structure"),
    ("mlflow", trace("t", {"assessment_name": "ok"}), {}, "another structure"),
    (
        "mlflow",
        trace("t", spans=[{"span_id": "x", "parent_span_id": "y"}]),
        {},
        "structure",
    ),
    ("mlflow", trace("t", assessment("HUMAN", "", 1)), {}, "needed an annotator"),
    ("langsmith", [feedback(None, "app", score=1)], {}, "needed an item"),
    ("langsmith", [{**feedback("r", "app"), "feedback_source": None}], {}, "annotator"),
    ("langfuse", [score("t", "ANNOTATION", 1)], {}, "item t: needed an annotator"),
    ("mt-bench", [{**verdict([], "a", "b", "tie")}], {}, "another structure"),
    (
        None,
        [{**metrics(0, acc=1), **feedback("r", "app")}],
        {},
        "--from lm-eval or --from langsmith",
    ),
    (None, {"1": lewidi("Ann1,Ann2", "0,1,1")}, {}, "item '1': needed one grade from"),
    (None, json.dumps(HUMANS) + json.dumps(HUMANS), {}, ""),
    *(
        (source, content, {}, r"e\.json: ")
        for source in (
            *("inspect-ai", "lm-eval", "promptfoo", "mlflow", "langsmith", "langfuse"),
            "mt-bench",
        )
        for content in NO_EXPORT
    ),
]


def written(folder: Path, content: Any) -> Path:
    is_zip = isinstance(content, bytes)
    path = folder / ("e.zip" if is_zip else "e.json")
    text = content if isinstance(content, str) else None
    path.write_bytes(content if is_zip else (text or json.dumps(content)).encode())
    return path


@pytest.mark.parametrize("name", READ)
def test_what_is_read(name: str, tmp_path: Path) -> None:
    source, content, options, expected, dropped, kinds = READ[name]
    path = written(tmp_path, content)
    # the keys of its records say which tool it is of
    for given in {source} if isinstance(content, bytes) else {source, None}:
        file = read_ratings(path, Reading(source=given, **options))
        assert grades(file) == expected
        assert file.read["dropped"] == dropped
        assert file.read.get("kinds", {}) == kinds
        assert file.read["format"] == (f"{source} export" if source else "json")


@pytest.mark.parametrize(("source", "content", "options", "words"), REFUSED)
def test_what_is_refused(
    source: str | None,
    content: Any,
    options: dict[str, Any],
    words: str,
    tmp_path: Path,
) -> None:
    with pytest.raises(MasrelError) as refusal:
        read_ratings(written(tmp_path, content), Reading(source=source, **options))
    assert re.search(words, str(refusal.value))
    assert "\n" not in str(refusal.value)


def test_epochs_are_clusters() -> None:
    pytest.importorskip("pyarrow")
    (part,) = read_ratings(LOG, Reading(clusters="cluster")).parts
    assert part.items == ("a", "b", "c", "a/2", "b/2", "c/2")
    assert part.clusters == ("a", "b", "c", "a", "b", "c")


def test_judgements_that_the_order_turned_are_named(tmp_path: Path) -> None:
    file = read_ratings(written(tmp_path, [pair("model_1", "model_2")]))
    (finding,) = (of for of in file.warnings if of.code == "inconsistent")
    assert finding.facts == {"n": 1}


def test_judgements_as_parquet(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    arrow = pytest.importorskip("pyarrow")
    rows = [verdict(who, "b", "a", "model_a") for who in ("expert_1", "expert_2")]
    parquet.write_table(arrow.Table.from_pylist(rows), tmp_path / "e.parquet")
    file = read_ratings(tmp_path / "e.parquet", Reading(source="mt-bench"))
    assert set(grades(file).values()) == {"model_b"}


# ---- a log that zstd packed ----


@pytest.mark.parametrize("source", [None, "inspect-ai"])
def test_a_packed_log(source: str | None) -> None:
    pytest.importorskip("pyarrow")
    file = read_ratings(LOG, Reading(source=source))
    strict = {"a": "C", "b": "I", "c": None, "a/2": "C", "b/2": "C", "c/2": "I"}
    lenient = {"a": "C", "b": "C", "c": "I", "a/2": "C", "b/2": "C", "c/2": "P"}
    kim = {**dict.fromkeys(strict), "b": "C"}
    assert grades(file) == {
        (item, who): grade
        for who, of in (("strict", strict), ("lenient", lenient), ("kim", kim))
        for item, grade in of.items()
    }


def test_a_packed_log_without_the_library(monkeypatch: pytest.MonkeyPatch) -> None:
    if not hasattr(zipfile, "ZIP_ZSTANDARD"):
        monkeypatch.setitem(sys.modules, "pyarrow", None)
        with pytest.raises(MasrelError, match="inspect log convert --to json"):
            read_ratings(LOG)


def test_a_packed_log_that_is_damaged(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    data = LOG.read_bytes()
    place = data.index(b"samples/b_epoch_1.json") + 40
    (tmp_path / "log.eval").write_bytes(data[:place] + bytes(40) + data[place + 40 :])
    with pytest.raises(MasrelError, match=r"is damaged or not a \.eval file"):
        read_ratings(tmp_path / "log.eval")
