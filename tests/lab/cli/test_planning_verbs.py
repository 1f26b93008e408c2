"""init, check and schedule as a user calls them."""

from pathlib import Path

import pytest

from tests.cli.process import Caller

LIMIT = ("torque_limit_nm = 20.0", "torque_limit_nm = 19.9")
SLOW = ("speed_limit_deg_s = 400", "speed_limit_deg_s = 140")
PULLING = ("beat_rate_hz = 5.0", "base_torque_nm = 2.1")


# template, what is changed, sentences
@pytest.mark.parametrize(
    ("template", "edits", "said"),
    [
        # HM4 at 131 deg/s, by hand: caught at 60 deg, with b·v + k·30 deg + Q·H·v and
        # the climb over 76 deg of k_post, 2.881 + 1.649 + 6.950 + 7.693 N·m.
        (
            "small",
            [("torque_limit_nm = 20.0", "torque_limit_nm = 19.1")],
            "models[3]: needed at most device.torque_limit_nm (19.1 N·m) at "
            'stretch.largest_speed_deg_s (131 deg/s), got 19.174 N·m (id "HM4")',
        ),
        (
            "small",
            [
                ("torque_limit_nm = 20.0", "torque_limit_nm = 19.1"),
                ("end_deg = 146.0\n", "end_deg = 146.0\nlargest_speed_deg_s = 130.0\n"),
            ],
            "stops a stretch that is for a moment faster than 130 deg/s with HM4",
        ),
        # 9.342 N·m, and 9.831 at 131 deg/s, are 19.9 at 140.7 deg/s; the others get
        # there later, HM1 beyond the peak of a stretch at 131.
        (
            "small",
            [LIMIT],
            "note: P: device.torque_limit_nm (19.9 N·m) stops a stretch that is for a "
            "moment faster than 140 deg/s with HM4, and 2 more at higher speeds: raise "
            "it, or have raters practise slower ones",
        ),
        ("small", [LIMIT, SLOW], ""),  # no stretch is that fast
        (
            "small",
            [LIMIT, SLOW, ("torque_limit", "standing_limit_ms = 250.0\ntorque_limit")],
            "note: P: device.standing_limit_ms (250 ms) stops an arm that is held "
            "still for 5 s with any model: 500 ms let raters watch for clonus",
        ),
        # the clasp-knife reflex is the only one behind the guard that grows so
        (
            "tone",
            [],
            "device.active_torque_limit_nm (10 N·m) stops a stretch that is for a "
            "moment faster than 240 deg/s with K3: ",
        ),
        # 9 N·m beside the 1.5 that it has by itself. F3, which is passive, may have 12.
        (
            "tone",
            [("beat_rate_hz = 5.0", "beat_torque_nm = 9.0")],
            "models[9]: needed at most device.active_torque_limit_nm (10 N·m) at "
            'stretch.largest_speed_deg_s (131 deg/s), got 10.500 N·m (id "B3")',
        ),
        # The contracture holds 11.475 N·m at its end, and with 3 N·m of friction comes
        # 0.9 · (0.168 · 2.286 + 3) N·m on the way back.
        (
            "tone",
            [
                ("torque_limit_nm = 20.0", "torque_limit_nm = 14.5"),
                ("[device]\n", "[device]\nfriction_coulomb_nm = 3.0\n"),
            ],
            '), got 14.517 N·m (id "F3")',
        ),
        # 2002 N·m/rad · 1 ms / 2 = 1.001 N·m·s/rad, and 0.3 · 0.0898 of damping
        (
            "tone",
            [
                ("end_angle_deg = 116.0 ", "end_stiffness_nm_rad = 2000.0 # "),
                ("range_end_deg = 126.0 ", "end_steepness_per_rad = 30.0 # "),
            ],
            "models[7]: needed slopes that device.friction_viscous_nms_rad (0.168 "
            "N·m·s/rad) makes passive at 1000 Hz, got 2002 N·m/rad and 0.3 N·m·s/rad, "
            'which need 1.03 (id "F3")',
        ),
        (
            "tone",
            [PULLING],
            "models[9]: needed at most device.standing_torque_nm (2 N·m) where the "
            'stretch starts, got 2.100 N·m (id "B3")',
        ),
        (
            "tone",
            [PULLING, ("start_deg = 30.0", "start_deg = 126.0")],
            "models[7]: needed an end of range beyond stretch.start_deg (126), got 126 "
            'deg (id "F3")',
        ),
        (
            "small",
            [('backend = "simulated"', 'backend = "nonesuch"')],
            "device.backend: needed one of moteus, puck, simulated, got",
        ),
        (
            "small",
            [("fleiss_kappa", "flies_kappa")],
            "got 'flies_kappa'; did you mean fleiss_kappa? (id \"kappa\")",
        ),
    ],
)
def test_check_says_what_the_device_or_the_plan_cannot_do(
    masrel: Caller,
    template: str,
    edits: list[tuple[str, str]],
    said: str,
    tmp_path: Path,
) -> None:
    masrel("init", tmp_path / "new", "--study", template)
    protocol = tmp_path / "new" / "protocol.toml"
    text = protocol.read_text(encoding="utf-8")
    for before, after in edits:
        assert before in text
        text = text.replace(before, after, 1)
    protocol.write_text(text, encoding="utf-8")
    is_problem = bool(said) and "stops" not in said
    done = masrel("check", tmp_path / "new")
    assert (done.code, bool(done.err)) == (2 * is_problem, bool(said))
    assert said.replace(" P: ", f" {protocol}: ") in done.err
