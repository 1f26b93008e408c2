"""Verbs that are killed, or whose disk is full, at each call that changes a file."""

import math
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from random import Random

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import MasrelError
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.ratings import read_study_data
from masrel.lab.verification import verify_study
from tests.cli.process import Caller
from tests.faults import Faults
from tests.files import edit
from tests.lab.authority import authority
from tests.lab.flow.conftest import run
from tests.lab.flow.cuts import (
    READY,
    Contents,
    Cuts,
    Syscall,
    called_before,
    check_links,
    check_old_or_new,
    commitment_of,
    events_and_contents,
    full_disk_at,
    killed_by_strace,
    masrel_command,
    run_ready,
    syscalls_on,
)

VERBS = ("init", "schedule", "ratings", "analyze", "report")
LOGGING = (
    *("note", "adverse-event", "withdraw", "exclude", "include", "set", "unblind"),
    *("enter", "amend", "day", "add", "unseal"),
)
RECORDING = (
    *("schedule", "seal", "amend", "day", "set", "add", "adverse-event", "stamp"),
    *("enter", "unseal", "merge"),
)
DRAWN_ON_THE_WAY = ("draw", "register")  # by a secret that is made then
OTHERS = (
    *(*LOGGING, "sheet", "checklist", "export", "merge", "seal", "stamp"),
    *DRAWN_ON_THE_WAY,
)


def to_init(root: Path, _: Path) -> None:
    root.mkdir()


def to_stamp(root: Path, study: Path) -> None:
    shutil.copytree(study, root / "study")


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
        for event in AT_SITES:
            run(*event.format(folder, rater).split())


def to_others(verb: str, root: Path, study: Path) -> None:
    without, edits, calls = BEFORE.get(verb, ((), FIELDS, ()))
    shutil.copytree(study, root, ignore=shutil.ignore_patterns(*without))
    for file, old, new in edits:
        edit(root / file, old, new, 1)
    for call in calls:
        run(*call.format(root).split())
    for typed in root.glob("sheets/*_R1.csv"):  # a grade at the end of each row
        typed.write_text(typed.read_text().replace(",\n", ",2\n"))


def in_protocol(*lines: str) -> tuple[tuple[str, str, str], ...]:
    """The edit that puts tables into a protocol."""
    return (("protocol.toml", "[report]", "\n".join([*lines, "[report]"])),)


FIELDS = in_protocol("[rater_fields.years]", 'type = "whole"')
SEALED = in_protocol("[blinding]", "sealed = true")
RETEST = in_protocol(
    *("[[sessions]]", 'id = "retest"', 'raters = ["R1"]', 'after = "test"'),
    *("at_least_days = 7", 'order_policy = "warn"'),
)
GATE = in_protocol("[[report.gates]]", 'require = "kappa.low >= 0.4"')
SECTIONS = (
    ("protocol.toml", "[report]", '[report]\nsections = ["grades", "intended"]'),
)
MADE = ("ratings", "a*.json")
DRAWN = ("sessions", "schedules", "*.jsonl", *MADE)
RUN = "run {{0}} --rater {} --session {} --grades simulated --quiet"
BY_R1, BY_R2, AGAIN = (
    RUN.format(*of) for of in (("R1", "test"), ("R2", "test"), ("R1", "retest"))
)
PRINT = "paper print {{0}} --rater R1 --session {}"
# What a study is without, what is put into its files, and what is called before
BEFORE: dict[
    str, tuple[tuple[str, ...], tuple[tuple[str, str, str], ...], tuple[str, ...]]
] = {
    # One schedule is stale and is drawn anew, one is there, one is not.
    "schedule": (
        ("test_*.jsonl", "test_R2.csv"),
        (("protocol.toml", "seed = ", "seed = 1"),),
        (),
    ),
    "ratings": ((), (("ratings/ratings.csv", ",simulated,", ",foreign,"),), ()),
    "analyze": ((), (("analysis.json", "{", "{ "),), ()),
    # Tables and figures of the new one differ from the old ones.
    "report": (
        (),
        SECTIONS,
        (
            "report {0} --quiet",
            "record correct {0} --rater R2 --session test --code 27B --grade 4 "
            "--who A --why b",
            "ratings {0}",
        ),
    ),
    "include": ((), (), ("record exclude {0} --rater R2 --who Kim --why ill",)),
    "amend": ((), GATE, ()),
    "day": ((), RETEST, ("schedule {0}", AGAIN)),
    "enter": ((), RETEST, ("schedule {0}", PRINT.format("retest"))),
    "draw": (("published*", *DRAWN), (), ()),
    "register": (("published*", *DRAWN), (), ()),
    "seal": (DRAWN, SEALED, ()),
    "run-sealed": (DRAWN, SEALED, ("schedule {0}", BY_R2)),
    "unseal": (DRAWN, SEALED, ("schedule {0}", BY_R1, BY_R2)),
    "run-paper": (("*_R1.jsonl", "test_R1", *MADE), (), (PRINT.format("test"),)),
}
AT_SITES = (
    "record note {0} here --who Kim",
    "record day {0} --rater {1} --session test --on 2024-05-01 --who Kim --why misread",
    "record adverse-event {0} ill --on 2024-05-02 --onset 2024-05-01 --who Kim",
    "record amend {0} --who Kim --why shorter",
    "record rater add {0} --rater {1}b --session test --who Kim",
)
PREPARE: dict[str, Callable[[Path, Path], None]] = {
    "init": to_init,
    "merge": to_merge,
    "stamp": to_stamp,
}
CALLS = {
    "schedule": "schedule {0} --redraw",
    "report": "report {0} --quiet",
    "draw": "schedule {0}",
    "seal": "schedule {0}",
    "note": "record note {0} power-cut --who Kim",
    "adverse-event": "record adverse-event {0} fainted --who Kim --rater R1 "
    "--on 2024-05-02 --onset 2024-05-01",
    "amend": "record amend {0} --who Kim --why asked",
    "day": "record day {0} --rater R1 --session test --on 2024-05-01 --who Kim "
    "--why misread",
    "add": "record rater add {0} --rater R3 --session test years=3 --who Kim",
    "register": "record register {0} -o {0}/plan.json",
    "unseal": "record unblind {0} --all --who Kim --why end",
    "stamp": "verify {0}/study --anchor {0}/kept.txt --stamp {1}",
    "run-paper": "run {0} --rater R1 --session test --grades paper --clock simulated",
    "run-sealed": BY_R1,
    "withdraw": "record withdraw {0} --rater R2 --who Kim --why left --on 2024-05-01",
    "exclude": "record exclude {0} --rater R2 --who Kim --why ill",
    "include": "record include {0} --rater R2 --who Kim --why well",
    "set": "record rater {0} --rater R2 years=12 --who Kim",
    "unblind": "record unblind {0} --all --who Kim --why end",
    "enter": "paper enter {0} {0}/sheets/retest_R1.csv --rater R1 --session retest "
    "--who Kim --on 2024-05-08",
    "sheet": "paper print {0}",
    "checklist": "checklist {0} --guideline grras -o {0}/grras.html",
    "export": "export {0} --as bids -o {0}/bids --quiet",
    "merge": "merge {0}/north {0}/south -o {0}/both",
}


# What makes sessions that were run whole: the sheet is entered, all is unsealed
THEN = {
    "run-paper": "paper enter {0} {0}/sheets/test_R1.csv --rater R1 --session test "
    "--who Kim",
    "run-sealed": CALLS["unseal"],
}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of an authority that stamps times."""
    with authority(tmp_path_factory.mktemp("authority")) as (address, _):
        yield address


@pytest.fixture
def prepared(
    small_demo: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> Callable[[str], tuple[Path, list[str]]]:
    """Makes a study for a verb, and gives its folder and the call."""

    def make(verb: str) -> tuple[Path, list[str]]:
        root = tmp_path / verb
        PREPARE.get(verb, partial(to_others, verb))(root, small_demo / "study")
        address = request.getfixturevalue("service") if verb == "stamp" else None
        return root, CALLS.get(verb, f"{verb} {{0}}").format(root, address).split()

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
    assert events_and_contents(root) != cuts.before
    assert len(cuts.left) >= 5
    assert not list(root.rglob(".masrel-*"))
    assert events_and_contents(root) == cuts.left[-1]  # a sync comes last


@pytest.mark.parametrize("verb", ["init", "schedule", "ratings"])
def test_a_full_disk_at_any_call_is_said_with_the_file(
    verb: str, prepared: Prepared, masrel: Caller, tmp_path: Path
) -> None:
    root, call = prepared(verb)
    kept = tmp_path / "kept"
    shutil.copytree(root, kept)
    before = events_and_contents(root)
    with full_disk_at(0) as calls:
        assert masrel(*call).code == 0
    after = events_and_contents(root)
    places = range(1, len(calls) + 1)
    for place in Random(7).sample(places, min(10, len(places))):
        shutil.rmtree(root)
        shutil.copytree(kept, root)
        with full_disk_at(place):
            done = masrel(*call)
        assert done.code == 2
        check_disk_is_said_full(root, done.err)
        check_old_or_new(before, [events_and_contents(root)], after)


def check_disk_is_said_full(root: Path, err: str) -> None:
    *notes, said = err.splitlines()
    assert all(note.startswith(("note: ", "read: ", "anchors: ")) for note in notes)
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

    @property
    def name(self) -> str:
        """What is called, of a command with several rows."""
        return CALLS.get(self.verb, self.verb).partition(" {0}")[0]

    def restore(self) -> None:
        shutil.rmtree(self.root)
        shutil.copytree(self.kept, self.root)

    def seen(self) -> Contents:
        """The files; of what is drawn on the way, or stamped, only that it is there."""
        there = events_and_contents(self.root)
        drawn = (".key", "schedules") if self.verb in DRAWN_ON_THE_WAY else ()
        for path in there:
            if path.startswith(drawn) or path.endswith(".tsr"):
                there[path] = "made"
        if (plan := self.root / "plan.json").exists():
            there[plan.name] = str(commitment_of(self.root) in plan.read_text())
        return there

    def finished(self) -> Contents:
        """What is rated in the end, whatever the way to it."""
        run(*THEN[self.verb].format(self.root).split())
        study = StudyPaths(self.root)
        assert verify_study(study).is_whole
        table = read_study_data(study, read_protocol(study.protocol)).ratings.table
        return {"": table.drop(columns=["graded_at", "n_attempts"]).to_csv()}

    def check(self) -> None:
        """All files are old or new, and the same call again makes all of them new."""
        left = self.seen()
        is_session = self.verb in THEN
        check_old_or_new(self.before, [left], left if is_session else self.after)
        check_links(self.root)
        is_made = (self.root / "protocol.toml").exists()
        if self.verb == "init" and is_made:  # which is not made again
            assert left == self.after
            return
        again = CliRunner().invoke(cli, self.call, input=READY)
        if left == self.after and self.verb in OTHERS:
            # it is recorded once more, or refused as recorded before
            check_old_or_new(left, [left], self.seen())
            assert isinstance(again.exception, SystemExit | MasrelError | None)
        else:
            assert again.exit_code == 0, again.output
            assert (self.finished() if is_session else self.seen()) == self.after
        if self.verb in DRAWN_ON_THE_WAY:
            run("check", str(self.root))  # orders are those that the secret draws


@pytest.fixture
def traced(prepared: Prepared, tmp_path: Path) -> Callable[[str], Traced]:
    """Makes a study for a verb, and follows the verb."""
    if shutil.which("strace") is None:
        pytest.skip("needs strace: it kills the process at a call of the system")

    def make(verb: str) -> Traced:
        root, call = prepared(verb)
        traced = Traced(verb, root, tmp_path / "kept", call)
        traced.before = traced.seen()
        shutil.copytree(root, traced.kept)
        command = masrel_command(*call)
        traced.syscalls = syscalls_on(root, tmp_path / "log", command)
        traced.after = traced.finished() if verb in THEN else traced.seen()
        assert traced.after != traced.before
        return traced

    return make


def some(syscalls: list[Syscall], share: float) -> list[Syscall]:
    """Return a seeded share of them, two at most, or all."""
    n = len(syscalls) if share == 1 else min(2, math.ceil(share * len(syscalls)))
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
            for verb in (*VERBS, *OTHERS, *THEN)
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
        kind = f"`{made.name}` killed at a system call that changes a file"
        with faults(kind):
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
        kind = f"`{made.name}` with a full disk at a system call that needs space"
        with faults(kind):
            done = syscall.inject("error=ENOSPC", masrel_command(*made.call))
            if verb == "report" and done.returncode == 0:  # of its cache alone
                assert events_and_contents(made.root) == made.after
            else:
                assert done.returncode == 2, done.stderr
                check_disk_is_said_full(made.root, done.stderr)
            made.check()


@pytest.mark.parametrize(
    ("verb", "n_kills"),
    [
        *(pytest.param(verb, 2, marks=pytest.mark.slow) for verb in ("add", "unseal")),
        *(
            pytest.param(verb, 20, marks=[pytest.mark.long, pytest.mark.faults])
            for verb in (*RECORDING, *DRAWN_ON_THE_WAY, *THEN)
        ),
    ],
)
def test_a_kill_at_a_random_moment_of_what_draws_records_or_runs(
    verb: str, n_kills: int, prepared: Prepared, tmp_path: Path, faults: Faults
) -> None:
    root, call = prepared(verb)
    copies = [tmp_path / f"copy{n}" for n in range(n_kills + 1)]
    for copy in copies:
        shutil.copytree(root, copy)
    calls = [[part.replace(str(root), str(copy)) for part in call] for copy in copies]
    template = " ".join(call).replace(str(root), "{0}")
    command = [sys.executable, "-m", "tests.lab.run.kill_at", "call", "5", template]
    done = run_ready([*command, *map(str, copies)])
    assert done.returncode == 0, done.stderr
    kept = Traced(verb, root, root, call)
    whole = Traced(verb, copies[0], root, calls[0])
    after = whole.finished() if verb in THEN else whole.seen()
    for copy, its_call in zip(copies[1:], calls[1:], strict=True):
        with faults("a draw, an event or a session killed at random, and called again"):
            made = Traced(verb, copy, root, its_call, before=kept.seen(), after=after)
            made.check()
