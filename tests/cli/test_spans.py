"""masrel spans: one set of spans from every kind of file, and what is said of it."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from masrel.agreement import span_f1, unitizing_alpha
from tests.cli.process import Caller

LENGTHS = {"a": 60, "b": 45, "c": 50}
ROWS = [
    *[
        ("a", "Kim", "PER", 0, 8),
        ("a", "Kim", "LOC", 20, 6),
        ("a", "Kim", "PER", 30, 4),
    ],
    *[("a", "Lee", "PER", 0, 8), ("a", "Lee", "LOC", 22, 4)],
    *[("b", "Kim", "LOC", 5, 9), ("b", "Lee", "LOC", 5, 9), ("b", "Lee", "PER", 30, 3)],
    *[("c", "Kim", "PER", 7, 5), ("c", "Lee", None, None, None)],
]
COLUMNS = "doc_id,Annotator,Label,start offset,end offset"


def lines(*more: str, scale: int = 1) -> str:
    """Rows of a table; scale: by what places are divided."""
    rows = [",".join([COLUMNS, *more])]
    for document, who, label, begin, size in ROWS:
        ends = ["", ""] if label is None else [begin / scale, (begin + size) / scale]
        extra = ["" if of == "words" else LENGTHS[document] / scale for of in more]
        rows.append(",".join(map(str, [document, who, label or "", *ends, *extra])))
    return "\n".join(rows) + "\n"


def table(folder: Path) -> list[object]:
    (folder / "s.csv").write_text(lines("text length"))
    return [folder / "s.csv"]


def seconds(folder: Path) -> list[object]:
    (folder / "s.csv").write_text(lines("Dauer", scale=1000))
    return [folder / "s.csv", "--length", "Dauer", "--step", 0.001]


def brat(folder: Path) -> list[object]:
    """Folders of annotators, the text of Kim's beside, those of all others above."""
    for who in ("Kim", "Lee"):
        for document, length in LENGTHS.items():
            place = folder / "brat" / who / "news" / f"{document}.ann"
            place.parent.mkdir(parents=True, exist_ok=True)
            spans = [row for row in ROWS if row[:2] == (document, who) and row[2]]
            place.write_text(
                "".join(
                    f"T{k}\t{label} {begin} {begin + size}\twords\n"
                    for k, (_, _, label, begin, size) in enumerate(spans)
                )
                + "R1\tOrigin Arg1:T0 Arg2:T1\n#1\tAnnotatorNotes T0\tT9\tPER 1 2\n"
            )
            text = place.with_suffix(".txt")
            text = text if who == "Kim" else folder / "brat" / "news" / text.name
            text.parent.mkdir(parents=True, exist_ok=True)
            text.write_text("é" * length, encoding="utf-8")
    return [folder / "brat"]


def label_studio(folder: Path) -> list[object]:
    tasks = []
    for document, length in LENGTHS.items():
        skipped = {"completed_by": 3, "was_cancelled": True, "result": []}
        annotations: list[dict[str, Any]] = [skipped]
        for who in ("Kim", "Lee"):
            regions = [
                {
                    "type": "hypertextlabels" if html else "labels",
                    "value": {"globalOffsets": ends, "startOffset": 3, **labels}
                    if html
                    else {**ends, **labels},
                }
                for _, _, label, begin, size in (
                    row for row in ROWS if row[:2] == (document, who) and row[2]
                )
                for html in [label == "LOC"]
                for ends in [{"start": begin, "end": begin + size}]
                for labels in [{"hypertextlabels" if html else "labels": [label]}]
            ]
            regions.append({"type": "relation", "from_id": "x", "to_id": "y"})
            annotations.append({"completed_by": {"email": who}, "result": regions})
        data = {"text": "x" * length}
        tasks.append({"id": document, "data": data, "annotations": annotations})
    (folder / "export.json").write_text(json.dumps(tasks))
    return [folder / "export.json", "--from", "label-studio"]


@pytest.mark.parametrize("written", [table, seconds, brat, label_studio])
def test_every_file_gives_the_same(
    masrel: Caller, tmp_path: Path, written: Callable[[Path], list[object]]
) -> None:
    done = masrel("spans", *written(tmp_path), "--json", "-")
    assert done.code == 0, done.err
    shown = {
        (of["coefficient"], of["weights"], of["of"]): (
            of["value"],
            of["interval"]["low"],
        )
        for of in json.loads(done.out)["estimates"]
    }
    alpha = unitizing_alpha(ROWS, length=LENGTHS).estimates
    expected = {("unitizing_alpha", "identity", of): e for of, e in alpha.items()}
    for match in ("strict", "overlap", "token"):
        estimate = span_f1(ROWS, match=match)["Kim", "Lee"]
        expected["span_f1", match, "Kim and Lee"] = estimate
    assert shown.keys() == expected.keys()
    for of, estimate in expected.items():
        low = None if estimate.interval.reason else estimate.interval.low
        assert shown[of] == (pytest.approx(estimate.value), pytest.approx(low))


def test_what_is_not_known_is_said(masrel: Caller, tmp_path: Path) -> None:
    file = tmp_path / "s.csv"
    file.write_text(lines(scale=4) + "b,Ann,PER,0.5,1\n")
    done = masrel("spans", file, "--step", 0.5, "--csv")
    assert done.code == 0, done.err
    assert "unitizing_alpha" not in done.out
    for said in ("--length", "0.5 of a step", "2 times"):
        assert said in done.err


def test_page_and_figure_show_a_document(masrel: Caller, tmp_path: Path) -> None:
    call = [*table(tmp_path), "--show", "b", "--figure", tmp_path / "f.svg"]
    done = masrel("spans", *call, "--html", tmp_path / "p.html")
    page = (tmp_path / "p.html").read_text(encoding="utf-8")
    assert done.code == 0
    assert (tmp_path / "f.svg").stat().st_size > 1000
    for shown in ("PER: Kim", "LOC: Lee", "Unitizing α", "SHA-256"):
        assert shown in page
