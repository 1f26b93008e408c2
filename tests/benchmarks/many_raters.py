"""Status and ratings of a study of many raters, beside verifying its chains alone.

``python -m tests.benchmarks.many_raters [N_RATERS]`` makes a study of 200 raters with
50 presentations each, their logs those of one session that was run, and prints how long
each command takes, and how often as long as reading and verifying every log once.
"""

import hashlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from masrel.lab._once import read_once
from masrel.lab.progress import next_step, rater_progress, session_progress
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.ratings import ratings_from_logs, study_remarks
from masrel.lab.run import SimulatedGrades, read_log, run_session
from masrel.lab.schedule import Schedule, read_schedule, write_schedules

N_MODELS, N_REPEATS = 10, 5

_MODEL = """
[[models]]
id = "HM{number}"
intended_grade = "1"
catch_angle_constant_deg = 130.0
catch_torque_nms_rad = 1.{number}
residual_ratio = 0.15
catch_travel_deg = 60.0
"""


def make_study(
    root: Path, n_raters: int, *, with_recordings: bool
) -> tuple[StudyPaths, Protocol]:
    """A study in which everybody has the session of the first rater, by other codes."""
    study, raters = StudyPaths(root), [f"R{i}" for i in range(1, n_raters + 1)]
    root.mkdir(parents=True)
    study.protocol.write_text(_protocol(raters), encoding="utf-8")
    protocol = read_protocol(study.protocol)
    write_schedules(protocol, study)
    grades = SimulatedGrades(protocol)
    run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")
    first = read_schedule(study.schedule_file("R1", "test"))
    events = [
        json.loads(line)
        for line in study.log_file("R1", "test").read_bytes().splitlines()
    ]
    for rater in raters[1:]:
        file = study.schedule_file(rater, "test")
        _write_log(study, first, read_schedule(file), file, events)
        if with_recordings:
            _link_recordings(study, first, read_schedule(file))
    return study, protocol


def _protocol(raters: list[str]) -> str:
    names = ", ".join(f'"{rater}"' for rater in raters)
    return "\n".join(
        [
            '[study]\nid = "many"\ntitle = "Many raters"',
            '[scale]\nname = "MAS"\ngrades = ["0", "1", "1+", "2", "3", "4"]',
            *(_MODEL.format(number=number) for number in range(N_MODELS)),
            *(f'[[raters]]\nid = "{rater}"' for rater in raters),
            f'[[sessions]]\nid = "test"\nraters = [{names}]',
            f"[schedule]\nseed = 1\nrepeats = {N_REPEATS}",
        ]
    )


def _codes(first: Schedule, other: Schedule) -> dict[str, str]:
    pairs = zip(first.presentations, other.presentations, strict=True)
    return {a.code: b.code for a, b in pairs}


def _write_log(
    study: StudyPaths,
    first: Schedule,
    other: Schedule,
    file: Path,
    events: list[dict[str, object]],
) -> None:
    codes, previous, lines = _codes(first, other), "0" * 64, []
    for event in events:
        fields = dict(event["fields"])  # type: ignore[call-overload]
        if event["event"] == "session":
            sha256 = hashlib.sha256(file.read_bytes()).hexdigest()
            fields |= {"rater": other.rater, "schedule_sha256": sha256}
        if "code" in fields:
            fields["code"] = codes[fields["code"]]
        if "recording" in fields:
            fields["recording"] = f"test_{other.rater}/{fields['code']}.npz"
        line = json.dumps({**event, "previous": previous, "fields": fields})
        previous = hashlib.sha256(line.encode()).hexdigest()
        lines.append(line)
    log = study.log_file(other.rater, "test")
    log.write_text("\n".join([*lines, ""]), encoding="utf-8")


def _link_recordings(study: StudyPaths, first: Schedule, other: Schedule) -> None:
    for old, new in _codes(first, other).items():
        source = study.recording_file(first.rater, "test", old)
        target = study.recording_file(other.rater, "test", new)
        target.parent.mkdir(exist_ok=True)
        os.link(source, target)


def status(study: StudyPaths, protocol: Protocol) -> None:
    """What masrel status computes."""
    sessions = session_progress(study, protocol)
    next_step(study, sessions, rater_progress(study, protocol, sessions))


@read_once()
def ratings(study: StudyPaths, protocol: Protocol) -> None:
    """What masrel ratings computes."""
    study_remarks(study, protocol)
    ratings_from_logs(study, protocol)
    sessions = session_progress(study, protocol)
    rater_progress(study, protocol, sessions)


def chains(study: StudyPaths, _: Protocol) -> None:
    """Every log read once, its chain verified."""
    for log in study.logs():
        read_log(log)


def seconds(work: Callable[[StudyPaths, Protocol], None], *where: object) -> float:
    """The shorter of two runs."""
    elapsed = []
    for _ in range(2):
        begin = time.perf_counter()
        work(*where)  # type: ignore[arg-type]
        elapsed.append(time.perf_counter() - begin)
    return min(elapsed)


def main() -> None:
    """Print the seconds of each, and their ratio to verifying the chains alone."""
    n_raters = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    for with_recordings in (False, True):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder) / "study"
            where = make_study(root, n_raters, with_recordings=with_recordings)
            alone = seconds(chains, *where)
            print(f"{n_raters} raters, recordings: {with_recordings}")
            for work in (chains, status, ratings):
                taken = seconds(work, *where)
                print(f"  {work.__name__}: {taken:.2f} s, {taken / alone:.1f} times")


if __name__ == "__main__":
    main()
