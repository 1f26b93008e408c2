"""Studies that version 0.1.0 ran are read, verified, merged and analysed as they were.

`old_study/README.md` says what they are, and `old_study/files.csv` which files.
"""

import csv
import gzip
import hashlib
import io
import json
import math
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from tests.files import table_of
from tests.golden.call import masrel

OLD = Path(__file__).parent / "old_study"
FROZEN = OLD / "files"
TABLE_SHA256 = "bde35326b1d624284911f813dc1c8eaf72700ace5360612ccc1937d8700ba967"
"""Of `files.csv`, which has the mode and hash of every other file."""

STUDIES = ("north", "south", "both", "adaptive", "claims", "no_repeat", "psych_ds")
ANALYSED = ("both", "claims", "psych_ds")
LATER = {"masrel_version", "version", "Version", "ratings_sha256"} | {
    "description",
    "Description",
}
"""Keys whose values may change: versions, the hash of ratings that have grown, and
what a column is said to hold."""


def rows() -> list[dict[str, str]]:
    return table_of(OLD / "files.csv")


def sha256(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def mode(file: Path) -> int:
    return file.stat().st_mode & 0o777


@pytest.fixture(scope="module")
def old(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy, with the modes of the table; tests write beside its studies."""
    root = tmp_path_factory.mktemp("old")
    for row in rows():
        path = root / row["path"]
        if row["path"].endswith("/"):
            path.mkdir(parents=True)
        else:
            shutil.copyfile(FROZEN / (row["same_as"] or row["path"]), path)
        path.chmod(int(row["mode"], 8))
    return root


def said(*arguments: object, code: int = 0) -> Any:
    """Call the command line -> what it printed, or the JSON of it."""
    made = masrel(*arguments)
    assert made["code"] in (code, None if code == 0 else code), made
    return made.get("json", made.get("out"))


def lacking(old: Any, new: Any, where: str = "") -> list[str]:
    """Where something is missing or other than it was; what has come is ignored."""
    if isinstance(old, dict) and isinstance(new, dict):
        kept = [key for key in old if key not in LATER]
        if old.get("coefficient") == "krippendorff_alpha":  # whose error is centred now
            kept = [key for key in kept if key != "standard_error"]
        return [
            place
            for key in kept
            for place in lacking(old[key], new.get(key, "nothing"), f"{where}.{key}")
        ]
    if where.endswith((".notes", ".sentence")):
        # words may change, and are held by transcripts; that something is said may not
        old, new = [bool(of) for of in (old, new)]
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        pairs = enumerate(zip(old, new, strict=True))
        return [p for n, (a, b) in pairs for p in lacking(a, b, f"{where}[{n}]")]
    if isinstance(old, float) and isinstance(new, float):
        is_kept = math.isclose(old, new, rel_tol=1e-12, abs_tol=1e-15)
    else:
        # a method may have come to name the rule that chose it
        is_kept = new in (old, f"{old}, chosen by auto-2026.2")
    return [] if is_kept else [f"{where}: {old!r} -> {new!r}"]


def table(text: str, delimiter: str = ",") -> dict[str, Any]:
    """Lines at the head and rows of a table, as `lacking` compares them."""
    lines = text.splitlines(keepends=True)
    head = [line for line in lines if line.startswith("#")]
    named = dict(line[1:].strip().partition(":")[::2] for line in head)
    body = io.StringIO("".join(lines[len(head) :]), newline="")
    return {"head": named, "rows": list(csv.DictReader(body, delimiter=delimiter))}


def content(file: Path) -> Any:
    """A file as `lacking` compares it: JSON, TOML and tables may have grown."""
    data = file.read_bytes()
    if file.suffix == ".gz":
        return gzip.decompress(data)
    if file.suffix == ".json":
        return json.loads(data)
    if file.suffix == ".toml":
        return tomllib.loads(data.decode())
    if file.suffix == ".jsonl":
        events = [json.loads(line) for line in data.splitlines()]
        return [{key: e[key] for key in ("event", "fields")} for e in events]
    if file.suffix in (".csv", ".tsv"):
        return table(data.decode(), "\t" if file.suffix == ".tsv" else ",")
    if file.name == "README.md":  # which came to count what is simulated
        return data.partition(b"SIMULATED D")[0]
    return data


def files(folder: Path) -> set[str]:
    paths = folder.rglob("*")
    return {path.relative_to(folder).as_posix() for path in paths if path.is_file()}


def test_no_frozen_file_has_changed() -> None:
    stored = {
        row["path"]: row["sha256"]
        for row in rows()
        if not row["path"].endswith("/") and not row["same_as"]
    }
    assert {name: sha256(FROZEN / name) for name in files(FROZEN)} == stored
    assert sha256(OLD / "files.csv") == TABLE_SHA256


def test_the_copy_has_the_modes_of_the_table(old: Path) -> None:
    modes = {row["path"]: f"{mode(old / row['path']):o}" for row in rows()}
    assert modes == {row["path"]: row["mode"] for row in rows()}
    assert {modes["north/.key/"], modes["both/sessions/"]} == {"700"}


@pytest.mark.parametrize("study", STUDIES)
def test_a_study_is_read_and_whole(old: Path, study: str) -> None:
    said("check", old / study)
    frozen = content(old / "expected" / f"status_{study}.json")["sessions"]
    status = said("status", old / study, "--json", "-")["sessions"]
    assert lacking(frozen, status) == []
    anchors = old / "expected" / "anchors" / f"{study}.txt"
    options = ("--anchor", anchors) if anchors.exists() else ()
    verified = said("verify", old / study, *options, "--json", "-")
    assert verified["is_whole"] is True


def test_a_report_of_other_claims_is_broken(old: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(old / "claims", tmp_path / "claims")
    with (copy / "ratings" / "claims.csv").open("a", encoding="utf-8") as file:
        file.write("\n")
    findings = said("verify", copy, "--json", "-", code=2)["findings"]
    broken = [of["path"] for of in findings if of["weight"] == "broken"]
    assert broken == [str(copy / "report" / "manifest.json")]


def test_the_sites_are_merged_as_they_were(old: Path, tmp_path: Path) -> None:
    both = tmp_path / "both"
    said("merge", old / "north", old / "south", "-o", both)
    made_later = {"ratings", "report", "analysis.json"}
    frozen = {f for f in files(old / "both") if f.split("/")[0] not in made_later}
    assert files(both) == frozen
    assert not [f for f in frozen if mode(both / f) & ~mode(old / "both" / f)]
    # of the new log of conduct the times, and the hashes over them, are others
    exact = frozen - {"conduct.jsonl"}
    changed = [f for f in exact if sha256(both / f) != sha256(old / "both" / f)]
    assert changed == []
    logs = [content(folder / "conduct.jsonl") for folder in (old / "both", both)]
    assert lacking(*logs) == []


@pytest.mark.parametrize("study", ANALYSED)
def test_ratings_and_analysis_are_as_they_were(
    old: Path, study: str, tmp_path: Path
) -> None:
    copy = shutil.copytree(old / study, tmp_path / study)
    shutil.rmtree(copy / "ratings")
    said("ratings", copy)
    for name in ("ratings.csv", "raters.csv", "answers.csv"):
        kept, made = (folder / "ratings" / name for folder in (old / study, copy))
        if kept.exists():
            assert lacking(content(kept), content(made), name) == []
    analysis = content(old / study / "analysis.json")
    assert lacking(analysis, said("analyze", copy, "--json", "-")) == []


def test_an_export_is_as_it_was(old: Path, tmp_path: Path) -> None:
    frozen, made = old / "expected" / "bids", tmp_path / "export"
    said("export", old / "both", "--as", "bids", "-o", made, "--quiet")
    assert files(made) == files(frozen)
    changes = {
        name: lacking(content(frozen / name), content(made / name))
        for name in files(frozen)
    }
    assert not any(changes.values()), changes


@pytest.mark.parametrize(
    ("study", "folder", "table"),
    [
        ("both", "bids/sourcedata", None),
        ("psych_ds", "psych_ds", "data/study-*_description-ratings_data.csv"),
    ],
)
def test_exports_are_read(
    old: Path, study: str, folder: str, table: str | None
) -> None:
    frozen = old / "expected" / folder
    options = () if table is None else ("--ratings", next(frozen.glob(table)))
    read = said("analyze", frozen, *options, "--json", "-")["estimates"]
    kept = content(old / study / "analysis.json")["estimates"]
    assert lacking(*([of["estimate"] for of in each] for each in (kept, read))) == []


def test_a_form_of_export_that_went_is_refused(old: Path, tmp_path: Path) -> None:
    call = ("export", old / "psych_ds", "--as", "psych-ds", "-o", tmp_path / "out")
    assert "'bids', 'ro-crate'" in masrel(*call)["err"]


@pytest.mark.parametrize("study", ["south", "no_repeat"])
def test_a_late_rater_is_drawn_the_same_order(
    old: Path, study: str, tmp_path: Path
) -> None:
    copy = shutil.copytree(old / study, tmp_path / study)
    text = (copy / "protocol.toml").read_text(encoding="utf-8")
    site = 'site = "south"\n' if study == "south" else ""
    text = text.replace(
        "\n[[sessions]]", f'\n[[raters]]\nid = "R9"\n{site}\n[[sessions]]', 1
    )
    head, of_session, rest = text.partition('id = "test"\n')
    text = head + of_session + rest.replace("]", ', "R9"]', 1)
    (copy / "protocol.toml").write_text(text, encoding="utf-8")
    before = {path: sha256(path) for path in (copy / "schedules").iterdir()}
    said("schedule", copy)
    assert {path: sha256(path) for path in before} == before
    for file in (old / "expected" / "late" / study).iterdir():
        drawn = copy / "schedules" / file.name
        assert lacking(content(file), content(drawn), file.name) == []
    listed = said("status", "raters", copy)
    late = {line.split()[0] for line in listed.splitlines() if " yes" in line}
    assert late == ({"R7", "R9"} if study == "south" else {"R9"})


@pytest.mark.parametrize("study", ["north", "adaptive"])
def test_a_training_is_told_as_it_was_and_goes_on(
    old: Path, study: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = shutil.copytree(old / study, tmp_path / study)
    of_rater = ("train", copy, "--rater", "R1")
    frozen = content(old / "expected" / f"training_{study}.json")
    assert lacking(frozen, said("train", "show", *of_rater[1:], "--json", "-")) == []
    lines = len(content(copy / "training" / "R1.jsonl"))
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n\n2\nstop\n"))
    said(*of_rater, "--clock", "simulated", code=1)
    events = content(copy / "training" / "R1.jsonl")[lines:]
    assert [e["event"] for e in events] == ["resumed", "presented", "grade", "stopped"]
    assert said("verify", copy, "--json", "-")["is_whole"] is True


def test_a_claims_section_is_audited_as_it_was(old: Path) -> None:
    frozen = content(old / "expected" / "claims.json")
    assert lacking(frozen, said("audit", old / "claims", "--json", "-")) == []


@pytest.mark.slow
@pytest.mark.parametrize("study", ["both", "claims"])
def test_the_report_is_built(old: Path, study: str, tmp_path: Path) -> None:
    """Its analysis is that of the old one; its pages may look otherwise."""
    options = ("--quiet", "--cache", tmp_path / "cache")
    said("report", old / study, "-o", tmp_path / "report", *options)
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "SIMULATED" in page
    frozen, built = (
        content(folder / "analysis.json")
        for folder in (old / study / "report", tmp_path / "report")
    )
    assert lacking(frozen, built) == []


@pytest.mark.slow
def test_figures_have_the_same_bytes_however_text_is_hashed(
    old: Path, tmp_path: Path
) -> None:
    """Of this one the solver of layouts once had other last digits in half the runs."""
    made = set()
    for seed in "0123":
        report = tmp_path / seed
        subprocess.run(
            (
                *(sys.executable, "-m", "masrel", "report", old / "both", "-o", report),
                *("--only", "questionnaires", "--quiet", "--cache", report / "cache"),
            ),
            env=os.environ | {"PYTHONHASHSEED": seed},
            check=True,
            capture_output=True,
        )
        made.add((report / "manifest.json").read_bytes())
    assert len(made) == 1
