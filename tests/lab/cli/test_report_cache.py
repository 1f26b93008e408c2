"""A report is made anew where something has changed, and nowhere else."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest

import masrel
from masrel.cli import cli
from masrel.lab.cli import report as verb
from tests.architecture.test_imports import HEAVY, loaded_after
from tests.cli.process import Caller
from tests.files import contents, edit, published_study

NOTES = ".masrel_cache"  # the folder of notes in a study
LINES = """
[[analysis.estimates]]
id = "kappa"
kind = "inter-rater"
coefficient = "fleiss_kappa"
models = "standard"
sessions = ["test"]
target = "raters"
interval = "jackknife"

[[analysis.estimates]]
id = "dummies"
kind = "inter-rater"
coefficient = "fleiss_kappa"
models = "dummy"
sessions = ["test"]
target = "raters"
interval = "none"

[report]
sections = ["agreement", "grades"]
"""


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The published study with two estimates, and what its report leaves in a cache."""
    root = tmp_path_factory.mktemp("reported") / "study"
    published_study(root, LINES)
    cli(["report", str(root), "--quiet"], standalone_mode=False)
    shutil.rmtree(root / "report")
    return root


@pytest.fixture
def study(reported: Path, tmp_path: Path) -> Path:
    """That study, with its cache and without its report."""
    return Path(shutil.copytree(reported, tmp_path / "study"))


def times(folder: Path) -> dict[Path, int]:
    return {path: path.lstat().st_mtime_ns for path in folder.rglob("*")}


def test_nothing_changed_touches_nothing_and_says_the_same(
    masrel: Caller, study: Path, tmp_path: Path
) -> None:
    gates = ("--require", "kappa.low >= 0.1", "--require", "kappa.n >= 9")
    junit = ("--junit", tmp_path / "junit.xml")
    first = masrel("report", study, *gates, *junit)
    assert first.code == 1
    assert "kappa.n >= 9 fails: 4" in first.err
    before = times(tmp_path)
    assert masrel("report", study, *gates, *junit) == first
    assert times(tmp_path) == before
    (tmp_path / "junit.xml").unlink()
    masrel("report", study, *gates, *junit)
    assert 'failures="1"' in (tmp_path / "junit.xml").read_text()


def test_what_must_be_known_of_the_numbers_is_said_again(
    masrel: Caller, study: Path
) -> None:
    edit(study / "protocol.toml", '"jackknife"', '"bootstrap"')
    edit(study / "protocol.toml", 'target = "raters"', 'target = "items"')
    first = masrel("report", study)
    assert "note: " in first.err
    assert masrel("report", study) == first


def test_letters_without_a_font_are_said_in_one_note_until_there_is_one(
    masrel: Caller, study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for file in (study / "protocol.toml", *study.glob("ratings/*.csv")):
        file.write_bytes(file.read_bytes().replace(b"1+", "경".encode()))
    first = masrel("report", study)
    (note, read, *_) = first.err.splitlines()
    assert note.startswith("note: no font here has 경: such letters are drawn as boxes")
    assert read.startswith("read: ")
    before = times(study)
    assert masrel("report", study) == first
    assert times(study) == before
    monkeypatch.setenv("MASREL_FONT", "DejaVu Sans")
    assert masrel("report", study) == first
    assert times(study) != before


def test_nothing_changed_loads_nothing_heavy(study: Path) -> None:
    call = f"from masrel.cli import cli\ncli(['report', {str(study)!r}])"
    built = loaded_after(call)
    assert "numpy" in built
    assert "pandas" not in built  # which takes as long as all else of a small report
    assert loaded_after(call) & (HEAVY | {"numpy", "msgspec", "jinja2"}) == set()


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("ratings/published.csv", "1+", "1"),
        pytest.param("protocol.toml", '"jackknife"', '"none"', marks=pytest.mark.slow),
    ],
)
def test_an_edit_is_seen(
    masrel: Caller, study: Path, tmp_path: Path, name: str, old: str, new: str
) -> None:
    masrel("report", study, "--quiet")
    before = contents(study / "report")
    text = (study / name).read_bytes()
    edit(study / name, old, new)
    os.utime(study / name, ns=(0, 0))  # as a copy has it
    masrel("report", study, "--quiet")
    after = contents(study / "report")
    assert after != before
    # what a build writes that can look nothing up
    cold, cache = tmp_path / "cold", tmp_path / "cache"
    masrel("report", study, "-o", cold, "--cache", cache, "--quiet")
    assert contents(cold) == after
    (study / name).write_bytes(text)
    masrel("report", study, "--quiet")
    assert contents(study / "report") == before


def test_a_file_that_comes_is_seen(masrel: Caller, study: Path) -> None:
    edit(study / "protocol.toml", '"agreement", ', '"in-person", ')
    in_person = study / "ratings/in_person.csv"
    data = in_person.read_bytes()
    in_person.unlink()
    masrel("report", study, "--quiet")
    without = contents(study / "report")
    in_person.write_bytes(data)
    masrel("report", study, "--quiet")
    assert contents(study / "report") != without


@pytest.mark.slow
def test_an_edit_of_the_code_is_seen(study: Path, tmp_path: Path) -> None:
    shutil.copytree(Path(masrel.__file__).parent, tmp_path / "code/masrel")
    command = [sys.executable, "-m", "masrel", "report", study, "--quiet"]
    environment = os.environ | {"PYTHONPATH": str(tmp_path / "code")}

    def page() -> str:
        subprocess.run(command, check=True, env=environment, cwd=tmp_path)
        return (study / "report/report.md").read_text(encoding="utf-8")

    before = page()
    template = tmp_path / "code/masrel/lab/report/templates/report.md"
    status = template.stat()
    edit(template, "# ", "% ", 1)  # as long as it was
    os.utime(template, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert page() == before.replace("# ", "% ", 1)


def test_a_file_of_the_report_is_made_good_and_one_that_nobody_links_to_goes(
    masrel: Caller, study: Path
) -> None:
    masrel("report", study)
    folder = study / "report"
    before = contents(folder)
    table = next((folder / "tables").iterdir())
    for file in (folder / "report.md", table):
        file.unlink()
        assert masrel("report", study).code == 0
        assert contents(folder) == before
    (folder / "manifest.json").write_bytes(b"spoilt")
    assert masrel("report", study).code == 0
    assert contents(folder) == before


def test_what_a_report_left_goes_and_what_is_not_its_own_stays(
    masrel: Caller, study: Path
) -> None:
    # as an earlier version made it, with hashes in names
    masrel("report", study)
    folder = study / "report"
    before = contents(folder)
    digest, others = sha256(b"abc").hexdigest(), ("edited", "mine")
    names = {name: f"tables/{name}-{digest[:16]}.csv" for name in ("old", *others)}
    for name in names.values():
        (folder / name).write_bytes(b"abc")
    (folder / names["edited"]).write_bytes(b"abcd")
    (study / "outside.csv").write_bytes(b"abc")
    manifest = json.loads((folder / "manifest.json").read_bytes())
    manifest["format"] = "masrel report 1"
    of_old = dict.fromkeys((names["old"], names["edited"], "../outside.csv"), digest)
    manifest["files"] |= of_old
    (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    done = masrel("report", study, "--check")
    assert f"{folder / names['old']}: would go\n" in done.out
    assert masrel("report", study).code == 0
    stays = {names["edited"]: b"abcd", names["mine"]: b"abc"}
    assert contents(folder) == before | stays
    assert (study / "outside.csv").exists()


def test_a_report_that_was_cut_off_is_called_so_until_it_is_made_anew(
    masrel: Caller, study: Path
) -> None:
    masrel("report", study)
    folder = study / "report"
    before = contents(folder)
    (folder / "unfinished.json").write_bytes((folder / "manifest.json").read_bytes())
    (folder / "manifest.json").unlink()
    why = "is incomplete because writing was interrupted; masrel report writes it again"
    said = f"{folder}: {why}\n"
    export = ("export", study, "--as", "bids", "-o", study / "out")
    for call in (("verify", study), export, ("report", study, "--check")):
        assert said in masrel(*call).err
    done = masrel("report", study, "--against", folder)
    assert (done.code, said in done.err) == (2, True)
    done = masrel("report", study, "--only", "grades")
    assert (done.code, said in done.err) == (0, True)
    assert "figures/agreement.svg" not in contents(folder)  # what it knew is its own
    assert said not in masrel("report", study).err
    assert contents(folder) == before


SPOILT: tuple[Callable[[bytes], bytes], ...] = (
    lambda data: data[: len(data) // 2],
    lambda data: data[:-9] + bytes([data[-9] ^ 1]) + data[-8:],
    lambda data: data.replace(b'"holds": true', b'"holds": null'),
)


@pytest.mark.slow
def test_a_spoilt_cache_is_of_no_consequence(masrel: Caller, study: Path) -> None:
    first = masrel("report", study)
    before = contents(study / "report")
    for spoilt in SPOILT:
        # the study is a copy of one that was reported: it has the note of that, too
        for file in (study / NOTES).glob("*.json"):
            data = file.read_bytes()
            file.write_bytes(spoilt(data))
            assert file.read_bytes() != data
        assert masrel("report", study) == first
        assert contents(study / "report") == before


@pytest.mark.slow
def test_a_cache_that_is_no_folder_is_of_no_consequence(
    masrel: Caller, study: Path
) -> None:
    shutil.rmtree(study / NOTES)
    (study / NOTES).write_text("a file")
    first = masrel("report", study, "--only", "agreement")
    assert first.code == 0
    assert masrel("report", study, "--only", "agreement") == first
    done = masrel("report", study, "--cache", study / NOTES)
    assert (done.code, "is a file" in done.err) == (2, True)


@pytest.mark.slow
def test_a_full_disk_leaves_a_report(
    masrel: Caller, study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, _: object) -> None:
        raise OSError(28, "No space left on device", str(path))

    shutil.rmtree(study / NOTES)
    monkeypatch.setattr("masrel.lab.report._report_folder.write_file", full)
    assert masrel("report", study).code == 0
    assert (study / "report/report.html").is_file()


def test_a_report_that_another_build_has_replaced_is_made_again(
    masrel: Caller, study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    masrel("report", study, "--only", "grades")
    grades = contents(study / "report")
    masrel("report", study, "--only", "agreement")
    agreement = contents(study / "report")
    shutil.rmtree(study / "report")
    write = verb.replace_report

    def with_another(folder: Path, files: dict[str, bytes]) -> None:
        write(folder, files)
        write(folder, grades)  # in the moment after

    monkeypatch.setattr(verb, "replace_report", with_another)
    masrel("report", study, "--only", "agreement")
    assert contents(study / "report") == grades
    monkeypatch.setattr(verb, "replace_report", write)
    masrel("report", study, "--only", "agreement")
    assert contents(study / "report") == agreement


def test_check_names_what_would_change_and_writes_nothing(
    masrel: Caller, study: Path
) -> None:
    done = masrel("report", study, "--check")
    assert done.code == 1
    assert f"{study}/report/report.html: would be new\n" in done.out
    masrel("report", study)
    shutil.rmtree(study / NOTES)  # as in a clone
    before = times(study)
    done = masrel("report", study, "--check")
    assert (done.code, done.out) == (0, "")
    assert times(study) == before
    done = masrel("report", study, "--check", "--require", "kappa.n >= 9")
    assert (done.code, done.out) == (1, "")
    assert "fails: 4" in done.err
    edit(study / "ratings/published.csv", "1+", "1")
    done = masrel("report", study, "--check")
    assert done.code == 1
    assert f"{study}/report/figures/agreement.svg: would change\n" in done.out
    assert f"{study}/report/manifest.json: would change\n" in done.out


def test_only_makes_a_report_of_what_is_named(masrel: Caller, study: Path) -> None:
    masrel("report", study)
    assert masrel("report", study, "--only", "grades").code == 0
    names = contents(study / "report")
    assert "tables/grades_test.csv" in names
    assert "figures/agreement.svg" not in names
    text = (study / "report/report.md").read_text(encoding="utf-8")
    assert "## Grades" in text
    assert "## Agreement between raters" not in text
    done = masrel("report", study, "--only", "grade")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "--only: needs one of flow, conduct, agreement, grades, got" in done.err
