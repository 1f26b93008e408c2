"""A hash follows the meaning of a protocol and nothing else."""

import hashlib
from pathlib import Path
from typing import Any

import msgspec
import pytest

from masrel.lab.protocol import (
    PresentationRules,
    presented_hash,
    protocol_hash,
    read_protocol,
)
from tests.lab.protocol.documents import VALID, changed, write
from tests.lab.protocol.test_rules import SIZE

QUESTIONNAIRE = {
    "id": "realism",
    "title": "Realism",
    "when": "session",
    "questions": [
        {"id": "score", "text": "How real?", "type": "whole", "low": 1, "high": 10}
    ],
}


def hashes(document: dict[str, Any], folder: Path) -> tuple[str, str]:
    protocol = read_protocol(write(document, folder))
    return protocol_hash(protocol), presented_hash(protocol)


def test_comments_layout_order_and_defaults_do_not_enter(tmp_path: Path) -> None:
    before = hashes(VALID, tmp_path)
    other = dict(reversed(changed("schedule", "repeats", to=1).items()))
    other["models"][0]["catch_angle_constant_deg"] = 130.0
    other |= {"occasions": {"practice": [], "resume": "always"}, "questionnaires": []}
    other["sessions"][1]["order_policy"] = "refuse"
    path = write(other, tmp_path)
    path.write_text("# a comment\n\n" + path.read_text(encoding="utf-8"))
    protocol = read_protocol(path)
    assert (protocol_hash(protocol), presented_hash(protocol)) == before


WHAT_A_RATER_MEETS = [
    (("study", "id"), "other"),
    (("models", 0, "catch_travel_deg"), 59.0),
    (("models", 1, "id"), "D2"),
    (("scale", "grades"), ["0", "1", "1+", "2", "3"]),
    (("schedule", "seed"), 6),
    (("elbow", "catch_slope_s"), 0.3),
    (("elbow", "rest_angle_deg"), 20.0),
    (("elbow", "residual_reading"), "decrease"),
    (("elbow", "catch_rise_s"), 0.02),
    (("models", 1, "constants"), {"rest_angle_deg": 20.0}),
    (("models", 1, "constants"), {"post_catch": "additive"}),
    (("models", 1, "constants"), {"residual_reading": "decrease"}),
    (("models", 1, "constants"), {"catch_rise_s": 0.02}),
    (("stretch", "start_deg"), 31.0),
    (("stretch", "largest_speed_deg_s"), 120.0),
    (("presentation",), {"stretches": "free"}),
    (("presentation",), {"stretches": 3}),
    (("presentation",), {"stretches": ["slow", "fast"]}),
    (("occasions",), {"practice": ["D1"]}),
    (("occasions",), {"break_after": 1}),
    (("device", "torque_limit_nm"), 19.0),
    (("device", "active_torque_limit_nm"), 9.0),
    (("device", "active_energy_limit_j"), 2.0),
    (("device", "active_speed_limit_deg_s"), 170.0),
]
WHAT_NO_RATER_MEETS = [
    (("study", "title"), "Another"),
    (("raters",), [{"id": "R1"}, {"id": "R2"}, {"id": "R3"}]),
    (("raters", 0, "site"), "north"),
    (("rater_fields",), {"years": {"type": "whole"}}),
    (("sessions", 1, "note"), "later"),
    (("analysis", "level"), 0.9),
    (("analysis", "sample_sizes"), [SIZE]),
    (("training",), {"window": 40}),
    (("occasions",), {"instructions": "Hold the wrist.", "resume": "ask"}),
    (("sessions", 1, "after"), "test"),
    (("questionnaires",), [QUESTIONNAIRE]),
    (("device",), {"torque_sensor": True, "calibration_max_days": 90}),
    (("report", "title"), "Another"),
]
WHAT_PROTOCOLS_ALWAYS_HAD = [
    (("elbow", "residual_reading"), "residual"),
    (("elbow", "catch_rise_s"), 0.0),
    (("models", 0, "constants"), {"residual_reading": "residual"}),
    (("models", 0, "constants"), {"catch_rise_s": 0.0}),
    (
        ("presentation",),
        {"stretches": 1, "stretch_limit_s": 20.0, "done_with": "enter"},
    ),
    (
        ("schedule",),
        {
            "seed": 5,
            "blocks_by": "repeat",
            "standards_apart": False,
            "strata": "none",
        },
    ),
    (("analysis", "sample_sizes"), []),
    (("models", 0, "kind"), "spastic-elbow"),
    (("models", 0, "parameters"), {}),
    (("stretch", "largest_speed_deg_s"), 131.0),
    (("device", "active_torque_limit_nm"), 10.0),
    (("device", "active_energy_limit_j"), 1),
    (("device", "active_speed_limit_deg_s"), 180.0),
]


@pytest.mark.parametrize(
    ("path", "value", "entered"),
    [
        *((*each, (True, True)) for each in WHAT_A_RATER_MEETS),
        *((*each, (True, False)) for each in WHAT_NO_RATER_MEETS),
        *((*each, (False, False)) for each in WHAT_PROTOCOLS_ALWAYS_HAD),
    ],
)
def test_what_enters_the_whole_and_what_is_presented(
    tmp_path: Path,
    path: tuple[str | int, ...],
    value: object,
    entered: tuple[bool, bool],
) -> None:
    before, after = hashes(VALID, tmp_path), hashes(changed(*path, to=value), tmp_path)
    assert (before[0] != after[0], before[1] != after[1]) == entered


def test_a_hash_is_that_of_canonical_json(tmp_path: Path) -> None:
    # Written by hand from docs/reference/protocol.md: keys sorted, no spaces, defaults
    # in.
    elbow = (
        '{"catch_slope_s":0.35,"damping_nms_rad":1.26,"inertia_kg_m2":0.0,'
        '"peak_duration_s":0.1,"post_catch":"continuous",'
        '"post_catch_stiffness_nm_rad":5.8,"range_end_deg":146.0,'
        '"slowest_mean_speed_deg_s":60.0,"smallest_catch_angle_deg":60.0,'
        '"speed_threshold_deg_s":20.0,"stiffness_nm_rad":3.15}'
    )
    device = (
        '{"backend":"simulated","dead_zone_deg_s":0.1,"friction_compensation":0.9,'
        '"friction_coulomb_nm":0.189,"friction_viscous_nms_rad":0.168,'
        '"frozen_limit_ms":10.0,"full_speed_deg_s":2.0,"highest_angle_deg":185.0,'
        '"jump_limit_deg":0.3,"lowest_angle_deg":-5.0,"missed_replies_limit":2,'
        '"missed_replies_per_100_limit":10,'
        '"missed_ticks_limit":20,"puck_channel":"can0",'
        '"puck_checks_torque":true,"puck_direction":1,"puck_gear_ratio":18.8,'
        '"puck_interface":"socketcan","puck_node":1,"puck_properties":null,"ramp_ms":50.0,"rate_hz":1000,'
        '"slip_speed_drop_deg_s":40.0,"soft_stop_deg":5.0,"soft_stop_torque_nm":10.0,'
        '"speed_limit_deg_s":400.0,"stale_limit_ms":5.0,"standing_limit_ms":500.0,'
        '"standing_torque_nm":2.0,"torque_limit_nm":20.0,'
        '"torque_rate_limit_nm_s":12000.0,"watchdog_ms":50.0}'
    )
    models = (
        '[{"catch_angle_constant_deg":130.0,"catch_torque_nms_rad":1.4,'
        '"catch_travel_deg":60.0,"id":"HM1","intended_grade":"1",'
        '"residual_ratio":0.15,"role":"standard"},'
        '{"catch_angle_constant_deg":125.5,"catch_torque_nms_rad":1.7,'
        '"catch_travel_deg":55.0,"id":"D1","intended_grade":null,'
        '"residual_ratio":0.2,"role":"dummy"}]'
    )
    text = (
        f'{{"device":{device},"elbow":{elbow},"models":{models},'
        '"scale":{"grades":["0","1","1+","2"],"name":"MAS"},'
        '"schedule":{"repeats":1,"scheme":"random-order","seed":5},'
        '"stretch":{"end_deg":146.0,"start_deg":30.0},"study":"pilot"}'
    )
    expected = hashlib.sha256(text.encode("utf-8")).hexdigest()
    assert hashes(VALID, tmp_path)[1] == expected


# of protocol and of what is presented, before joints had variants, when each
# presentation was one stretch, and when nobody was asked anything else
HASHES = {
    "hess2012": (
        "c75e77d3b6a935f5af0272f4aebcc1ac71a629cbdc3785b8e1547dbbaf02f1cf",
        "4e2ff35980dc9bd148d7b364448eea22dd3add991aca81869425309dd67a7bc5",
    ),
    "small": (
        "3a06b00a10128161f2d1a53de31afc44599b9201cecfdca01a725e7192c8a9b2",
        "47cd4ccbfc74809440d7f3252dc501007cdfca6aea827e2ecf904fad801e91d1",
    ),
}


@pytest.mark.parametrize("study", sorted(HASHES))
def test_the_bundled_studies_keep_their_hashes(study: str) -> None:
    # Schedules that anybody drew from them stay good.
    folder = Path(__file__).parents[3] / "studies" / study
    protocol = read_protocol(folder / "protocol.toml")
    sections = ("design", "grades", "agreement", "intended", "speeds", "traces")
    if study == "hess2012":
        sections = (*sections[:4], "in-person", "test-retest", *sections[4:])
    protocol = msgspec.structs.replace(
        protocol,
        presentation=PresentationRules(),
        questionnaires=(),
        report=msgspec.structs.replace(protocol.report, sections=sections),
    )
    assert (protocol_hash(protocol), presented_hash(protocol)) == HASHES[study]


def test_a_model_that_says_what_all_follow_is_no_change(tmp_path: Path) -> None:
    shared = {"post_catch": "additive", "rest_angle_deg": 25.0, "catch_rise_s": 0.01}
    document = changed("elbow", to=shared)
    before = hashes(document, tmp_path)
    document["models"][0]["constants"] = shared
    assert hashes(document, tmp_path) == before
    # ... and at the default it is another law than the study's
    document["models"][0]["constants"] = {"catch_rise_s": 0.0}
    assert hashes(document, tmp_path) != before
