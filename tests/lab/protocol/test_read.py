"""Every wrong key is found, all at once, with file, key and what was needed."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ProtocolError
from masrel.lab.protocol import joint_model, read_protocol
from tests.lab.protocol.documents import (
    VALID,
    changed,
    problems_of,
    without,
    write,
)


def test_the_valid_protocol_is_read_with_its_defaults(tmp_path: Path) -> None:
    protocol = read_protocol(write(VALID, tmp_path))
    assert [model.role for model in protocol.models] == ["standard", "dummy"]
    assert protocol.models[1].intended_grade is None
    assert protocol.schedule.repeats == 1
    assert protocol.elbow.range_end_deg == 146.0


NUMBER = "a number above 0 and at most 180"


@pytest.mark.parametrize(
    ("path", "value", "problem"),
    [
        (
            ("study", "tilte"),
            "x",
            'study.tilte: needed a known key, got "tilte"; did you mean title?',
        ),
        (
            ("stretch", "zzz"),
            1,
            "stretch.zzz: needed a known key (start_deg, end_deg, "
            'largest_speed_deg_s), got "zzz"',
        ),
        (
            ("sessions", 0, "raters"),
            ["R1", "R2", "R1"],
            'sessions[0].raters[2]: needed each rater once, got "R1" again (id "test")',
        ),
        (
            ("models", 0, "parameters"),
            {"stiffness_nm_rad": 1.0},
            "models[0].parameters: needed a kind of model that has some, got "
            '"spastic-elbow", whose numbers are beside its id and in constants '
            '(id "HM1")',
        ),
        # types: a boolean is no number, a number no text, a table no array
        (
            ("models", 0, "catch_travel_deg"),
            True,
            f'models[0].catch_travel_deg: needed {NUMBER}, got true (id "HM1")',
        ),
        (
            ("schedule", "seed"),
            True,
            "schedule.seed: needed a whole number at least 0 and at most "
            "9223372036854775807, got true",
        ),
        (
            ("scale", "grades", 1),
            1,
            "scale.grades[1]: needed text that is not empty (in quotes), got 1",
        ),
        (
            ("schedule", "repeats"),
            1.5,
            "schedule.repeats: needed a whole number at least 1 and at most 20, "
            "got 1.5",
        ),
        (("raters",), {}, "raters: needed an array of tables [[raters]], got a table"),
        (("study",), [], "study: needed a table, got an array of 0"),
        (("sessions", 0), "x", 'sessions[0]: needed a table, got "x"'),
        (
            ("device",),
            {"puck_checks_torque": "yes"},
            'device.puck_checks_torque: needed true or false, got "yes"',
        ),
        (
            ("device",),
            {"puck_properties": 42},
            "device.puck_properties: needed a table in which each value is a whole "
            "number, got 42",
        ),
        # ranges, both ends
        (
            ("models", 1, "catch_angle_constant_deg"),
            210,
            f'models[1].catch_angle_constant_deg: needed {NUMBER}, got 210 (id "D1")',
        ),
        (
            ("models", 0, "catch_travel_deg"),
            0,
            f'models[0].catch_travel_deg: needed {NUMBER}, got 0 (id "HM1")',
        ),
        (
            ("models", 0, "residual_ratio"),
            1.0,
            "models[0].residual_ratio: needed a number at least 0 and below 1, "
            'got 1.0 (id "HM1")',
        ),
        (
            ("schedule", "seed"),
            2**63,
            "schedule.seed: needed a whole number at least 0 and at most "
            "9223372036854775807, got 9223372036854775808",
        ),
        (
            ("elbow", "stiffness_nm_rad"),
            float("inf"),
            "elbow.stiffness_nm_rad: needed a number at least 0, got inf",
        ),
        (
            ("elbow", "damping_nms_rad"),
            float("nan"),
            "elbow.damping_nms_rad: needed a number at least 0, got nan",
        ),
        (
            ("elbow", "post_catch"),
            "aditive",
            'elbow.post_catch: needed one of "additive", "continuous", '
            'got "aditive"; did you mean additive?',
        ),
        (
            ("elbow", "residual_reading"),
            "residuum",
            'elbow.residual_reading: needed one of "decrease", "residual", '
            'got "residuum"; did you mean residual?',
        ),
        (
            ("elbow", "rest_angle_deg"),
            "30",
            "elbow.rest_angle_deg: needed a number at least 0 and at most 180, "
            'got "30"',
        ),
        (
            ("elbow", "catch_rise_s"),
            0.2,
            "elbow.catch_rise_s: needed at most elbow.peak_duration_s (0.1), got 0.2",
        ),
        (
            ("models", 1, "constants"),
            {"catch_rise_s": 0.11},
            "models[1].constants.catch_rise_s: needed at most elbow.peak_duration_s "
            '(0.1), got 0.11 (id "D1")',
        ),
        (
            ("models", 1, "constants"),
            {"rest_angle_deg": -1},
            "models[1].constants.rest_angle_deg: needed a number at least 0 and at "
            'most 180, got -1 (id "D1")',
        ),
        # 3.15 N·m/rad · 60 deg = 3.30 N·m hold an arm that only waits
        (
            ("elbow", "rest_angle_deg"),
            90,
            "elbow.rest_angle_deg: needed at most device.standing_torque_nm (2 N·m) "
            "where the stretch starts, got 3.15 N·m/rad times 30 - 90 deg = -3.3 N·m",
        ),
        (
            ("models", 0, "constants"),
            {"rest_angle_deg": 0, "stiffness_nm_rad": 4},
            "models[0].constants.rest_angle_deg: needed at most "
            "device.standing_torque_nm (2 N·m) where the stretch starts, got 4 N·m/rad "
            'times 30 - 0 deg = 2.09 N·m (id "HM1")',
        ),
        (
            ("training",),
            {"kappa_insufficient": 0.9},
            "training.kappa_insufficient: needed less than training.kappa_sufficient "
            "(0.8), got 0.9",
        ),
        (
            ("training",),
            {"max_presentations": 40},
            "training.window: needed at most training.max_presentations (40), got 60",
        ),
        (
            ("training",),
            {"order": "random"},
            'training.order: needed one of "adaptive", "blocked", got "random"',
        ),
        # ids
        (
            ("study", "id"),
            "../out",
            "study.id: needed a name of 1 to 32 letters, digits, '.', '_' or '-', the "
            'first a letter or digit (in quotes), got "../out"',
        ),
        (
            ("study", "id"),
            "pilot\n",
            "study.id: needed a name of 1 to 32 letters, digits, '.', '_' or '-', the "
            'first a letter or digit (in quotes), got "pilot\\n"',
        ),
        # rules across keys
        (
            ("raters",),
            [{"id": "R1"}, {"id": "R2"}, {"id": "R1"}],
            "raters[2].id: needed ids that differ by more than case, "
            'got "R1" where raters[0] has "R1"',
        ),
        (
            ("models", 1, "id"),
            "hm1",
            "models[1].id: needed ids that differ by more than case, "
            'got "hm1" where models[0] has "HM1"',
        ),
        (
            ("analysis", "estimates", 1, "id"),
            "kappa",
            "analysis.estimates[1].id: needed ids that differ by more than case, "
            'got "kappa" where analysis.estimates[0] has "kappa"',
        ),
        (
            ("models", 0, "intended_grade"),
            "3",
            "models[0].intended_grade: needed a grade of the scale (0, 1, 1+, 2), "
            'got "3" (id "HM1")',
        ),
        (
            ("scale", "grades", 3),
            "1",
            'scale.grades[3]: needed grades that differ, got "1" again',
        ),
        (
            ("scale", "grades", 3),
            "2 ",
            "scale.grades[3]: needed a grade without spaces around it or control "
            'characters, got "2 "',
        ),
        (
            ("scale", "grades", 3),
            "NA",
            "scale.grades[3]: needed a grade that does not mean a missing one, "
            'got "NA"',
        ),
        (
            ("sessions", 1, "raters", 0),
            "R9",
            "sessions[1].raters[0]: needed a rater of [[raters]] (R1, R2), "
            'got "R9" (id "retest")',
        ),
        (
            ("stretch", "end_deg"),
            150,
            "stretch.end_deg: needed at most elbow.range_end_deg (146), got 150",
        ),
        (
            ("stretch", "start_deg"),
            146,
            "stretch.start_deg: needed less than stretch.end_deg (146), got 146",
        ),
        (
            ("device", "full_speed_deg_s"),
            0.1,
            "device.dead_zone_deg_s: needed less than device.full_speed_deg_s (0.1), "
            "got 0.1",
        ),
        (
            ("device", "lowest_angle_deg"),
            26.0,
            "stretch.start_deg: needed at least device.lowest_angle_deg and the soft "
            "stop beside it (26 + 5), got 30",
        ),
        (
            ("device", "highest_angle_deg"),
            150.0,
            "stretch.end_deg: needed at most device.highest_angle_deg less the soft "
            "stop before it (150 - 5), got 146",
        ),
        (
            ("elbow",),
            {"smallest_catch_angle_deg": 126, "slowest_mean_speed_deg_s": 0},
            "models[1].catch_angle_constant_deg: needed more than "
            'elbow.smallest_catch_angle_deg (126), got 125.5 (id "D1")',
        ),
        (
            # 125.5 - 0.35 * 188 = 59.7 is below 60; 130 - 65.8 = 64.2 is not
            ("elbow", "slowest_mean_speed_deg_s"),
            188,
            "models[1].catch_angle_constant_deg: needed a catch angle at "
            "elbow.slowest_mean_speed_deg_s of at least elbow.smallest_catch_angle_deg "
            '(60), got 125.5 - 0.35 * 188 = 59.7 (id "D1")',
        ),
        (
            ("report", "sections"),
            ["design", "grades", "design"],
            'report.sections[2]: needed each section once, got "design" again',
        ),
        (
            ("analysis", "estimates", 0, "sessions"),
            ["test", "retest"],
            "analysis.estimates[0].sessions: needed exactly one session for "
            '"inter-rater", got 2 (id "kappa")',
        ),
        (
            ("analysis", "estimates", 1, "sessions"),
            ["test"],
            "analysis.estimates[1].sessions: needed exactly two sessions for "
            '"test-retest", got 1 (id "again")',
        ),
        (
            ("analysis", "estimates", 1, "sessions"),
            ["test", "test"],
            "analysis.estimates[1].sessions: needed two different sessions, "
            'got "test" twice (id "again")',
        ),
        (
            ("analysis", "estimates", 1, "sessions"),
            ["test", "retest", "test"],
            "analysis.estimates[1].sessions: needed an array of 1 to 2 entries, got an "
            'array of 3 (id "again")',
        ),
        (
            ("analysis", "estimates", 0, "sessions"),
            ["tset"],
            "analysis.estimates[0].sessions[0]: needed a session of [[sessions]] "
            '(test, retest), got "tset" (id "kappa")',
        ),
        (
            ("analysis", "estimates", 0, "sessions"),
            ["retest"],
            "analysis.estimates[0].sessions: needed a session of at least two raters, "
            'got one of 1 (id "kappa")',
        ),
    ],
)
def test_one_wrong_value_gives_its_message(
    tmp_path: Path, path: tuple[str | int, ...], value: object, problem: str
) -> None:
    assert problems_of(changed(*path, to=value), tmp_path) == [problem]


# The last value of [device] that keeps people safe, and one beyond it.
LIMITS = {
    "torque_limit_nm": (28, 28.1),
    "active_torque_limit_nm": (28, 28.1),
    "active_energy_limit_j": (100, 101),
    "active_speed_limit_deg_s": (600, 601),
    "speed_limit_deg_s": (600, 601),
    "soft_stop_deg": (30, 30.1),
    "soft_stop_torque_nm": (28, 28.1),
    "missed_replies_limit": (20, 21),
    "missed_replies_per_100_limit": (100, 101),
    "stale_limit_ms": (50, 50.1),
    "frozen_limit_ms": (100, 101),
    "standing_limit_ms": (5000, 5001),
    "standing_torque_nm": (28, 28.1),
    "jump_limit_deg": (5, 5.1),
    "watchdog_ms": (100, 101),
    "ramp_ms": (100, 101),
    "rate_hz": (100, 99),
}


@pytest.mark.parametrize("key", LIMITS)
def test_a_limit_of_the_device_is_refused_beyond_what_is_safe(
    key: str, tmp_path: Path
) -> None:
    def is_refused(value: float) -> bool:
        try:
            read_protocol(write(changed("device", key, to=value), tmp_path))
        except ProtocolError as error:
            # other keys may not go with it, which says so of their own
            return any(f"device.{key}: needed a " in text for text in error.problems)
        return False

    last, beyond = LIMITS[key]
    assert (is_refused(last), is_refused(beyond)) == (False, True)


def test_a_session_too_small_for_the_plan_is_refused_where_it_is_asked_for(
    tmp_path: Path,
) -> None:
    # one rater for kappa, and none who comes again for the retest
    assert problems_of(changed("sessions", 0, "raters", to=["R2"]), tmp_path) == [
        "analysis.estimates[0].sessions: needed a session of at least two raters, "
        'got one of 1 (id "kappa")',
        "analysis.estimates[1].sessions: needed two sessions that share a rater, "
        'got none in both (id "again")',
    ]


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        (("study",), "study: needed a table [study], got none"),
        (("models",), "models: needed an array of tables [[models]], got none"),
        (
            ("models", 1, "catch_travel_deg"),
            f'models[1].catch_travel_deg: needed {NUMBER}, got none (id "D1")',
        ),
        (
            ("analysis", "estimates", 0, "target"),
            'analysis.estimates[0].target: needed one of "both", "items", "raters", '
            'got none (id "kappa")',
        ),
    ],
)
def test_a_missing_key_is_named(
    tmp_path: Path, path: tuple[str | int, ...], problem: str
) -> None:
    assert problems_of(without(*path), tmp_path) == [problem]


def test_an_estimate_of_models_there_are_none_of_is_refused(tmp_path: Path) -> None:
    document = changed("analysis", "estimates", 0, "models", to="dummy")
    document["models"].pop()
    assert problems_of(document, tmp_path) == [
        "analysis.estimates[0].models: needed a role that some model has, "
        'got "dummy" (id "kappa")'
    ]


@pytest.mark.parametrize(
    ("sessions", "clash"),
    [
        # a_b with c, and a with b_c: one file name for two schedules
        ([("a_b", ["R1", "c"]), ("a", ["R1", "b_c"])], "a_b_c.csv"),
        # the sheet of R1 would be the schedule of R1_sheet
        ([("a", ["R1", "R1_sheet"])], "a_r1_sheet.csv"),
    ],
)
def test_ids_that_give_two_schedules_one_file_are_refused(
    tmp_path: Path, sessions: list[tuple[str, list[str]]], clash: str
) -> None:
    document = changed("sessions", to=[{"id": i, "raters": r} for i, r in sessions])
    names = dict.fromkeys(rater for _, raters in sessions for rater in raters)
    document["raters"] = [{"id": name} for name in names]
    del document["analysis"]
    found = problems_of(document, tmp_path)
    assert any(clash in text for text in found)
    assert all("a file of its own" in text for text in found)


def test_too_many_presentations_for_the_codes_are_refused(tmp_path: Path) -> None:
    document = changed("schedule", "repeats", to=20)
    model = document["models"][1]
    document["models"] += [dict(model, id=f"X{i}") for i in range(24)]
    assert problems_of(document, tmp_path) == [
        "schedule.repeats: needed at most 500 presentations a session, "
        "got 26 models times 20"
    ]


def test_all_problems_come_at_once_types_before_rules(tmp_path: Path) -> None:
    def keys() -> list[str]:
        return sorted(text.split(": ")[0] for text in problems_of(document, tmp_path))

    document = changed("models", 1, "intended_grade", to="9")
    document["stretch"]["start_deg"] = 147
    document["sessions"][1]["raters"] = ["R3"]
    rules = ["models[1].intended_grade", "sessions[1].raters[0]", "stretch.start_deg"]
    assert keys() == rules
    document["study"]["tilte"] = "x"
    document["models"][0]["catch_travel_deg"] = "far"
    # a rater without any usable key hides no other problem, nor is one unknown for it
    document["raters"] = [{"id": 1, "note": 1}, {"id": "R 2"}]
    del document["schedule"]
    of_raters = ["raters[0].id", "raters[0].note", "raters[1].id"]
    types = ["models[0].catch_travel_deg", *of_raters, "schedule", "study.tilte"]
    assert keys() == types


def test_a_byte_order_mark_is_no_error(tmp_path: Path) -> None:
    path = write(VALID, tmp_path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert read_protocol(path).study.id == "pilot"


VALUES = st.one_of(
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(),
    st.text(max_size=4),
    st.lists(st.integers(0, 3), max_size=2),
    st.just({}),
)


def places(
    document: Any, path: tuple[str | int, ...] = ()
) -> list[tuple[str | int, ...]]:
    """Every key path of a document."""
    steps: list[str | int] = []
    if isinstance(document, dict):
        steps = list(document)
    elif isinstance(document, list):
        steps = list(range(len(document)))
    found = [(*path, step) for step in steps]
    return found + [deep for p in found for deep in places(document[p[-1]], p)]


@given(path=st.sampled_from(places(VALID)), value=VALUES)
def test_no_value_anywhere_ends_in_anything_but_a_protocol_or_its_error(
    tmp_path_factory: pytest.TempPathFactory, path: tuple[str | int, ...], value: object
) -> None:
    folder = tmp_path_factory.mktemp("protocol")
    try:
        protocol = read_protocol(write(changed(*path, to=value), folder))
    except ProtocolError as error:
        problems = error.problems
    else:
        # What the file may say, the joint model takes.
        for model in protocol.models:
            assert joint_model(protocol, model.id).catch_travel > 0
        return
    assert problems
