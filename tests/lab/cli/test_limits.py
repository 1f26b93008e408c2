"""Files that would fill the memory, hold a verb up or break a parser: one sentence."""

import hashlib
import io
import json
import os
import re
import signal
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from masrel.lab.protocol import copy_template
from masrel.lab.recording import RECORDING_COLUMNS
from tests.cli.process import Caller, Done


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """The small study, without schedules."""
    root = tmp_path / "study"
    copy_template("small", root)
    return root


def changed(study: Path, pattern: str, new: str) -> None:
    path = study / "protocol.toml"
    text, n_changed = re.subn(pattern, lambda _: new, path.read_text(), count=1)
    assert n_changed == 1
    path.write_text(text)


def refused(done: Done, words: str, most: int = 2) -> None:
    assert done.code == 2, done
    assert words in done.err
    assert len(done.err.splitlines()) <= most  # problems, and how many there are


def test_what_is_no_file_is_not_waited_for(
    study: Path, tmp_path: Path, masrel: Caller
) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    schedules = study / "schedules"
    schedules.mkdir(mode=0o700)
    schedule = schedules / "test_R1.csv"
    for odd in (pipe, Path("/dev/zero")):
        schedule.symlink_to(odd)
        refused(masrel("check", study), "not a regular file")
        schedule.unlink()
        refused(masrel("joint", "fit", odd), "not a regular file")
    refused(masrel("agree", "/dev/zero", "--target", "items"), "got a device")
    refused(masrel("joint", "between", "HM1", pipe, "-n", "1"), "not a regular file")
    log = study / "sessions" / "test_R1.jsonl"
    log.parent.mkdir()
    os.mkfifo(log)
    assert masrel("schedule", study).code == 2  # a session seems to have begun
    entry = '[[models]]\nid = "F1"\nrole = "dummy"\nfile = "/dev/zero"\n\n[[raters]]'
    changed(study, r"(?m)^\[\[raters\]\]$", entry)
    refused(masrel("check", study), "not a regular file", 3)
    (study / "protocol.toml").unlink()
    (study / "protocol.toml").symlink_to(pipe)
    refused(masrel("check", study), "not a regular file")


def bomb(path: Path, n_samples: int) -> None:
    # columns of zeros: some 7 kB for each MB
    header = io.BytesIO()
    form = {"descr": "<f8", "fortran_order": False, "shape": (n_samples,)}
    np.lib.format.write_array_header_1_0(header, form)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("time_s", "angle_deg", "command_torque_nm"):
            with archive.open(f"{name}.npy", "w") as file:
                file.write(header.getvalue())
                for _ in range(n_samples // 1_000_000):
                    file.write(bytes(8_000_000))


@pytest.mark.slow
def test_a_small_archive_of_large_columns(tmp_path: Path, masrel: Caller) -> None:
    bomb(tmp_path / "bomb.npz", 6_000_000)
    refused(
        masrel("joint", "fit", tmp_path / "bomb.npz"), "larger than 128000000 bytes"
    )
    bomb(tmp_path / "short.npz", 999_999)  # the header promises what is not there
    refused(masrel("joint", "fit", tmp_path / "short.npz"), "not an archive of columns")


DEEP = {
    "arrays": "x = " + "[" * 100_000,
    "tables": "x = " + "{a=" * 50_000,
    "dotted": ".".join(["a"] * 100_000) + " = 1",
    "closed": "x = " + "[" * 100 + "]" * 100,
}


@pytest.mark.parametrize("text", DEEP.values(), ids=DEEP.keys())
def test_deep_toml(text: str, study: Path, masrel: Caller) -> None:
    protocol = study / "protocol.toml"
    before = protocol.read_text()
    protocol.write_text(f"{text}\n{before}")
    refused(masrel("check", study), "nested")
    protocol.write_text(before)
    (study / "deep.toml").write_text(text)
    refused(masrel("joint", "between", "HM1", study / "deep.toml", "-n", "1"), "nested")


@pytest.mark.parametrize(
    ("pattern", "new", "words", "most"),
    [
        (r"(?m)^seed = .*$", f"seed = {'9' * 5000}", "needed valid TOML", 2),
        (r"(?m)^seed = .*$", f"seed = 0x{'f' * 5000}", "needed valid TOML", 2),
        (r"\Z", "#" * 1_000_000, "larger than 1000000 bytes", 2),
        (
            r"(?m)^raters = \[.*\]$",
            "raters = [" + '"R1", ' * 99_999 + '"R1"]',
            "there are more problems",
            202,
        ),
    ],
    ids=["digits", "bits", "megabyte", "list"],
)
def test_what_is_long_in_a_protocol(
    pattern: str, new: str, words: str, most: int, study: Path, masrel: Caller
) -> None:
    changed(study, pattern, new)
    refused(masrel("check", study), words, most)


def test_long_numbers_and_cells_of_other_files(study: Path, masrel: Caller) -> None:
    assert masrel("schedule", study).code == 0
    schedule = study / "schedules" / "test_R1.csv"
    whole = schedule.read_text()
    edits: list[Callable[[str], str]] = [
        lambda text: re.sub(r"# seed: .*", f"# seed: {'9' * 5000}", text),
        lambda text: f"{text}5,{'A' * 200_000},HM1,1\n",
        lambda text: f"{text}{'9' * 5000},ABC,HM1,1\n",
    ]
    for edit in edits:
        schedule.write_text(edit(whole))
        refused(masrel("check", study), str(schedule))
    schedule.write_text(whole)
    ratings = study / "ratings" / "ratings.csv"
    ratings.parent.mkdir()
    for row in (f"R1,HM1,1,{'9' * 5000}", f"R1,HM1,{'1' * 200_000},1"):
        ratings.write_text(f"rater,model,grade,repeat\n{row}\n")
        refused(masrel("check", study), str(ratings))


@pytest.mark.parametrize("size", [200_000, 65_000_000])
def test_a_table_beside_its_logs_that_is_one_long_cell(
    size: int, study: Path, masrel: Caller
) -> None:
    assert masrel("schedule", study).code == 0
    names = ("--rater", "R1", "--session", "test", "--grades", "simulated")
    assert masrel("run", study, *names, "--clock", "simulated", "--quiet").code == 0
    ratings = study / "ratings" / "ratings.csv"
    ratings.parent.mkdir()
    ratings.write_bytes(b"[" * size)
    for verb in ("verify", "analyze"):
        done = masrel(verb, study)
        assert done.code == 2
        assert str(ratings) in done.err.splitlines()[-1] or "broken" in done.err


@pytest.fixture
def linear() -> Iterator[None]:
    """End what takes the square of its size, which would be a minute or more."""

    def fail(*_: object) -> None:
        raise AssertionError("not in linear time")

    signal.signal(signal.SIGPROF, fail)
    signal.setitimer(signal.ITIMER_PROF, 20.0)  # of processor time; a second will do
    yield
    signal.setitimer(signal.ITIMER_PROF, 0.0)


@pytest.mark.usefixtures("linear")
@pytest.mark.parametrize(
    ("file", "text", "sentence", "most"),
    [
        (
            "ratings/ratings.csv",
            ",".join(f"c{i}" for i in range(200_000)) + "\n",
            "and 199960 more",
            2,
        ),
        (
            "ratings/ratings.csv",
            ",".join(["c"] * 200_000) + "\n",
            "and 199979 more",
            22,
        ),
        (
            "schedules/test_R1.csv",
            "".join(f"#{i}:\n" for i in range(120_000)),
            "test_R1.csv: line 1: needed '# key: value'",
            120_100,
        ),
    ],
    ids=["different names of columns", "one name", "keys of a head"],
)
def test_names_are_compared_in_linear_time(
    file: str,
    text: str,
    sentence: str,
    most: int,
    study: Path,
    masrel: Caller,
) -> None:
    (study / file).parent.mkdir(exist_ok=True)
    (study / file).write_text(text)
    refused(masrel("check", study), sentence, most)


@pytest.mark.usefixtures("linear")
def test_raters_of_a_session_are_compared_in_linear_time(
    study: Path, masrel: Caller
) -> None:
    names = ",".join(f'"{i:x}"' for i in range(60_000))
    text = (study / "protocol.toml").read_text()
    assert 'raters = ["R1", "R2"]' in text
    text = text.replace('raters = ["R1", "R2"]', f"raters = [{names}]")
    (study / "protocol.toml").write_text(text)
    refused(masrel("check", study), "there are more problems", 202)


def test_deep_and_long_values_of_a_log(study: Path, masrel: Caller) -> None:
    assert masrel("schedule", study).code == 0
    log = study / "sessions" / "test_R1.jsonl"
    log.parent.mkdir(exist_ok=True)
    for value in ("[" * 100_000, "9" * 5000):
        log.write_text(f'{{"event": {value}\n')
        refused(masrel("ratings", study), "line 1: needed one JSON object")


def test_deep_facts_of_a_recording(tmp_path: Path, masrel: Caller) -> None:
    columns = {name: np.zeros(60) for name in RECORDING_COLUMNS}
    np.savez(tmp_path / "a.npz", **columns)
    (tmp_path / "a.json").write_text("[" * 100_000)
    motion = ("--motion", "recording", "--recording", tmp_path / "a.npz")
    refused(masrel("joint", "trace", "--model", "HM1", *motion), "nested too deep")


@pytest.mark.parametrize(
    ("field", "value"),
    [("mean_speed_deg_s", "fast"), ("stretches", 7), ("code", [{"a": 1}])],
)
def test_a_value_of_another_type_in_a_log(
    field: str, value: object, study: Path, masrel: Caller
) -> None:
    assert masrel("schedule", study).code == 0
    names = ("--rater", "R1", "--session", "test", "--grades", "simulated")
    assert masrel("run", study, *names, "--clock", "simulated", "--quiet").code == 0
    log = study / "sessions" / "test_R1.jsonl"
    previous, lines = "0" * 64, []
    for line in log.read_text().splitlines():
        event = {**json.loads(line), "previous": previous}
        if event["event"] == "presented":
            event["fields"][field] = value
        lines.append(json.dumps(event, ensure_ascii=False))
        previous = hashlib.sha256(lines[-1].encode()).hexdigest()
    log.write_text("\n".join(lines) + "\n")
    refused(masrel("ratings", study), f"needed another value of {field}")
