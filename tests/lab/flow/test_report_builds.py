"""A report is what a build without a cache writes: edited, killed, built twice."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from masrel.lab.report._report_folder import NOTES
from tests.cli.process import Caller, Done
from tests.faults import Faults
from tests.lab.flow.conftest import run
from tests.lab.flow.cuts import check_links, contents

SECTIONS = ("design", "grades", "agreement", "intended", "test-retest", "methods")


@pytest.fixture
def study(small_demo: Path, tmp_path: Path) -> Path:
    """A small study that was run, with a note and without its report."""
    root = Path(shutil.copytree(small_demo / "study", tmp_path / "study"))
    shutil.rmtree(root / "report", ignore_errors=True)
    shutil.rmtree(root / NOTES, ignore_errors=True)
    run("record", "note", str(root), "Begun.", "--who", "A. B.")
    return root


class Edits:
    """Random edits of all that a report is made from, one after the other."""

    def __init__(self, study: Path, site: Path, seed: int) -> None:
        self.study, self.site, self.random = study, site, random.Random(seed)
        self.protocol = (study / "protocol.toml").read_text(encoding="utf-8")
        table = study / "ratings/ratings.csv"
        self.rows = table.read_text(encoding="utf-8").splitlines()
        table.unlink()  # it would be refused whenever a log says something else
        self.table = study.with_name("ratings.csv")
        self.log = sorted((study / "sessions").glob("*.jsonl"))[0]
        self.log_bytes = self.log.read_bytes()
        self.options: list[str] = []

    def one(self) -> None:
        """Change something, or nothing."""
        kinds: tuple[Callable[[], None], ...] = (
            *(self.of_protocol, self.of_ratings, self.of_options) * 3,
            *(self.of_log, self.of_conduct, self.of_version, self.nothing),
        )
        self.random.choice(kinds)()

    def of_protocol(self) -> None:
        """Other sections, seed, level or title."""
        named = self.random.sample(SECTIONS, self.random.randint(1, 3))
        text = self.protocol.partition("[report]")[0]
        text += f"[report]\nsections = {json.dumps(named)}\n"
        lines = text.splitlines()
        for key in ("seed", "title", "level"):
            if self.random.random() < 0.3:
                value = {"title": '"T %d"', "level": "0.9%d"}.get(key, "%d")
                made = f"{key} = {value % self.random.randint(1, 5)}"
                places = [n for n, x in enumerate(lines) if x.startswith(f"{key} =")]
                for place in places:
                    lines[place] = made
        text = "\n".join(lines) + "\n"
        (self.study / "protocol.toml").write_text(text, encoding="utf-8")

    def of_ratings(self) -> None:
        """Another grade in a table that is named."""
        rows = list(self.rows)
        for _ in range(self.random.randint(0, 2)):
            place = self.random.randrange(len(rows))
            old, new = self.random.sample([",0,", ",1,", ",1+,", ",2,"], 2)
            rows[place] = rows[place].replace(old, new)
        self.table.write_text("\n".join(rows) + "\n", encoding="utf-8")

    def of_options(self) -> None:
        """Other options."""
        options = (
            ["--ratings", str(self.table)],
            *(["--raw-csv"], ["--include", "notes"], ["--only", "grades"]),
            ["--require", "kappa.value >= 0.3"],
        )
        chosen = self.random.sample(options, self.random.randint(0, 2))
        self.options = [text for option in chosen for text in option]

    def of_log(self) -> None:
        """A session log that is there, is not there, or lacks its last line."""
        data = self.random.choice(
            (self.log_bytes, None, self.log_bytes[: self.log_bytes[:-1].rfind(b"\n")])
        )
        self.log.unlink(missing_ok=True)
        if data is not None:
            self.log.write_bytes(data + b"\n" * (not data.endswith(b"\n")))

    def of_conduct(self) -> None:
        """One more event."""
        run(
            "record",
            "note",
            str(self.study),
            f"{self.random.random()}",
            "--who",
            "A. B.",
        )

    def of_version(self) -> None:
        """Another version of a library."""
        shutil.rmtree(self.site, ignore_errors=True)
        name = self.random.choice(("matplotlib", "jinja2", "numpy", "other"))
        (self.site / f"{name}-{self.random.randint(1, 3)}.0.dist-info").mkdir(
            parents=True
        )

    def nothing(self) -> None:
        """Leave all as it is."""


def built(masrel: Caller, edits: Edits, folder: Path, cache: Path) -> Done:
    if not edits.table.exists():
        edits.of_ratings()
    options = ("-o", folder, "--cache", cache, "--quiet", *edits.options)
    return masrel("report", edits.study, *options)


@pytest.mark.parametrize(
    ("seed", "n_edits"),
    [
        pytest.param(1, 12, marks=pytest.mark.slow),
        pytest.param(2, 1000, marks=pytest.mark.long),
    ],
)
def test_no_edit_leaves_a_stale_report(
    masrel: Caller,
    study: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    seed: int,
    n_edits: int,
) -> None:
    monkeypatch.setattr(sys, "path", [str(tmp_path / "site"), *sys.path])
    edits = Edits(study, tmp_path / "site", seed)
    edits.of_protocol()
    cold, warm = tmp_path / "cold" / "report", tmp_path / "warm" / "report"
    n_built = 0
    for number in range(n_edits):
        edits.one()
        done = built(masrel, edits, warm, tmp_path / "cache")
        shutil.rmtree(cold.parent, ignore_errors=True)
        needed = built(masrel, edits, cold, cold.parent / "cache")
        assert done.code == needed.code, (number, done, needed)
        assert done.err == needed.err, number
        if cold.exists():
            n_built += 1
            assert contents(warm) == contents(cold), number
    assert n_built > 0.5 * n_edits


class Builder:
    """Builds reports in processes that can be killed."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def __call__(self, *calls: tuple[object, ...], after_s: float | None) -> list[int]:
        """Begin calls at once, kill them after so long; how each ended."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        texts = [list(map(str, call)) for call in calls]
        self._process.stdin.write(json.dumps([texts, after_s]) + "\n")
        self._process.stdin.flush()
        ends: list[int] = json.loads(self._process.stdout.readline())
        return ends


@pytest.fixture
def builder(study: Path) -> Iterator[Builder]:
    """A process that builds and kills."""
    script = Path(__file__).with_name("report_builder.py")
    with subprocess.Popen(
        [sys.executable, str(script), str(study)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},  # no threads in a fork
    ) as process:
        yield Builder(process)


@pytest.mark.parametrize(
    "n_kills",
    [
        pytest.param(8, marks=pytest.mark.slow),
        pytest.param(200, marks=[pytest.mark.long, pytest.mark.faults]),
    ],
)
def test_a_kill_leaves_whole_pages_with_what_they_link_to(
    builder: Builder, study: Path, tmp_path: Path, n_kills: int, faults: Faults
) -> None:
    chance = random.Random(3)
    edits = Edits(study, tmp_path / "site", 4)
    folder, cache = tmp_path / "report", tmp_path / "cache"
    states = []
    for sections in ('["grades", "agreement"]', '["agreement", "methods"]'):
        text = edits.protocol.partition("[report]")[0]
        states.append(f"{text}[report]\nsections = {sections}\n")
    call = (study, "-o", folder, "--cache", cache)

    def begin(state: str, *, cold: bool) -> None:
        (study / "protocol.toml").write_text(state, encoding="utf-8")
        if cold:
            shutil.rmtree(cache, ignore_errors=True)

    needed, lasts_s, n_killed = [], {}, 0
    for cold in (True, False):
        for state in states:
            begin(state, cold=cold)
            begun = time.perf_counter()
            assert builder(call, after_s=None) == [0]
            lasts_s[cold] = time.perf_counter() - begun
            needed.append(contents(folder))
    assert needed[:2] == needed[2:]
    for number in range(n_kills):
        cold = number % 4 == 0
        begin(states[number % 2], cold=cold)
        with faults("a report's build killed"):
            end = builder(call, after_s=chance.uniform(0, lasts_s[cold]))
            n_killed += end == [-signal.SIGKILL]
            check_links(folder)
            left = contents(folder)
            for page in ("report.html", "report.md", "analysis.json", "manifest.json"):
                assert left[page] in [each[page] for each in needed]
            if number % 8 == 7:
                assert builder(call, after_s=None) == [0]
                assert contents(folder) == needed[number % 2]
    assert n_killed > n_kills // 3


@pytest.mark.slow
def test_two_builds_at_once_leave_one_whole_report(
    builder: Builder, study: Path, tmp_path: Path
) -> None:
    folder, cache = tmp_path / "report", tmp_path / "cache"
    calls = [
        (study, "-o", folder, "--cache", cache, *options)
        for options in (("--only", "grades"), ("--only", "agreement"))
    ]
    needed = []
    for call in calls:
        assert builder(call, after_s=None) == [0]
        needed.append(contents(folder))
    for number in range(6):
        if number % 3 == 0:
            shutil.rmtree(cache)
        shutil.rmtree(folder)
        assert builder(*calls, after_s=None) == [0, 0]
        assert contents(folder) in needed
        check_links(folder)
        assert builder(calls[number % 2], after_s=None) == [0]
        assert contents(folder) == needed[number % 2]
