"""A session on an emulated puck, from the protocol to the replay of a recording."""

from collections.abc import Callable

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import ParameterError
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.recording import read_recording
from masrel.lab.run import SimulatedGrades, read_log, run_session

NewStudy = Callable[..., tuple[StudyPaths, Protocol]]

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


def on_a_puck(new_study: NewStudy, **changes: str) -> tuple[StudyPaths, Protocol]:
    device = DEVICE
    for old, new in changes.items():
        device = device.replace(old, new)
    return new_study(("\n[schedule]", device))


def presented(study: StudyPaths) -> list:
    log = read_log(study.log_file("R1", "test"))
    return [event.fields for event in log if event.kind == "presented"]


def test_a_session_on_an_emulated_puck_is_labelled_simulated(
    new_study: NewStudy,
) -> None:
    study, _ = on_a_puck(new_study)
    who = ["--rater", "R1", "--session", "test", "--grades", "simulated"]
    done = CliRunner().invoke(
        cli, ["run", str(study.root), *who], catch_exceptions=False
    )
    assert done.exit_code == 0, done.output
    assert "3 grades (simulated) in" in done.output
    header = read_log(study.log_file("R1", "test"))[0].fields
    assert (header["device"], header["simulated"]) == ("puck", True)
    shown = presented(study)
    assert [one["fault"] for one in shown] == [None] * 3
    for one in shown:
        facts = read_recording(study.sessions / str(one["recording"])).facts
        assert (facts["device"], facts["simulated"]) == ("puck", True)
        assert facts["ended"] == "arrived"
        assert one["simulated"] is True


def test_its_recordings_are_those_of_the_simulated_device_but_for_the_bus(
    new_study: NewStudy,
) -> None:
    # The same hands, models and arm; the bus is 0.2 ms late and the steps differ
    study, protocol = on_a_puck(new_study)
    other, plain = new_study(name="plain")
    speeds = []
    for paths, rules in ((study, protocol), (other, plain)):
        grades = SimulatedGrades(rules)
        run_session(paths, rules, "R1", "test", grades=grades, clock="simulated")
        speeds.append([one["mean_speed_deg_s"] for one in presented(paths)])
    assert speeds[0] == pytest.approx(speeds[1], rel=0.02)


def test_a_puck_outside_this_process_needs_a_real_clock(new_study: NewStudy) -> None:
    study, protocol = on_a_puck(new_study, virtual="socketcan")
    grades = SimulatedGrades(protocol)
    with pytest.raises(ParameterError, match=r"needed the real one for device 'puck'"):
        run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")
    assert not study.log_file("R1", "test").exists()


def test_grades_of_a_person_on_an_emulated_puck_are_simulated_too(
    new_study: NewStudy,
) -> None:
    class Person(SimulatedGrades):
        name = "console"
        simulated = False

    study, protocol = on_a_puck(new_study)
    done = run_session(
        study, protocol, "R1", "test", grades=Person(protocol), clock="simulated"
    )
    assert done.simulated
    assert read_log(study.log_file("R1", "test"))[0].fields["simulated"] is True
