"""A report that is killed while it is built, or built twice at once."""

import random
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.faults import Faults
from tests.lab.flow.conftest import run
from tests.lab.flow.cuts import NOTES, check_links, contents, masrel_command


@pytest.fixture
def study(small_demo: Path, tmp_path: Path) -> Path:
    """A small study that was run, with a note and without its report."""
    root = Path(shutil.copytree(small_demo / "study", tmp_path / "study"))
    shutil.rmtree(root / "report", ignore_errors=True)
    shutil.rmtree(root / NOTES, ignore_errors=True)
    run("record", "note", str(root), "Begun.", "--who", "A. B.")
    return root


def begin(*call: object) -> "subprocess.Popen[bytes]":
    """Begin to build a report in a process of its own."""
    command = masrel_command("report", *call, "--quiet")
    return subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def built(*calls: tuple[object, ...]) -> list[int]:
    """Build reports at once; how each ended."""
    return [process.wait() for process in [begin(*call) for call in calls]]


@pytest.mark.parametrize(
    "n_kills",
    [
        pytest.param(8, marks=pytest.mark.slow),
        pytest.param(200, marks=[pytest.mark.long, pytest.mark.faults]),
    ],
)
def test_a_kill_leaves_whole_pages_with_what_they_link_to(
    study: Path, tmp_path: Path, n_kills: int, faults: Faults
) -> None:
    chance, folder = random.Random(3), tmp_path / "report"
    protocol = study / "protocol.toml"
    text = protocol.read_text(encoding="utf-8").partition("[report]")[0]
    states = [
        f"{text}[report]\nsections = {sections}\n"
        for sections in ('["grades", "agreement"]', '["agreement", "methods"]')
    ]
    call = (study, "-o", folder, "--cache", tmp_path / "cache")
    needed, n_killed = [], 0
    for state in states:
        protocol.write_text(state, encoding="utf-8")
        begun = time.perf_counter()
        assert built(call) == [0]
        lasts_s = time.perf_counter() - begun
        needed.append(contents(folder))
    for number in range(n_kills):
        protocol.write_text(states[number % 2], encoding="utf-8")
        with faults("a report's build killed"):
            process = begin(*call)
            # most of its time it loads what it needs
            time.sleep(lasts_s * chance.triangular(0.2, 1.0, 1.0))
            process.kill()
            is_killed = process.wait() == -signal.SIGKILL
            n_killed += is_killed
            lasts_s *= 1.0 if is_killed else 0.7  # it was timed on a busier machine
            check_links(folder)
            left = contents(folder)
            for page in ("report.html", "report.md", "analysis.json"):
                assert left[page] in [each[page] for each in needed]
            if number % 8 == 7:
                assert built(call) == [0]
                assert contents(folder) == needed[number % 2]
    assert n_killed > n_kills // 3


@pytest.mark.slow
def test_two_builds_at_once_leave_one_whole_report(study: Path, tmp_path: Path) -> None:
    folder, cache = tmp_path / "report", tmp_path / "cache"
    calls = [
        (study, "-o", folder, "--cache", cache, *options)
        for options in (("--only", "grades"), ("--only", "agreement"))
    ]
    needed = []
    for call in calls:
        assert built(call) == [0]
        needed.append(contents(folder))
    for number in range(2):
        if number == 0:
            shutil.rmtree(cache)
        shutil.rmtree(folder)
        assert built(*calls) == [0, 0]
        assert contents(folder) in needed
        check_links(folder)
        assert built(calls[number % 2]) == [0]
        assert contents(folder) == needed[number % 2]
