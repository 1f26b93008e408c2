"""Tardieu's angles, against the catch angle of each law by hand."""

from math import degrees, radians

import pytest

from masrel.errors import ParameterError
from masrel.lab.elbow import STANDARD_MODELS, SampledJoint, tardieu
from masrel.lab.elbow.tone import (
    ClaspKnife,
    Clonus,
    Contracture,
    LeadPipe,
    ThresholdReflex,
)

R1_AT_150 = {"HM1": 77.5, "HM2": 67.5, "HM3": 62.5, "HM4": 60.0}


@pytest.mark.parametrize("name", STANDARD_MODELS)
def test_the_paper_s_models(name: str) -> None:
    """R1 = L - 0.35 · 150, at least 60 deg; V1 is below ν_th; R2 is 146 deg."""
    result = tardieu(STANDARD_MODELS[name])
    assert result.catch_angles[0] is None
    assert degrees(result.catch_angle) == pytest.approx(R1_AT_150[name], abs=1e-9)
    assert degrees(result.range_angle) == pytest.approx(146.0)
    assert degrees(result.difference) == pytest.approx(
        146.0 - R1_AT_150[name], abs=1e-9
    )


def test_a_slower_stretch_catches_later() -> None:
    _, falling, fast = tardieu(STANDARD_MODELS["HM1"]).catch_angles
    assert falling is not None
    assert fast is not None
    assert degrees(falling) == pytest.approx(130 - 0.35 * 100, abs=1e-9)
    assert fast < falling


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


def test_clonus_is_set_off_by_fast_stretches_only() -> None:
    slow, falling, fast = tardieu(Clonus()).catch_angles
    assert slow is None
    assert falling == pytest.approx(fast) == pytest.approx(radians(90))


@pytest.mark.parametrize("speeds", [(0.1, 0.1, 1.0), (0.0, 1.0, 2.0), (3.0, 2.0, 1.0)])
def test_speeds_out_of_order_are_refused(speeds: tuple[float, float, float]) -> None:
    with pytest.raises(ParameterError, match="speeds: need three above 0 deg/s"):
        tardieu(LeadPipe(), speeds=speeds)


def test_a_start_beyond_the_range_is_refused() -> None:
    with pytest.raises(ParameterError, match="start_angle: needs 0 to less than"):
        tardieu(Contracture(), start_angle=2.5)


def test_a_model_without_exact_events_is_refused() -> None:
    class Foreign:
        kind = "foreign"
        is_passive = True
        range_end = 2.5
        speed_threshold = 0.3

        def stepper(self, start_angle: float) -> SampledJoint:
            return SampledJoint(STANDARD_MODELS["HM1"], start_angle=start_angle)

        def largest_torque(self, *, start_angle: float, speed: float) -> float:
            return start_angle + speed

        def largest_slope(self, *, speed: float) -> tuple[float, float]:
            return speed, speed

    with pytest.raises(ParameterError, match="model: needs one with exact events"):
        tardieu(Foreign())
