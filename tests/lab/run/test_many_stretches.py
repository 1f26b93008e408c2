"""Presentations of many stretches: what is asked, kept of each, and said to a rater."""

import hashlib
import json
import math
import re
import shutil
from collections.abc import Callable
from functools import partialmethod
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import ParameterError, RatingsError
from masrel.lab._event_log import Event, read_log
from masrel.lab.elbow import tardieu
from masrel.lab.hess import SimulatedHand
from masrel.lab.protocol import (
    Protocol,
    StudyPaths,
    joint_model,
    presented_hash,
    read_protocol,
)
from masrel.lab.ratings import (
    ratings_from_logs,
    read_study_data,
    read_study_ratings,
    write_ratings,
)
from masrel.lab.recording import read_recording
from masrel.lab.run._grade_sources import GradeRequest, StretchGrade
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from masrel.lab.verification import verify_study
from masrel.scales import MODIFIED_ASHWORTH
from tests.lab.run.test_session import console, run
from tests.lab.script import ScriptGrades

Small = tuple[StudyPaths, Protocol]
New = Callable[..., Small]
OLD = Path(__file__).parent / "data" / "format_1"


def with_rules(
    new_study: New, *rules: str, further: str = "", name: str = "s"
) -> Small:
    table = "\n".join(("[presentation]", *rules))
    return new_study(("[schedule]", f"{table}\n\n{further}[schedule]"), name=name)


def shown(small: Small) -> list[Event]:
    log = read_log(small[0].log_file("R1", "test"))
    return [event for event in log if event.kind == "presented"]


def test_each_stretch_leaves_its_facts_until_the_rater_is_done(new_study: New) -> None:
    small = with_rules(new_study, 'stretches = "free"')
    run(small, SimulatedGrades(small[1]))
    counts = []
    for event in shown(small):
        fields = event.fields
        assert (fields["ended"], fields["felt"], fields["fault"]) == (
            *("done", "felt"),
            None,
        )
        made = fields["stretches"]
        assert isinstance(made, list)
        assert [stretch["number"] for stretch in made] == list(range(1, len(made) + 1))
        assert all(stretch["onset_s"] < stretch["end_s"] for stretch in made)
        assert all(stretch["catch_angle_deg"] > 60.0 for stretch in made)
        assert fields["n_stretches"] == len(made)
        assert fields["mean_speed_deg_s"] == made[0]["mean_speed_deg_s"]
        file = small[0].sessions / str(fields["recording"])
        assert read_recording(file).columns["stretch"].max() == len(made)
        counts.append(len(made))
    assert max(counts) > 1


def test_a_cued_presentation_has_r1_and_r2(new_study: New) -> None:
    small = with_rules(new_study, 'stretches = ["slow", "fast"]')
    run(small, SimulatedGrades(small[1]))
    schedule = read_schedule(small[0].schedule_file("R1", "test"))
    speeds = tuple(math.radians(speed) for speed in (10.0, 60.0, 120.0))
    for presentation, event in zip(schedule.presentations, shown(small), strict=True):
        fields = event.fields
        assert (fields["ended"], fields["n_stretches"]) == ("stretches", 2)
        slow, fast = fields["stretches"]
        assert (slow["cue"], fast["cue"]) == ("slow", "fast")
        assert (slow["reached_threshold"], slow["mean_speed_deg_s"]) == (False, None)
        exact = tardieu(joint_model(small[1], presentation.model), speeds=speeds)
        # A simulated hand is some 2 % slower than it means to be.
        assert fields["r1_deg"] == pytest.approx(
            math.degrees(exact.catch_angle), abs=2.0
        )
        assert fields["r2_deg"] == pytest.approx(
            math.degrees(exact.range_angle), abs=0.5
        )


def test_a_persons_hand_may_move_the_arm(new_study: New) -> None:
    person = '[simulated_raters]\nhand = "person"\n\n'
    small = new_study(("[simulated_raters]\n", person))
    run(small, SimulatedGrades(small[1]))
    clamp = new_study(name="clamp")
    run(clamp, SimulatedGrades(clamp[1]))
    assert presented_hash(small[1]) == presented_hash(clamp[1])
    # A person takes 0.15 s to get up speed, the clamp 0.02 s
    gently, at_once = (
        [until_fast(study, str(event.fields["code"])) for event in shown(study)]
        for study in (small, clamp)
    )
    assert min(gently) > 0.1
    assert max(at_once) < 0.05


def until_fast(study: Small, code: str) -> float:
    """From a tenth to nine tenths of the speed at the catch, s."""
    file = study[0].log_file("R1", "test").with_suffix("") / f"{code}.npz"
    columns = read_recording(file).columns
    speed = columns["velocity_deg_s"][: int(np.argmax(columns["phase"] > 0.0))]
    return float(np.sum((speed > 0.1 * speed[-1]) & (speed < 0.9 * speed[-1]))) * 1e-3


SLOW = """[stretch]
start_deg = 90.0

[simulated_raters]
mean_speed_deg_s = 12.0
speed_sd_deg_s = 0.0
"""


def test_what_was_too_slow_is_said_to_the_rater_counted_and_graded_all_the_same(
    new_study: New,
) -> None:
    settings = ("[simulated_raters]", f'[report]\nsections = ["grades"]\n\n{SLOW}')
    rules = ("[schedule]", '[presentation]\nstretches = "free"\n\n[schedule]')
    small = new_study(settings, rules)
    source, said = console("\n1\n\nagain\n\n2\n\n3\n")
    run(small, source)
    assert (
        said.getvalue().count("too slow to feel the catch. To repeat it, type again.")
        == 4
    )
    assert {event.fields["felt"] for event in shown(small)} == {"below-threshold"}
    assert ratings_from_logs(*small).table["felt"].tolist() == ["below-threshold"] * 3
    page = small[0].root / "report" / "report.md"
    for words, text in (
        (["ratings"], "3 ratings followed stretches too slow to feel the catch"),
        (["analyze"], "In 3 of 3 presentations the stretches were too slow"),
        (["report", "--quiet"], "none reached ν\\_th in 3, and none came as far as"),
    ):
        output = CliRunner().invoke(cli, [*words, str(small[0].root)]).output
        if page.exists():
            output = page.read_text(encoding="utf-8")
        assert text in " ".join(output.split())


def test_a_rater_is_told_that_the_time_limit_ended_a_presentation(
    new_study: New,
) -> None:
    small = with_rules(new_study, 'stretches = "free"', "time_limit_s = 1.0")
    source, said = console("\n1\n\n2\n\n3\n")
    run(small, source)
    ended = [event.fields["ended"] for event in shown(small)]
    words = "no stretch begins later than 1 s after the first movement."
    assert said.getvalue().count(words) == ended.count("time-limit") > 0


def test_a_grip_that_was_lost_stands_in_the_table_and_the_report(
    small: Small, monkeypatch: pytest.MonkeyPatch
) -> None:
    slips = partialmethod(SimulatedHand.__init__, slip_time=0.85)  # amid most catches
    monkeypatch.setattr(SimulatedHand, "__init__", slips)
    source, said = console("\n1\n\n2\n\n3\n")
    run(small, source)
    lost = [event.fields["grip_lost"] for event in shown(small)]
    assert True in lost
    assert said.getvalue().count("came loose and the model let go") == sum(lost)
    ratings = ratings_from_logs(*small)
    assert [row.grip_lost for row in ratings.rows] == lost
    root = small[0].root
    called = CliRunner().invoke(cli, ["ratings", str(root)]).output
    assert f"{sum(lost)} ratings followed a lost grip: column grip_lost" in called
    table = small[0].ratings_file.read_text(encoding="utf-8").splitlines()
    assert sum(line.endswith(",yes") for line in table) == sum(lost)
    CliRunner().invoke(cli, ["report", str(root), "--quiet"])
    page = " ".join((root / "report/report.md").read_text(encoding="utf-8").split())
    assert f"In {sum(lost)} of {len(lost)} presentations the arm came loose" in page


def test_a_grade_may_name_the_stretch_it_rests_on(new_study: New) -> None:
    small = with_rules(new_study, "stretches = 2")
    source, said = console("\n1+ 2\n\n1 3\n2\n\n\n3\n")
    run(small, source)
    assert "Stretch the arm 2 times and bring it back each time" in said.getvalue()
    assert "and the stretch it rests on, 1 to 2" in said.getvalue()
    assert "'1 3' is not a grade" in said.getvalue()
    assert "'' is not a grade" not in said.getvalue()  # an Enter too many
    log = read_log(small[0].log_file("R1", "test"))
    grades = [e.fields for e in log if e.kind == "grade"]
    assert [(g["grade"], g["stretch"]) for g in grades] == [
        *(("1+", 2), ("2", None)),
        ("3", None),
    ]
    ratings = ratings_from_logs(*small)
    first = ratings.table[ratings.table["grade"] == "1+"].iloc[0]
    assert first["graded_stretch"] == 2
    low, high = first["min_speed_deg_s"], first["max_speed_deg_s"]
    assert sorted(first["speeds_deg_s"]) == [low, high]
    assert first["mean_speed_deg_s"] == pytest.approx((low + high) / 2)
    path = small[0].ratings_file
    write_ratings(ratings, path)
    assert read_study_ratings(path, MODIFIED_ASHWORTH).table.equals(ratings.table)


def test_no_grade_rests_on_a_stretch_that_was_not_made(small: Small) -> None:
    class Program(ScriptGrades):
        def grade(self, request: GradeRequest) -> StretchGrade:
            return StretchGrade(grade="1", stretch=request.n_stretches + 1)

    with pytest.raises(ParameterError, match=r"stretch of .*: needed one of 1, from 1"):
        run(small, Program([]))


def test_a_button_is_asked_of_a_device_that_has_one(new_study: New) -> None:
    rules = ('stretches = "free"', 'done_with = "button"')
    simulated = with_rules(new_study, *rules)
    run(simulated, SimulatedGrades(simulated[1]))
    puck = '[device]\nbackend = "puck"\npuck_interface = "virtual"\n\n'
    small = with_rules(new_study, *rules, further=puck, name="other")
    message = (
        r"device.backend: needed one with a button \(simulated\), as .* got 'puck'"
    )
    with pytest.raises(ParameterError, match=message):
        run(small, SimulatedGrades(small[1]))
    checked = CliRunner().invoke(cli, ["check", str(small[0].root)])
    assert checked.exit_code == 2
    assert re.search(message, checked.output)


def test_a_session_of_format_1_is_read_and_finished(tmp_path: Path) -> None:
    shutil.copytree(OLD, tmp_path / "study")
    study = StudyPaths(tmp_path / "study")
    protocol = read_protocol(study.protocol)
    before = ratings_from_logs(study, protocol).table
    assert before["grade"].tolist() == ["1", None, None]
    assert before["n_stretches"].tolist()[:2] == [1, 1]
    lines = study.log_file("R1", "test").read_bytes()
    source, _ = console("\n2\n\n3\n")
    run_session(study, protocol, "R1", "test", grades=source, clock="simulated")
    assert study.log_file("R1", "test").read_bytes().startswith(lines)
    after = ratings_from_logs(study, protocol).table
    assert after["grade"].tolist() == ["1", "2", "3"]
    assert after["mean_speed_deg_s"][0] == before["mean_speed_deg_s"][0]


@pytest.mark.parametrize("n_columns", [7, 15])
def test_a_table_of_format_1_is_what_its_logs_say(
    tmp_path: Path, n_columns: int
) -> None:
    shutil.copytree(OLD, tmp_path / "study")
    study = StudyPaths(tmp_path / "study")
    write_ratings(
        ratings_from_logs(study, read_protocol(study.protocol)), study.ratings_file
    )
    lines = study.ratings_file.read_text(encoding="utf-8").splitlines()
    cut = [",".join(line.split(",")[:n_columns]) for line in lines]
    cut.remove("# format: 2")
    study.ratings_file.write_text("\n".join(cut) + "\n", encoding="utf-8")
    for verb in ("analyze", "verify", "check"):
        done = CliRunner().invoke(cli, [verb, str(study.root)])
        assert "is not what the session logs say" not in done.output
        assert done.exit_code == 0, done.output
    # and so is an analysis that was made when it was the table
    sha256 = hashlib.sha256(study.ratings_file.read_bytes()).hexdigest()
    analysis = study.analysis_file.read_text()
    now = json.loads(analysis)["inputs"]["ratings_sha256"]
    study.analysis_file.write_text(analysis.replace(now, sha256))
    assert verify_study(study).is_whole
    study.ratings_file.write_text("\n".join(cut[:-1]) + "\n", encoding="utf-8")
    with pytest.raises(RatingsError, match="is not what the session logs say"):
        read_study_data(study, read_protocol(study.protocol))


def rehearsed(small: Small) -> tuple[Path, list[object]]:
    """The log of a whole rehearsal, and its codes in order."""
    log = run(small, SimulatedGrades(small[1]), rehearsal=True).log_file
    return log, [e.fields["code"] for e in read_log(log) if e.kind == "grade"]


def test_nothing_of_a_rehearsal_is_a_rating(new_study: New, tmp_path: Path) -> None:
    study, protocol = small = new_study()
    same = (StudyPaths(tmp_path / "same"), protocol)
    shutil.copytree(study.root, same[0].root)
    other = (StudyPaths(tmp_path / "other"), protocol)
    other[0].root.mkdir()  # it draws a secret of its own
    call = ["run", str(study.root), "--rater", "R1", "--session", "test", "--rehearse"]
    done = CliRunner().invoke(cli, [*call, "--grades", "simulated"])
    assert "REHEARSAL: no grade becomes a rating" in done.output
    assert "none of them is a rating of the study" in done.output
    log, codes = rehearsed(small)
    assert log == study.root / "rehearsals" / "2" / "rehearsal_test_R1.jsonl"
    assert read_log(log)[0].fields["rehearsal"] is True
    facts = [read_recording(file).facts for file in log.parent.rglob("*.npz")]
    assert [each["rehearsal"] for each in facts] == [True] * 3
    session = read_schedule(study.schedule_file("R1", "test")).presentations
    assert codes != [presentation.code for presentation in session]
    # it is drawn from the secret
    assert [rehearsed(same)[1], rehearsed(same)[1]][1] == codes
    assert [rehearsed(other)[1], rehearsed(other)[1]][1] != codes
    assert other[0].secret_file.is_file()
    assert not study.sessions.exists()
    run(small, SimulatedGrades(protocol))
    assert len(ratings_from_logs(study, protocol).table) == 3
    log.replace(study.log_file("R1", "test"))
    with pytest.raises(
        ValueError, match="needed the log of a session, got that of a r"
    ):
        ratings_from_logs(*small)


@pytest.mark.parametrize("same_secret", [True, False])
def test_a_rehearsal_that_was_stopped_is_gone_on_with(
    small: Small, same_secret: bool
) -> None:
    source, said = console("\n1\n\nstop\n")
    with pytest.raises(RuntimeError, match="presentation 2 of 3"):
        run(small, source, rehearsal=True)
    assert (
        "REHEARSAL, not a rating of the study. Presentation 1 of 3" in said.getvalue()
    )
    before = small[0].root / "rehearsals" / "1" / "rehearsal_test_R1.jsonl"
    lines = before.read_bytes()
    if not same_secret:  # it is left, and another begun
        small[0].published_secret_file.unlink()
    n_left = 2 if same_secret else 3
    summary = run(small, console("\n2\n" * n_left)[0], rehearsal=True)
    assert (summary.n_graded, summary.rehearsal) == (3, True)
    assert (summary.log_file == before) is same_secret
    assert (before.read_bytes() == lines) is not same_secret


DEVICE = """
[device]
backend = "puck"
puck_interface = "virtual"
puck_channel = "study"
puck_node = 2
puck_direction = -1
puck_gear_ratio = 21.0
friction_viscous_nms_rad = 0.16
friction_coulomb_nm = 0.18

[schedule]"""


@pytest.mark.parametrize("by_person", [True, False])
def test_a_session_on_an_emulated_puck_is_labelled_simulated(
    new_study: New, by_person: bool
) -> None:
    class Person(SimulatedGrades):
        name = "console"
        simulated = False

    study, protocol = small = new_study(("\n[schedule]", DEVICE))
    grades = Person(protocol) if by_person else SimulatedGrades(protocol)
    assert run(small, grades).simulated
    header = read_log(study.log_file("R1", "test"))[0].fields
    assert (header["device"], header["simulated"]) == ("puck", True)
    for one in (event.fields for event in shown(small)):
        facts = read_recording(study.sessions / str(one["recording"])).facts
        assert (facts["device"], facts["simulated"]) == ("puck", True)
        assert (one["fault"], facts["ended"]) == (None, "arrived")
        assert one["simulated"] is True


def test_its_recordings_are_those_of_the_simulated_device_but_for_the_bus(
    new_study: New,
) -> None:
    # The same hands, models and arm; the bus is 0.2 ms late and the steps differ
    speeds = []
    for small in (new_study(("\n[schedule]", DEVICE)), new_study(name="plain")):
        run(small, SimulatedGrades(small[1]))
        speeds.append([event.fields["mean_speed_deg_s"] for event in shown(small)])
    assert speeds[0] == pytest.approx(speeds[1], rel=0.02)


def test_a_puck_outside_this_process_needs_a_real_clock(new_study: New) -> None:
    device = DEVICE.replace("virtual", "socketcan")
    small = new_study(("\n[schedule]", device))
    with pytest.raises(ParameterError, match=r"needed the real one for device 'puck'"):
        run(small, SimulatedGrades(small[1]))
    assert not small[0].log_file("R1", "test").exists()
