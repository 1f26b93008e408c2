"""What every law offers: the paper's law as one of them, and Tardieu's angles."""

from dataclasses import replace
from math import degrees, radians

import pytest

from masrel.errors import ParameterError
from masrel.lab.elbow import (
    MODELS,
    STANDARD_MODELS,
    ConstantSpeed,
    ElbowParameters,
    Joined,
    MinimumJerk,
    Reversed,
    tardieu,
)
from masrel.lab.elbow.tone import (
    ClaspKnife,
    Contracture,
    LeadPipe,
    ThresholdReflex,
)
from tests.lab.elbow.tone.joints import START, stepped


def test_models_are_registered_by_their_kind_and_the_paper_s_is_the_first() -> None:
    assert next(iter(MODELS.values())) is ElbowParameters
    assert all(model.kind == name for name, model in MODELS.items())


def test_a_catch_at_the_smallest_angle_may_be_after_that_of_a_slow_stretch() -> None:
    # nu_L is above nu_H: slower than nu_H it catches at L - 0.35 · 2 = 0.8, else at 1.4
    model = ElbowParameters(
        catch_angle_constant=1.5,
        catch_torque_constant=20.0,
        residual_ratio=0.0,
        catch_travel=1.0,
        slowest_mean_speed=2.0,
        smallest_catch_angle=1.4,
        post_catch_stiffness=0.0,
    )
    stretch = ConstantSpeed(start=START, end=2.0, speed=1.0)
    _, torque, _ = stepped(model, stretch)
    assert torque.max() > 21.26 + 3.15 * (1.4 - START)
    assert torque.max() <= model.largest_torque(start_angle=START, speed=1.0)


# Tardieu's angles

R1_AT_150 = {"HM1": 77.5, "HM2": 67.5, "HM3": 62.5, "HM4": 60.0}


@pytest.mark.parametrize("name", STANDARD_MODELS)
def test_the_paper_s_models(name: str) -> None:
    # R1 = L - 0.35 · 150, at least 60 deg; V1 is below ν_th; R2 is 146 deg
    result = tardieu(STANDARD_MODELS[name])
    assert result.catch_angles[0] is None
    assert degrees(result.catch_angle) == pytest.approx(R1_AT_150[name], abs=1e-9)
    assert degrees(result.range_angle) == pytest.approx(146.0)
    assert degrees(result.difference) == pytest.approx(
        146.0 - R1_AT_150[name], abs=1e-9
    )


@pytest.mark.parametrize("model", [Contracture(), LeadPipe()])
def test_what_does_not_catch_has_r1_at_r2(model: Contracture | LeadPipe) -> None:
    result = tardieu(model)
    assert result.catch_angles == (None, None, None)
    assert result.catch_angle == result.range_angle == model.range_end
    assert result.difference == 0.0


def test_the_threshold_reflex_catches_a_delay_after_its_threshold() -> None:
    """λ - μ·v + v·d, and not before the stretch began."""
    result = tardieu(ThresholdReflex.of_mas("1"), start_angle=radians(20))
    expected = [67.67 - v * (0.25 - 0.03) for v in (10, 100, 150)]
    assert [degrees(a or 0) for a in result.catch_angles] == pytest.approx(expected)


def test_the_clasp_knife_catches_where_it_fires() -> None:
    """r = k·(θ - λ + μ·v) is 3 N·m."""
    result = tardieu(ClaspKnife())
    expected = [56.27 - 0.25 * v + degrees(3.0 / 3.32) for v in (10, 100, 150)]
    assert [degrees(a or 0) for a in result.catch_angles] == pytest.approx(expected)


class Foreign:
    """What a loop needs of a law, without events."""

    kind, is_passive, range_end, speed_threshold = "foreign", True, 2.5, 0.3


@pytest.mark.parametrize(
    ("model", "options", "said"),
    [
        *(
            (LeadPipe(), {"speeds": speeds}, "speeds: need three above 0 deg/s")
            for speeds in ((0.1, 0.1, 1.0), (0.0, 1.0, 2.0), (3.0, 2.0, 1.0))
        ),
        (Contracture(), {"start_angle": 2.5}, "start_angle: needs 0 to less than"),
        (Foreign(), {}, "model: needs one with exact events, got Foreign"),
    ],
)
def test_what_has_no_such_angles_is_refused(model, options: dict, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        tardieu(model, **options)


@pytest.mark.parametrize("name", STANDARD_MODELS)
@pytest.mark.parametrize("post_catch", ["continuous", "additive"])
def test_no_stretch_passes_the_largest_torque(name: str, post_catch: str) -> None:
    model = replace(STANDARD_MODELS[name], post_catch=post_catch)
    shares = []
    for deg_s in (25, 60, 92, 131, 200, 300):
        speed, end = radians(deg_s), model.range_end
        there = ConstantSpeed(start=START, end=end, speed=speed)
        gentle = MinimumJerk(start=START, end=end, mean_speed=speed * 8 / 15)
        slow = ConstantSpeed(start=START, end=end - 0.1, speed=radians(15))
        late = Joined([slow, ConstantSpeed(start=end - 0.1, end=end, speed=speed)])
        bound = model.largest_torque(start_angle=START, speed=speed)
        for stretch in (there, gentle, late):
            _, torque, _ = stepped(model, Joined([stretch, Reversed(motion=stretch)]))
            shares.append(float(abs(torque).max()) / bound)
    assert max(shares) <= 1.0
    assert max(shares) > 0.8  # a bound that is reached, more or less
