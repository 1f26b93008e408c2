"""Verbs that are killed, or whose disk is full, at each call that changes a file."""

import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import MasrelError
from tests.cli.process import Caller
from tests.faults import Faults
from tests.lab.flow.conftest import run
from tests.lab.flow.cuts import (
    Contents,
    Cuts,
    Syscall,
    called_before,
    check_links,
    check_old_or_new,
    contents,
    events_and_contents,
    full_disk_at,
    killed_by_strace,
    masrel_command,
    syscalls_on,
)

VERBS = ("init", "schedule", "ratings", "analyze", "report")
LOGGING = ("note", "withdraw", "exclude", "include", "set", "unblind", "enter")
OTHERS = (*LOGGING, "sheet", "checklist", "export", "merge")


def to_init(root: Path, _: Path) -> None:
    root.mkdir()


def to_schedule(root: Path, study: Path) -> None:
    # One schedule is stale and is drawn anew, one is there, one is not.
    shutil.copytree(study, root)
    for log in (root / "sessions").glob("*.jsonl"):
        log.unlink()
    protocol = root / "protocol.toml"
    text = protocol.read_text()
    assert "seed = " in text
    protocol.write_text(text.replace("seed = ", "seed = 1", 1))
    next(iter((root / "schedules").glob("*_R2.csv"))).unlink()


def to_ratings(root: Path, study: Path) -> None:
    shutil.copytree(study, root)
    ratings = root / "ratings" / "ratings.csv"
    ratings.write_text(ratings.read_text().replace(",simulated,", ",foreign,"))


def to_analyze(root: Path, study: Path) -> None:
    shutil.copytree(study, root)
    (root / "analysis.json").write_text("{}\n")


def to_report(root: Path, study: Path) -> None:
    # Tables and figures of the new one differ from the old ones.
    shutil.copytree(study, root)
    protocol = root / "protocol.toml"
    text = protocol.read_text().partition("[report]")[0]
    protocol.write_text(f'{text}[report]\nsections = ["grades", "intended"]\n')
    run("report", str(root), "--quiet")
    sheet = root / "schedules" / "test_R2_sheet.csv"
    code = sheet.read_text().splitlines()[-1].split(",")[1]
    where = (str(root), "--rater", "R2", "--session", "test")
    by = ("--who", "A", "--why", "b")
    run("record", "correct", *where, "--code", code, "--grade", "4", *by)
    run("ratings", str(root))


def to_log(root: Path, study: Path) -> None:
    shutil.copytree(study, root)
    with (root / "protocol.toml").open("a", encoding="utf-8") as protocol:
        protocol.write('\n[rater_fields.years]\ntype = "whole"\n')


def to_include(root: Path, study: Path) -> None:
    to_log(root, study)
    run("record", "exclude", str(root), "--rater", "R2", *BY)


def to_enter(root: Path, study: Path) -> None:
    shutil.copytree(study, root)
    shutil.rmtree(root / "sessions")
    run("paper", "print", str(root))
    typed = root / "sheets" / "test_R1.csv"
    # a grade after the last comma of each row
    typed.write_text(typed.read_text().replace(",\n", ",2\n"))


def to_merge(root: Path, study: Path) -> None:
    # two sites with one rater each
    for site, rater, other in (("north", "R1", "R2"), ("south", "R2", "R1")):
        folder = root / site
        shutil.copytree(study, folder)
        for made in (*folder.glob("ratings/*.csv"), folder / "analysis.json"):
            made.unlink()
        protocol = folder / "protocol.toml"
        text = protocol.read_text(encoding="utf-8").partition("[[analysis.est")[0]
        text = f'{text}[report]\nsections = ["grades"]\n'
        text = text.replace('raters = ["R1", "R2"]', f'raters = ["{rater}"]')
        protocol.write_text(text, encoding="utf-8")
        shutil.rmtree(folder / "sessions" / f"test_{other}")
        for path in folder.glob(f"*/test_{other}*"):
            path.unlink()
        run("record", "note", str(folder), f"the note of {site}", "--who", "Kim")


BY = ("--who", "Kim", "--why", "for a test")
PREPARE: dict[str, Callable[[Path, Path], None]] = {
    "init": to_init,
    "schedule": to_schedule,
    "ratings": to_ratings,
    "analyze": to_analyze,
    "report": to_report,
    **dict.fromkeys(OTHERS, to_log),
    "include": to_include,
    "enter": to_enter,
    "merge": to_merge,
}
CALLS = {
    "schedule": "schedule {0} --redraw",
    "report": "report {0} --quiet",
    "note": "record note {0} power-cut --who Kim",
    "withdraw": "record withdraw {0} --rater R2 --who Kim --why left",
    "exclude": "record exclude {0} --rater R2 --who Kim --why ill",
    "include": "record include {0} --rater R2 --who Kim --why well",
    "set": "record rater {0} --rater R2 years=12 --who Kim",
    "unblind": "record unblind {0} --all --who Kim --why end",
    "enter": "paper enter {0} {0}/sheets/test_R1.csv --rater R1 --session test "
    "--who Kim --on 2026-03-02",
    "sheet": "paper print {0}",
    "checklist": "checklist {0} --guideline grras -o {0}/grras.html",
    "export": "export {0} --as bids -o {0}/bids --quiet",
    "merge": "merge {0}/north {0}/south -o {0}/both",
}


@pytest.fixture
def prepared(
    small_demo: Path, tmp_path: Path
) -> Callable[[str], tuple[Path, list[str]]]:
    """Makes a study for a verb, and gives its folder and the call."""

    def make(verb: str) -> tuple[Path, list[str]]:
        root = tmp_path / verb
        PREPARE[verb](root, small_demo / "study")
        return root, CALLS.get(verb, f"{verb} {{0}}").format(root).split()

    return make


Prepared = Callable[[str], tuple[Path, list[str]]]


@pytest.mark.parametrize("verb", VERBS)
def test_a_kill_at_any_call_leaves_old_bytes_or_new_ones(
    verb: str, prepared: Prepared
) -> None:
    root, call = prepared(verb)
    cuts = Cuts(root)
    with called_before(cuts.look):
        run(*call)
    cuts.check()
    assert contents(root) != cuts.before
    assert len(cuts.left) >= 5
    assert not list(root.rglob(".masrel-*"))
    assert contents(root) == cuts.left[-1]  # what comes last is a sync of the folder


@pytest.mark.parametrize("verb", ["init", "schedule", "ratings"])
def test_a_full_disk_at_any_call_is_said_with_the_file(
    verb: str, prepared: Prepared, masrel: Caller, tmp_path: Path
) -> None:
    root, call = prepared(verb)
    kept = tmp_path / "kept"
    shutil.copytree(root, kept)
    before = contents(root)
    with full_disk_at(0) as calls:
        assert masrel(*call).code == 0
    after = contents(root)
    places = range(1, len(calls) + 1)
    for place in Random(7).sample(places, min(10, len(places))):
        shutil.rmtree(root)
        shutil.copytree(kept, root)
        with full_disk_at(place):
            done = masrel(*call)
        assert done.code == 2
        check_disk_is_said_full(root, done.err)
        check_old_or_new(before, [contents(root)], after)


def check_disk_is_said_full(root: Path, err: str) -> None:
    *notes, said = err.splitlines()
    assert all(note.startswith(("note: ", "read: ")) for note in notes)
    assert "No space left on device" in said
    assert str(root) in said
    assert ".masrel-" not in said
    assert not list(root.rglob(".masrel-*"))


@dataclass
class Traced:
    """A verb whose calls of the system are known, and the study that it is for."""

    verb: str
    root: Path
    kept: Path
    call: list[str]
    syscalls: list[Syscall] = field(default_factory=list)
    before: Contents = field(default_factory=dict)
    after: Contents = field(default_factory=dict)

    def restore(self) -> None:
        shutil.rmtree(self.root)
        shutil.copytree(self.kept, self.root)

    def check(self) -> None:
        """All files are old or new, and the same call again makes all of them new."""
        left = events_and_contents(self.root)
        check_old_or_new(self.before, [left], self.after)
        check_links(self.root)
        is_made = (self.root / "protocol.toml").exists()
        if self.verb == "init" and is_made:  # which is not made again
            assert left == self.after
            return
        again = CliRunner().invoke(cli, self.call)
        if left == self.after and self.verb in OTHERS:
            # it is recorded once more, or refused as recorded before
            check_old_or_new(left, [left], events_and_contents(self.root))
            assert isinstance(again.exception, SystemExit | MasrelError | None)
        else:
            assert again.exit_code == 0, again.output
            assert events_and_contents(self.root) == self.after


@pytest.fixture
def traced(prepared: Prepared, tmp_path: Path) -> Callable[[str], Traced]:
    """Makes a study for a verb, and follows the verb."""
    if shutil.which("strace") is None:
        pytest.skip("needs strace: it kills the process at a call of the system")

    def make(verb: str) -> Traced:
        root, call = prepared(verb)
        traced = Traced(verb, root, tmp_path / "kept", call)
        traced.before = events_and_contents(root)
        shutil.copytree(root, traced.kept)
        command = masrel_command(*call)
        traced.syscalls = syscalls_on(root, tmp_path / "log", command)
        traced.after = events_and_contents(root)
        assert traced.after != traced.before
        return traced

    return make


def some(syscalls: list[Syscall], share: float) -> list[Syscall]:
    """Return a seeded share of them, four at most, or all."""
    n = len(syscalls) if share == 1 else min(4, math.ceil(share * len(syscalls)))
    return Random(11).sample(syscalls, n)


EVERY = pytest.mark.parametrize(
    ("verb", "share"),
    [
        *(
            pytest.param(verb, 0.1, marks=pytest.mark.slow)
            for verb in (*VERBS, "note", "merge")
        ),
        *(
            pytest.param(verb, 1.0, marks=[pytest.mark.long, pytest.mark.faults])
            for verb in (*VERBS, *OTHERS)
        ),
    ],
)


@EVERY
def test_a_kill_at_every_system_call(
    verb: str, share: float, traced: Callable[[str], Traced], faults: Faults
) -> None:
    made = traced(verb)
    for syscall in some(made.syscalls, share):
        made.restore()
        with faults(f"`{verb}` killed at a system call that changes a file"):
            killed_by_strace(syscall, masrel_command(*made.call))
            made.check()


@EVERY
def test_a_full_disk_at_every_system_call(
    verb: str, share: float, traced: Callable[[str], Traced], faults: Faults
) -> None:
    made = traced(verb)
    needs_space = [syscall for syscall in made.syscalls if syscall.needs_space]
    for syscall in some(needs_space, share):
        made.restore()
        with faults(f"`{verb}` with a full disk at a system call that needs space"):
            done = syscall.inject("error=ENOSPC", masrel_command(*made.call))
            if verb == "report" and done.returncode == 0:  # of its cache alone
                assert events_and_contents(made.root) == made.after
            else:
                assert done.returncode == 2, done.stderr
                check_disk_is_said_full(made.root, done.stderr)
            made.check()
