"""Change points: found where they were made, by the least squares they claim."""

import numpy as np
import pytest

from masrel.lab.elbow.identification._catches import Changes, find_changes

N, PEAK = 400, 50
ANGLE = np.linspace(0.5, 2.3, N)
PRE = 3.0 * ANGLE


def search(
    felt: np.ndarray, *, additive: bool = False, pushed: np.ndarray | float = 0.0
) -> Changes:
    return find_changes(
        felt,
        PRE[: felt.size],
        ANGLE[: felt.size],
        first=20,
        lengths=(PEAK, 0, 0),
        additive=additive,
        pushed=pushed,
    )


def torque(
    catch: int, end: int | None, *, rise: float = 4.0, residual: float = 2.0
) -> np.ndarray:
    made = PRE.copy()
    made[catch:] = PRE[catch] + rise
    step = catch + PEAK if end is None else min(catch + PEAK, end)
    made[step:] = PRE[catch] + residual
    if end is not None:
        made[end:] += 5.8 * (ANGLE[end:] - ANGLE[end])
    return made


@pytest.mark.parametrize(
    ("catch", "end"), [(120, 260), (120, 190), (150, 185), (90, 330), (200, None)]
)
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_catch_is_found_to_the_sample(
    catch: int, end: int | None, noise: float
) -> None:
    # noise of 0.05 against steps of 2 and 4: a miss of one sample is 40 sd away; the
    # end is a kink, known to a few samples
    rng = np.random.default_rng(5)
    felt = torque(catch, end) + noise * rng.standard_normal(N)
    found = find_changes(
        felt, PRE, ANGLE, first=20, lengths=(PEAK, 0, 0), additive=False
    )
    assert found.catch == catch
    if end is None:
        assert found.end is None
    else:
        assert found.end == pytest.approx(end, abs=1 if noise == 0.0 else 8)


def test_no_pair_of_instants_fits_better_than_what_is_found() -> None:
    # the same sum of squares by numpy's lstsq for every pair of a coarser grid
    rng = np.random.default_rng(8)
    felt = torque(120, 230) + 0.3 * rng.standard_normal(N)
    found = find_changes(
        felt, PRE, ANGLE, first=20, lengths=(PEAK, 0, 0), additive=False
    )
    assert found.end is not None
    assert found.catch is not None
    best = _squares(felt, found.catch, found.end)
    others = [
        _squares(felt, catch, end)
        for catch in range(60, 200, 7)
        for end in range(catch + PEAK + 5, N - 10, 11)
    ]
    assert best < min(others)


def _squares(felt: np.ndarray, catch: int, end: int) -> float:
    # two samples at the end of the peak are left out, as the rule says
    step = catch + PEAK
    place = np.arange(N)
    used = (place < step - 1) | (place > step)
    after = np.where(place >= end, ANGLE - ANGLE[end], 0.0)
    design = np.stack(
        [
            place < catch,
            (place >= catch) & (place < step),
            place >= step,
            after,
        ],
        axis=1,
    ).astype(float)
    target = np.where(place < catch, felt - PRE, felt)
    left = np.linalg.lstsq(design[used], target[used], rcond=None)[1]
    return float(left[0])


def test_the_additive_reading_goes_on_from_the_residual_with_the_law() -> None:
    felt = torque(120, None)
    end = 250
    felt[end:] = PRE[end:] + 2.0 + 5.8 * (ANGLE[end:] - ANGLE[end])
    rng = np.random.default_rng(4)
    felt = felt + 0.05 * rng.standard_normal(N)
    found = find_changes(
        felt, PRE, ANGLE, first=20, lengths=(PEAK, 0, 0), additive=True
    )
    assert (found.catch, found.end) == (120, end)


def test_an_inertial_torque_after_the_catch_is_told_from_its_climb() -> None:
    # (5) has m·θ̈ where (3) has not: a step down at the end of the catch
    end = 230
    pushed = np.linspace(-2.0, -0.5, N)
    felt = torque(120, end)
    felt[end:] += pushed[end:]
    felt = felt + 0.05 * np.random.default_rng(9).standard_normal(N)
    found = search(felt, pushed=pushed)
    assert (found.catch, found.end) == (120, end)


def test_neither_noise_nor_a_fall_nor_a_short_stretch_is_a_catch() -> None:
    # A rise of 3 sd of the residuals over 50 samples is 21 standard errors: not in
    # 60 series, nor in 1e50.
    for seed in range(60):
        noise = 0.2 * np.random.default_rng(seed).standard_normal(N)
        found = search(PRE + noise)
        assert (found.catch, found.end) == (None, None)
    assert search(torque(150, None, rise=-3.0, residual=-3.0)).catch is None
    assert search(PRE[:22]).catch is None
