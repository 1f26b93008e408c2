"""What once went wrong with a record, done again as a user would."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import pytest

from tests.cli.process import Caller, Done
from tests.faults import Faults
from tests.lab.flow.cuts import Syscall, masrel_command
from tests.lab.run.conftest import PROTOCOL

PLAN = """
[report]
sections = ["design", "test-retest"]

[[analysis.estimates]]
id = "back"
kind = "test-retest"
coefficient = "stratified_kappa"
models = "all"
sessions = ["test", "retest"]
target = "raters"
interval = "auto"
"""


@dataclass(frozen=True, slots=True)
class Bench:
    """A complete small study, and the command line."""

    study: Path
    masrel: Caller

    def __call__(self, verb: str, *options: object, code: int = 0) -> Done:
        done = self.masrel(*verb.split(), self.study, *options)
        assert done.code == code, done
        assert "Traceback" not in done.err
        return done

    def edit(self, name: str, old: str, new: str) -> None:
        path = self.study / name
        text = path.read_text(encoding="utf-8")
        assert old in text, (name, old)
        path.write_text(text.replace(old, new, 1), encoding="utf-8")


def a_file_system_without_locks(bench: Bench) -> None:
    # it is said, and not taken for another process
    if shutil.which("strace") is None:
        pytest.skip("needs strace: it lets a call of the system fail")
    bench("record note", "before", "--who", "Kim")
    command = masrel_command("record", "note", bench.study, "power cut", "--who", "Kim")
    done = Syscall("flock", 1).inject("error=ENOLCK", command)
    assert done.returncode == 2
    assert "another process" not in done.stderr
    assert f"{bench.study / 'conduct.jsonl'}: No locks available" in done.stderr


def a_grade_off_the_scale_on_a_sheet(bench: Bench) -> None:
    bench("paper print")
    for sheet, row in (("schedules/test_R2_sheet.csv", 4), ("sheets/test_R1.csv", 3)):
        path = bench.study / sheet
        lines = path.read_text().splitlines(keepends=True)
        lines[row - 1] = lines[row - 1].replace("\n", "9\n")
        path.write_text("".join(lines))
        said = bench("check", code=2).err
        assert f"{path}: row {row}: grade: needed one of 0, 1, 1+, 2, 3, 4" in said
        lines[row - 1] = lines[row - 1].replace("9\n", "1+\n")
        path.write_text("".join(lines))
    bench("check")


def a_plan_that_no_study_answers(bench: Bench) -> None:
    bench.edit("protocol.toml", 'target = "items"', 'target = "raters"')
    said = bench("check", code=2).err
    assert "analysis.estimates[0]: has no estimate even once every rating" in said
    assert said.count("analysis.estimates[") == 1


REPRODUCERS: dict[str, Callable[[Bench], None]] = {
    name: made
    for name, made in list(globals().items())
    if getattr(made, "__annotations__", {}).get("bench") is Bench
}


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.parametrize("name", REPRODUCERS)
def test_what_once_went_wrong(
    name: str, small_demo: Path, tmp_path: Path, masrel: Caller, faults: Faults
) -> None:
    shutil.copytree(small_demo / "study", tmp_path / "study")
    protocol = tmp_path / "study" / "protocol.toml"
    text = protocol.read_text(encoding="utf-8").partition("[report]")[0]
    protocol.write_text(f'{text}[report]\nsections = ["grades"]\n', encoding="utf-8")
    with faults("what once went wrong with a record, done again"):
        REPRODUCERS[name](Bench(tmp_path / "study", masrel))


@pytest.mark.long
@pytest.mark.faults
def test_every_part_of_a_study_under_way_is_reported(
    tmp_path: Path, masrel: Caller, faults: Faults
) -> None:
    study, kept = tmp_path / "study", tmp_path / "kept"
    study.mkdir()
    raters = ("R1", "R2", "R3")
    text = re.sub(r"(?m)^raters = .*$", f"raters = {json.dumps(raters)}", PROTOCOL)
    text = text.replace("[[sessions]]", '[[raters]]\nid = "R3"\n\n[[sessions]]', 1)
    (study / "protocol.toml").write_text(text + PLAN, encoding="utf-8")
    assert masrel("schedule", study).code == 0
    for session, rater in product(("test", "retest"), raters):
        names = ("--rater", rater, "--session", session, "--grades", "simulated")
        assert masrel("run", study, *names, "--quiet").code == 0
    (study / "sessions").rename(kept)
    for finished in range(1, 2 ** (2 * len(raters))):
        shutil.copytree(kept, study / "sessions")
        for bit, log in enumerate(sorted((study / "sessions").glob("*.jsonl"))):
            if not finished >> bit & 1:
                shutil.rmtree(log.with_suffix(""))
                log.unlink()
        (study / "ratings" / "ratings.csv").unlink(missing_ok=True)
        with faults("an interim report: each subset of finished sessions"):
            for verb in ("analyze", "ratings", "report"):
                done = masrel(verb, study)
                assert done.code == 0, (finished, done)
            (cell,) = json.loads((study / "analysis.json").read_bytes())["estimates"]
            value = (cell["estimate"] or {}).get("value")
            assert value is not None or "reason" in json.dumps(cell)
        shutil.rmtree(study / "sessions")
