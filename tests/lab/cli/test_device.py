"""``masrel device`` against an emulated puck."""

import importlib
import itertools
import json
import shutil
import signal
import time
from pathlib import Path

import pytest

from masrel.lab.hess import run_presentation
from masrel.lab.hess.puck import steady_runs
from tests.cli.process import Caller

HESS2012 = Path(__file__).parents[3] / "studies" / "hess2012"
EMULATED = ("--channel", "cli", "--emulate")
CHECK = ("device", "check", *EMULATED)
MIRRORED = ("--direction", -1, "--gear-ratio", 9.4)


def test_probe_says_who_is_there(masrel: Caller) -> None:
    done = masrel("device", "probe", *EMULATED)
    assert done.code == 0
    assert done.out.splitlines() == [
        "puck 1: motor, firmware 148, asleep",
        "(simulated: there is no hardware on this bus)",
    ]
    assert done.err == ""  # no terminal, no progress bar
    done = masrel("device", "probe", "--interface", "virtual", "--channel", "empty")
    assert done.code == 1
    assert done.out.startswith("nobody answers\n")
    done = masrel("device", "probe", *EMULATED, "--puck", 5, "--json", "-")
    document = json.loads(done.out)
    assert document["simulated"] is True
    assert [(p["puck"], p["is_supported"]) for p in document["found"]] == [(5, True)]


def test_check_looks_at_everything(masrel: Caller) -> None:
    done = masrel(*CHECK)
    assert done.code == 0
    looked = [line.split(":")[0] for line in done.out.splitlines()[:-1]]
    assert looked == [
        "ok   units",
        "ok   answers",
        "ok   position",
        "ok   rest",
        "ok   torque mode",
        "ok   error frames",
    ]
    assert "0 of 1000 lost" in done.out
    assert "not zeroed yet" in done.out
    # 360 deg of 4096 counts and another gear
    assert "0.009350 deg and 0.00348 N·m" in masrel(*CHECK, *MIRRORED).out


def test_zero_says_the_count(masrel: Caller, tmp_path: Path) -> None:
    # 90 deg * 4096 * 18.8 / 360 = 19251.2
    file = tmp_path / "zero.json"
    done = masrel("device", "zero", "--angle-deg", 90, *EMULATED, "--json", file)
    assert done.code == 0
    assert done.out.startswith("the arm is at 90 deg: 19251 counts\n")
    document = json.loads(file.read_text(encoding="utf-8"))
    assert document.pop("format") == "masrel device zero 1"
    assert document == {"angle_deg": 90.0, "counts": 19251, "simulated": True}


def test_a_full_disk_loses_no_result(masrel: Caller) -> None:
    done = masrel("device", "probe", *EMULATED, "--json", "/dev/full")
    assert done.out.startswith("puck 1: motor, firmware 148, asleep\n")


@pytest.mark.slow  # lab/hess/puck/test_documentation.py reads its lines by default
def test_friction_finds_that_of_the_emulated_arm(masrel: Caller) -> None:
    # Its arm is held at 60 deg, whatever the gear and the direction
    told = ("--arm-is-free", *EMULATED, *MIRRORED, "--json", "-")
    done = masrel("device", "friction", *told)
    assert done.code == 0
    found = json.loads(done.out)
    assert found["viscous"] == pytest.approx(0.168, rel=0.015)  # (7)
    assert found["coulomb"] == pytest.approx(0.189, rel=0.015)
    assert abs(found["offset"]) < 0.002
    assert len(found["runs"]) == 8


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_is_an_emergency_stop_while_the_arm_turns(
    masrel: Caller, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def signalled(*arguments, **options):
        signal.raise_signal(signal.Signals[name])
        return steady_runs(*arguments, **options)

    module = importlib.import_module("masrel.lab.cli.device")
    monkeypatch.setattr(module, "steady_runs", signalled)
    done = masrel("device", "friction", "--arm-is-free", *EMULATED)
    assert done.code == 1
    assert f"emergency stop: signal {name}" in done.err
    assert "Traceback" not in done.err


@pytest.mark.slow  # 32 stretches come before the minutes
def test_a_signal_in_a_minute_of_real_time_begins_no_other(
    masrel: Caller, monkeypatch: pytest.MonkeyPatch
) -> None:
    minutes = []

    def signalled(device, *arguments, max_duration_s=None, **options):
        if max_duration_s is not None:
            minutes.append(max_duration_s)
            signal.raise_signal(signal.SIGTERM)
        return run_presentation(
            device, *arguments, max_duration_s=max_duration_s, **options
        )

    module = importlib.import_module("masrel.lab.cli.device")
    monkeypatch.setattr(module, "run_presentation", signalled)
    done = masrel("device", "fidelity", "--device", "simulated", "--minutes", 2)
    assert (done.code, minutes) == (1, [60.0])
    assert "emergency stop: signal SIGTERM" in done.err


@pytest.mark.slow  # 32 stretches come before the minutes
@pytest.mark.filterwarnings("ignore::masrel.errors.OverrunWarning")
def test_a_late_reading_in_a_minute_of_an_emulator_is_counted(
    masrel: Caller, monkeypatch: pytest.MonkeyPatch
) -> None:
    def delayed(device, *arguments, max_duration_s=None, **options):
        if max_duration_s is not None:
            read, n_read = device.read, itertools.count()

            def late() -> object:
                reading = read()
                if next(n_read) == 100:
                    time.sleep(0.01)  # twice as long as a session allows
                return reading

            monkeypatch.setattr(device, "read", late)
        return run_presentation(
            device, *arguments, max_duration_s=max_duration_s, **options
        )

    module = importlib.import_module("masrel.lab.cli.device")
    monkeypatch.setattr(module, "run_presentation", delayed)
    call = ("device", "fidelity", "--device", "simulated", "--minutes", 0.01)
    done = masrel(*call, "--json", "-")
    document = json.loads(done.out)
    # a machine that does other things may be away for longer, which is another fault
    assert not any(fault.startswith("stale") for fault in document["faults"])
    assert document["n_missed_ticks"] >= 9
    assert document["n_ticks"] > 100


def test_friction_does_not_move_an_arm_unasked(masrel: Caller) -> None:
    done = masrel("device", "friction", *EMULATED)
    assert done.code == 2
    assert "add --arm-is-free" in done.err


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (
            ("check", "--emulate", "--interface", "socketcan"),
            2,
            "interface: needs 'virtual' for an emulated puck",
        ),
        (("check", "--puck", 9), 2, "puck: needs a motor's node, 1 to 7, got 9"),
        (("zero", *EMULATED), 2, "Missing option '--angle-deg'"),
        (("zero", "--angle-deg", 200, *EMULATED), 2, "200.0 is not in the range"),
        (("zero", "--angle-deg", "nan", *EMULATED), 2, "angle: needs 0 to 180 deg"),
        (
            ("probe", *EMULATED, "--json", "/dev/full"),
            2,
            "/dev/full: needed a file or a new name",
        ),
        (("probe", *EMULATED, "--json", "no/x"), 2, "--json: needs a folder that"),
        (("check", "--properties", "none.toml"), 2, "none.toml: No such file"),
        (("check", "--channel", "can-none"), 1, "cannot open channel 'can-none'"),
        (
            ("check", "--interface", "virtual", "--channel", "empty"),
            1,
            "puck 1: no answer for property 5 within 50 ms",
        ),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(
    masrel: Caller, arguments: tuple, code: int, words: str
) -> None:
    done = masrel("device", *arguments)
    assert done.code == code
    assert words in done.err
    assert "Traceback" not in done.err


MOTEUS = ("--device", "moteus", "--channel", "cli-moteus", "--emulate")


def test_a_moteus_is_brought_up_by_the_same_commands(masrel: Caller) -> None:
    done = masrel("device", "probe", *MOTEUS, "--node", 7)
    assert done.out.startswith("moteus 7: firmware 1.0.0, 24 V, 30 deg C\n")
    done = masrel("device", "check", *MOTEUS)
    assert done.code == 0
    looked = [line.split(":")[0] for line in done.out.splitlines()[:-1]]
    names = ("settings", "answers", "position", "rest", "torque mode", "error frames")
    assert looked == [f"ok   {name}" for name in names]
    done = masrel("device", "zero", "--angle-deg", 90, *MOTEUS, "--json", "-")
    document = json.loads(done.out)
    assert document.pop("format") == "masrel device zero 1"
    assert document == {"angle_deg": 90.0, "turns": 0.25, "simulated": True}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("check", *MOTEUS, "--node", 128), "servo: needs 1 to 127, got 128"),
        (("check", *MOTEUS, "--properties", __file__), "--properties is for a puck"),
        (("emulate", "--device", "moteus"), "needs --interface udp_multicast"),
        (("emulate", *MOTEUS), "needs --interface udp_multicast"),
    ],
)
def test_what_a_moteus_cannot_be_told_is_refused(
    masrel: Caller, arguments: tuple, words: str
) -> None:
    done = masrel("device", *arguments)
    assert done.code == 2
    assert words in done.err


@pytest.mark.slow
def test_the_whole_flow_runs_on_an_emulated_moteus(
    masrel: Caller, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    done = masrel("demo", out, "--study", "small", "--device", "moteus", "--quiet")
    assert done.code == 0, done.err
    facts = [
        json.loads(file.read_text(encoding="utf-8"))
        for file in sorted(out.glob("study/sessions/*/*.json"))
    ]
    assert len(facts) == 8
    assert {one["device"] for one in facts} == {"moteus"}
    assert all(one["simulated"] and one["fault"] is None for one in facts)


CALIBRATE = ("device", "calibrate", "--device", "simulated", "--who", "Kim")


FREE = "--arm-is-free"
NO_MASSES = "needs two different masses or more, each above 0"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "add --arm-is-free"),
        ((FREE, "--who", " "), "who: needed text, got none"),
        ((FREE, "--mass-kg", "1"), "--mass-kg: needs --radius-m"),
        ((FREE, "--mass-kg", "1", "--radius-m", "0.25"), NO_MASSES),
        ((FREE, "--mass-kg", "1,1", "--radius-m", "0.25"), NO_MASSES),
        ((FREE, "--mass-kg", "0,1", "--radius-m", "0.25"), NO_MASSES),
        ((FREE, "--mass-kg", "-1,2", "--radius-m", "0.25"), NO_MASSES),
    ],
)
def test_calibrate_refuses_before_the_arm_moves(
    masrel: Caller, arguments: tuple[str, ...], words: str
) -> None:
    done = masrel(*CALIBRATE, *arguments)
    assert (done.code, words in done.err) == (2, True), done.err


def test_a_device_without_a_bus_cannot_be_probed(masrel: Caller) -> None:
    done = masrel("device", "probe", "--device", "simulated")
    assert (done.code, "has no bus that can be asked" in done.err) == (2, True)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::masrel.errors.OverrunWarning")  # a busy machine
@pytest.mark.parametrize(
    ("device", "against", "n_stretches"),
    [("moteus", "weights", 8), ("simulated", "a torque sensor", 32)],
)
def test_a_device_of_a_study_is_calibrated_and_its_torque_compared(
    masrel: Caller,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    device: str,
    against: str,
    n_stretches: int,
) -> None:
    study = tmp_path / "study"
    masrel("init", study)
    protocol = study / "protocol.toml"
    table = {"moteus": 'interface = "virtual"', "simulated": "torque_sensor = {}"}
    own = f'[device]\nbackend = "{device}"\n\n[device.{device}]\n{table[device]}\n'
    text = protocol.read_text(encoding="utf-8")
    before, _, after = text.partition("[device]\n")
    rest = after[after.index("\n[") :]
    protocol.write_text(f"{before}{own}{rest}", encoding="utf-8")
    weights = ("--mass-kg", "0.5,1", "--radius-m", "0.25", "--json", "-")
    command = ("device", "calibrate", "--who", "Kim", "--arm-is-free", *weights)
    done = masrel(*command, "--study", study)
    assert done.code == 0, done.err
    document = json.loads(done.out)
    value, low, high = document["values"]["torque_gain"]
    assert low <= value <= high
    assert value == pytest.approx(1.0, abs=0.005)
    assert (document["simulated"], document["gain_from"]) == (True, against)
    (file,) = (study / "calibrations").glob(f"{device}_*.json")
    assert json.loads(file.read_text("utf-8"))["values"] == document["values"]
    if device == "moteus":
        assert document["boards"][0]["serial"] == "00001267-00000000-00000000"
    table_v = Path(shutil.copytree(HESS2012, tmp_path / "home" / "hess2012"))
    rows = table_v / "ratings/published.csv"
    head = rows.read_text("utf-8").splitlines()[: 1 + n_stretches]
    rows.write_text("\n".join(head), encoding="utf-8")
    module = importlib.import_module("masrel.lab.cli.device")
    monkeypatch.setattr(module, "_home", lambda: tmp_path / "home")
    done = masrel("device", "fidelity", "--study", study, "--json", "-")
    document = json.loads(done.out)
    assert set(document["models"]) == {"HM1", "HM2", "HM3", "HM4"}
    assert len(document["stretches"]) == n_stretches
    assert document["simulated"] is True
