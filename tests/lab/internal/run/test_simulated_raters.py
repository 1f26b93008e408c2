"""Severity of a model, and speed of a hand, of which simulated raters are made."""

import math
from collections.abc import Callable

import msgspec
import pytest

from masrel.lab.protocol import PresentationRules, Protocol, StudyPaths
from masrel.lab.run._grade_sources import intended_speeds, severity
from tests.lab.run.test_simulated import with_settings

Made = Callable[..., tuple[StudyPaths, Protocol]]
Small = tuple[StudyPaths, Protocol]


def test_severity_is_interpolated_in_the_height_of_the_catch(small: Small) -> None:
    protocol = small[1]
    # H 2.1 is half way from 1.4 (grade 1, rank 1) to 2.8 (grade 2, rank 3): rank 2.
    assert severity(protocol, protocol.models[2]) == pytest.approx(2.0, abs=1e-12)

    def at(height: float) -> float:
        dummy = protocol.models[2]
        return severity(
            protocol, msgspec.structs.replace(dummy, catch_torque_nms_rad=height)
        )

    assert at(1.75) == pytest.approx(1.5, abs=1e-12)
    assert (at(0.5), at(1.4), at(2.8), at(9.0)) == (1.0, 1.0, 3.0, 3.0)


def test_speeds_have_the_mean_and_deviation_they_say(small: Small) -> None:
    protocol = with_settings(small[1], mean_speed_deg_s=85.0, speed_sd_deg_s=15.0)
    n = 4000
    speeds = [intended_speeds(protocol, ("R1", "test", "HM1", i))[0] for i in range(n)]
    mean = math.fsum(speeds) / n
    sd = math.sqrt(math.fsum((s - mean) ** 2 for s in speeds) / (n - 1))
    assert abs(mean - 85.0) < 4.5 * 15.0 / math.sqrt(n)
    assert abs(sd / 15.0 - 1.0) < 4.5 / math.sqrt(2 * n)
    assert min(speeds) >= 40.0
    assert max(speeds) <= 130.0


def test_who_is_free_stretches_one_to_three_times(small: Small) -> None:
    free = msgspec.structs.replace(
        small[1], presentation=PresentationRules(stretches="free")
    )
    n = 3000
    made = [intended_speeds(free, ("R1", "test", "HM1", i)) for i in range(n)]
    for count in (1, 2, 3):
        # within 4.5 standard errors: false alarm 2 in a hundred thousand
        share = sum(len(speeds) == count for speeds in made) / n
        assert abs(share - 1 / 3) < 4.5 * math.sqrt(2 / 9 / n)
    once = [intended_speeds(small[1], ("R1", "test", "HM1", i)) for i in range(n)]
    assert [speeds[:1] for speeds in made] == once  # the first is as it was
    assert all(len(set(speeds)) == len(speeds) for speeds in made)


def test_models_of_one_height_count_with_their_mean(new_study: Made) -> None:
    _, protocol = new_study(("= 2.8", "= 1.4"), ("= 2.1", "= 1.4"))
    assert severity(protocol, protocol.models[2]) == 2.0  # ranks 1 and 3


def test_a_speed_is_never_near_zero(small: Small) -> None:
    protocol = with_settings(small[1], mean_speed_deg_s=50.0, speed_sd_deg_s=50.0)
    speeds = [
        intended_speeds(protocol, ("R1", "test", "HM1", i))[0] for i in range(500)
    ]
    assert min(speeds) == 10.0


def test_cues_are_followed_at_the_speeds_they_ask_for(small: Small) -> None:
    rules = PresentationRules(stretches=("slow", "fast", "slow"))
    cued = msgspec.structs.replace(small[1], presentation=rules)
    assert intended_speeds(cued, ("R1", "test", "HM1", 1)) == [10.0, 120.0, 10.0]
