"""Tools that annotate texts or evaluate models: who gave which item which grade.

A function for each tool goes from a record of its export to `Annotation`s. As ratings
only grades of whole items are read; several of an item at once, spans and relations are
refused; but there are functions that give spans, and nothing else.
"""

import re
from base64 import b64decode
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import PurePosixPath
from typing import Any, NamedTuple

_Record = dict[str, Any]


class Annotation(NamedTuple):
    """What an annotator gave an item."""

    item: Any
    rater: Any
    grades: _Record  # by field; several in a list
    text: Any = None  # what was annotated
    why: str = ""  # it is left out
    kind: str = ""  # of rater, if a file has it: "human", "model" or "code"
    cluster: Any = None  # that the item is of
    note: str = ""  # code of a finding


def _label_studio(_: str, task: _Record) -> Iterator[Annotation]:
    # the annotations of a task
    if "annotator" in task and "annotations" not in task:
        # its JSON-MIN has one object an annotation, data and results side by side
        grades = {key: _labels(v) for key, v in task.items() if key not in _ABOUT}
        yield Annotation(task.get("id"), task["annotator"], grades, task.get("text"))
        return
    data = task.get("data") or {}
    only = next(iter(data.values())) if len(data) == 1 else None
    for annotation in task.get("annotations") or task.get("completions") or ():
        who = annotation.get("completed_by")
        if isinstance(who, dict):
            who = who.get("email") or who.get("id")
        grades = {}
        for result in annotation.get("result") or ():
            value = result.get("value")
            if _is_category(value):
                of = grades.setdefault(str(result.get("from_name")), [])
                of += _labels(value)
        is_skipped = annotation.get("was_cancelled") or annotation.get("skipped")
        yield Annotation(
            *(task.get("id"), who, grades, data.get("text", only)),
            why="skipped" if is_skipped else "",
        )


# The keys of Label Studio's results that are categories, and what its JSON-MIN has
# beside the task's data and the results.
_CATEGORIES = {"choices", "rating", "number", "taxonomy", "selected"}
_ABOUT = ("id", "annotator", "annotation_id", "created_at", "updated_at", "lead_time")


def _is_category(value: Any) -> bool:
    # of the whole task: beside that of a region stands its place
    return isinstance(value, dict) and len(value) == 1 and value.keys() <= _CATEGORIES


def _labels(value: Any) -> Any:
    # the categories of a result, of a taxonomy by their path from the root
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    if not _is_category(value):
        return value
    ((_, labels),) = value.items()
    several = labels if isinstance(labels, list) else [labels]
    return ["/".join(map(str, x)) if isinstance(x, list) else x for x in several]


def _doccano(path: str, example: _Record) -> Iterator[Annotation]:
    # the labels of an example; in an archive is a file of each annotator
    rater = example.get("username", example.get("user", PurePosixPath(path).name))
    text = example.get("text", example.get("filename"))
    keys = {"label", "labels", "cats"} & example.keys()
    if keys:
        yield Annotation(
            example.get("id"), rater, {key: example[key] for key in sorted(keys)}, text
        )
    for label in example.get("annotations") or ():  # old: labels, users by number
        grade = label if "start_offset" in label else label.get("label")
        yield Annotation(
            example.get("id"), label.get("user"), {"annotations": grade}, text
        )


def _prodigy(path: str, task: _Record) -> Iterator[Annotation]:
    # the answer to a task
    answer, why = task.get("answer"), ""
    is_choice = "accept" in task or "options" in task
    if answer == "ignore" or (is_choice and answer != "accept"):
        why = f"answered {answer or 'nothing'}"
    if is_choice:
        grades = {"accept": task.get("accept", [])}
    elif task.get("label") is not None:
        grades = {str(task["label"]): answer}
    else:
        grades = {"answer": task.get("spans") or task.get("relations") or answer}
    who = task.get("_session_id") or PurePosixPath(path).name
    yield Annotation(
        task.get("_input_hash"),
        task.get("_annotator_id") or who,
        grades,
        task.get("text"),
        why,
    )


def _inception(_: str, row: _Record) -> Iterator[Annotation]:
    # a row of the table of labels
    if other := row.keys() - {"doc", "user", "label"}:
        raise KeyError(f"columns of spans or chains, {', '.join(map(str, other))}")
    is_other = row["user"] in ("CURATION_USER", "INITIAL_CAS")
    yield Annotation(
        row["doc"],
        row["user"],
        {"label": row["label"]},
        why="of the curator or the source" if is_other else "",
    )


# ---- tools that evaluate models ----

# What tools call the kinds of those who grade; by an interface any of them may.
_KINDS = {
    **{"HUMAN": "human", "LLM_JUDGE": "model", "AI_JUDGE": "model", "CODE": "code"},
    **{"app": "human", "model": "model", "auto_eval": "model"},
    **{"ANNOTATION": "human", "EVAL": "model"},
}


def _inspect_ai(_: str, sample: _Record) -> Iterator[Annotation]:
    # the scores of a sample, and what people made of them
    sample_id, epoch = sample["id"], sample["epoch"]
    item = sample_id if epoch == 1 else f"{sample_id}/{epoch}"
    why = "invalidated" if sample.get("invalidation") else ""
    for scorer, score in (sample["scores"] or {}).items():
        values: dict[str | None, Any] = {}  # by author, none for the scorer itself
        for edit in score.get("history") or [score]:
            if edit["value"] != "UNCHANGED":
                values[(edit.get("provenance") or {}).get("author")] = edit["value"]
        for author, value in values.items():
            kind = "human" if author else ""
            several = value if isinstance(value, list) else [value]
            for place, each in enumerate(several, start=1):
                rater = f"{author or scorer}{f'.{place}' * isinstance(value, list)}"
                grades = each if isinstance(each, dict) else {"value": each}
                yield Annotation(item, rater, grades, None, why, kind, sample_id)


# what lm-eval calls the samples of a task
_SAMPLES = re.compile(r"samples_(.+)_\d{4}-\d\d-\d\dT[\d.-]+")


def _lm_eval(path: str, sample: _Record) -> Iterator[Annotation]:
    # the metrics of a sample; its model is the folder in the archive
    file, filtered = PurePosixPath(path), sample["filter"]
    rater = file.parent.name or file.name or "model"
    task = _SAMPLES.fullmatch(file.name)
    item = f"{task[1]}/{sample['doc_id']}" if task else sample["doc_id"]
    # called as in the table of results
    grades = {
        metric if filtered == "none" else f"{metric},{filtered}": sample[metric]
        for metric in sample["metrics"]
    }
    yield Annotation(item, rater, grades, kind="model")


_JUDGES = re.compile(  # promptfoo's assertions that ask a model
    r"(not-)?(.*rubric|model-graded-.*|factuality|g-eval|.*-relevance|"
    r"context-(recall|faithfulness)|select-best|pi|trajectory:goal-success|"
    r"promptfoo:redteam:.*)"
)


def _promptfoo(_: str, row: _Record) -> Iterator[Annotation]:
    # an output's grades by assertions, and those of its test by provider
    test, is_error = row["testIdx"], row.get("failureReason") == 2
    prompt = str(row.get("promptId", row["promptIdx"]))[:8]  # of all providers
    named = {} if is_error else row.get("namedScores") or {}
    yield Annotation(
        f"{test}/{prompt}",
        row["provider"]["id"],
        {"success": None if is_error else row["success"], **named},
        kind="model",
        cluster=test,
    )
    graded = {} if is_error else row.get("gradingResult") or {}
    n_before = Counter[str]()
    for part in graded.get("componentResults") or ():
        assertion = part.get("assertion") or {}
        type_ = assertion.get("type", "")
        rater = assertion.get("metric") or type_
        n_before[rater] += 1
        nth = f".{n_before[rater]}" * (n_before[rater] > 1)
        kind = "model" if _JUDGES.fullmatch(type_) else "code"
        is_graded = not (part.get("metadata") or {}).get("graderError")
        yield Annotation(
            f"{test}/{row['promptIdx']}",
            f"{rater}{nth}",
            {key: part[key] if is_graded else None for key in ("pass", "score")},
            why="" if assertion else "without assertion",
            kind="human" if type_ == "human" else kind,
            cluster=test,
        )


def _mlflow(_: str, trace: _Record) -> Iterator[Annotation]:
    # the feedback that a trace got
    info = trace.get("info", trace)
    assessments = info["assessments"] or ()
    spans = trace.get("spans") or (trace.get("data") or {}).get("spans") or ()
    # what is of the outermost span is of the trace, to which people give theirs
    inner = {b64decode(of["span_id"]).hex() for of in spans if of.get("parent_span_id")}
    correction = {of["overrides"]: of for of in assessments if of.get("overrides")}
    for each in assessments:
        source, span = each["source"], each.get("span_id")
        # a grade that another corrects is still its rater's: leaving it out would
        # leave out where a person and a judge differ
        by = correction.get(each.get("assessment_id"), each)["source"]
        is_void = each.get("valid") is False and by == source
        why = "no longer valid" if is_void else ""
        yield Annotation(
            f"{info['trace_id']}/{span}" if span in inner else info["trace_id"],
            source["source_id"],
            {each["assessment_name"]: (each.get("feedback") or {}).get("value")},
            why="of expected values" if "expectation" in each else why,
            kind=_KINDS.get(source["source_type"], ""),
            cluster=info["trace_id"],
        )


def _langsmith(_: str, feedback: _Record) -> Iterator[Annotation]:
    # a feedback on a run
    source = feedback["feedback_source"] or {}
    kind = _KINDS.get(source.get("type", ""), "")
    # of a judge the user is who runs it
    person = source.get("user_name") or source.get("user_id")
    score = feedback.get("score")
    yield Annotation(
        feedback["run_id"],
        person if kind == "human" else source.get("type"),
        {feedback["key"]: feedback.get("value") if score is None else score},
        kind=kind,
        cluster=feedback.get("trace_id"),
    )


def _langfuse(_: str, record: _Record) -> Iterator[Annotation]:
    # a score, with keys as the interface or as the export to files has them
    score = {
        re.sub("_(.)", lambda m: m[1].upper(), key): v for key, v in record.items()
    }
    source, label = score["source"], score.get("stringValue")
    subject = score.get("subject") or {}
    trace = subject.get("traceId", score.get("traceId"))
    parts = filter(None, (trace, subject.get("id", score.get("observationId"))))
    yield Annotation(
        "/".join(parts) or score.get("sessionId") or score.get("datasetRunId"),
        score.get("authorUserId") or (source if source != "ANNOTATION" else None),
        {score["name"]: label if label not in (None, "") else score.get("value")},
        why="of texts or corrections"
        if score.get("dataType") in ("TEXT", "CORRECTION")
        else "",
        kind=_KINDS.get(source, ""),
        cluster=trace,
    )


_TURNED = {"model_a": "model_b", "model_b": "model_a"}


def _mt_bench(_: str, row: _Record) -> Iterator[Annotation]:
    # a judgement of a pair of answers, in the order of the models' names
    # the second word of a judge is its prompt
    rater = row["judge"][0] if isinstance(row["judge"], list) else row["judge"]
    is_human = str(rater).startswith(("expert", "author", "human"))
    kind, note = "human" if is_human else "model", ""
    question, turn = row["question_id"], row.get("turn", 1)
    if "model" in row:
        item, score = f"{question}/{row['model']}/{turn}", row["score"]
        grades = {"score": None if score == -1 else score}  # -1 where none was found
    else:
        sides = [row.get(f"model_{a}") or row[f"model_{n}"] for a, n in ("a1", "b2")]
        # FastChat asks twice, in both orders, and has one or both of the answers
        both = {row.get("winner") or row["g1_winner"]}
        both.add(row.get("winner") or row["g2_winner"])
        winner = "error" if "error" in both else "tie"
        if len(both) > 1 or both == {"tie (inconsistent)"}:
            note = "inconsistent" * (winner == "tie")
        else:
            winner = both.pop().replace("_1", "_a").replace("_2", "_b")
        if sorted(sides) != sides:
            winner = _TURNED.get(winner, winner)
        item = f"{question}/{'/'.join(sorted(sides))}/{turn}"
        grades = {"winner": None if winner == "error" else winner}
    yield Annotation(item, rater, grades, None, "", kind, question, note)


# ---- spans: the grades are a label, and where it begins and ends ----


def label_studio_spans(path: str, task: _Record) -> Iterator[Annotation]:
    """Return regions of a text, in characters, or of a recording, in seconds."""
    for annotator, annotation in zip(
        _label_studio(path, task), task["annotations"], strict=True
    ):
        yield annotator._replace(grades={})  # who found nothing has looked, too
        for result in annotation["result"]:
            value = result.get("value", {})  # relations have none
            place = value["globalOffsets"] if "startOffset" in value else value
            for label in (
                of for key in value if key.endswith("labels") for of in value[key]
            ):
                yield annotator._replace(
                    grades={
                        "label": label,
                        "begin": place["start"],
                        "end": place["end"],
                        "length": result.get("original_length"),
                    }
                )


def brat_spans(path: str, document: _Record) -> Iterator[Annotation]:
    """Return the entities of an .ann file in a folder of its annotator."""
    rater, item = path.split("/", 1)
    annotator = Annotation(item, rater, {}, document["text"])
    yield annotator
    # of an entity in pieces each is a span
    for label, places in re.findall(r"(?m)^T\d+\t(\S+) ([\d ;]+)", document["ann"]):
        for begin, end in re.findall(r"(\d+) (\d+)", places):
            yield annotator._replace(
                grades={"label": label, "begin": begin, "end": end}
            )


# ---- the table ----


class Tool(NamedTuple):
    """How the records of a tool are read."""

    read: Callable[[str, Any], Iterator[Annotation]]
    keys: tuple[str, ...] = ()  # that its records have, and those of no other tool
    is_split: bool = False  # whether an annotation may have nothing to do with a field


TOOLS = {
    "label-studio": Tool(_label_studio),
    "doccano": Tool(_doccano),
    "prodigy": Tool(_prodigy, is_split=True),
    "inception": Tool(_inception),
    "inspect-ai": Tool(_inspect_ai, ("id epoch scores",), is_split=True),
    "lm-eval": Tool(_lm_eval, ("doc_id filter metrics",), is_split=True),
    "promptfoo": Tool(_promptfoo, ("testIdx promptIdx success",), is_split=True),
    "mlflow": Tool(_mlflow, ("info data", "trace_id assessments"), is_split=True),
    "langsmith": Tool(_langsmith, ("run_id key feedback_source",), is_split=True),
    "langfuse": Tool(
        _langfuse, ("name source dataType", "name source data_type"), is_split=True
    ),
    "mt-bench": Tool(
        _mt_bench,
        (
            "question_id judge model_a model_b winner",
            "question_id judge model_1 model_2 g1_winner",
            "question_id judge model score",
        ),
        is_split=True,
    ),
}
