"""Simulated trainees: how they confuse grades, and what they meet.

A trainee perceives the intended grade with noise on the scale of the grades, which are
one apart, and gives the grade it is nearest to; now and then a lapse gives any grade.
Nothing here models a person.
"""

import math
from collections.abc import Callable, Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Integers = NDArray[np.int64]

Skill = Literal["noise", "lapses", "shift", "pair"]
"""How a trainee errs; what varies from trainee to trainee of a kind is one number."""

SKILLS: tuple[Skill, ...] = get_args(Skill)

BLOCK_REPEATS = 2
"""How often a block presents each model."""

LAPSES = 0.02
"""Share of presentations to which a trainee gives any grade."""

_MANY_LAPSES = 0.1  # of the kind "lapses"
_SHIFT = 0.4  # of the kind "shift", in grades
_MAX_NOISE = 50.0  # grades: what is perceived then says nothing


def confusion(
    skill: Skill, amount: float, n_grades: int, intended: Sequence[int]
) -> _Floats:
    """Return the probability of each grade for each intended one.

    Parameters
    ----------
    skill : {"noise", "lapses", "shift", "pair"}
        "noise" confuses neighbours, "lapses" does and lapses in a tenth of the
        presentations, "shift" does and grades too high, "pair" confuses the two
        middle models alone.
    amount : float
        Standard deviation of the noise in grades; of "pair" the probability of giving
        the other's grade.
    n_grades : int
        Grades of the scale.
    intended : sequence of int
        Codes of the models' intended grades.

    Returns
    -------
    ndarray of float, shape (n_grades, n_grades)
        Intended grades in rows.

    Examples
    --------
    >>> confusion("noise", 0.5, 3, [0, 1, 2]).round(2)
    array([[0.83, 0.16, 0.01],
           [0.16, 0.68, 0.16],
           [0.01, 0.16, 0.83]])
    """
    if skill == "pair":
        table = np.eye(n_grades)
        low, high = _middle(intended)
        table[low, [low, high]] = table[high, [high, low]] = 1.0 - amount, amount
    else:
        table = _noisy(amount, _SHIFT if skill == "shift" else 0.0, n_grades)
    lapses = _MANY_LAPSES if skill == "lapses" else LAPSES
    return (1.0 - lapses) * table + lapses / n_grades


def _middle(intended: Sequence[int]) -> tuple[int, int]:
    # two neighbours among the intended grades
    codes = sorted(set(intended))
    middle = (len(codes) - 1) // 2
    return codes[middle], codes[middle + 1]


def _noisy(sd: float, shift: float, n_grades: int) -> _Floats:
    # (n_grades, n_grades): of a normal variable around each grade, rounded
    cuts = np.arange(n_grades - 1) + 0.5
    distances = (cuts - np.arange(n_grades)[:, None] - shift) / (sd * math.sqrt(2.0))
    below = np.ones((n_grades, n_grades + 1))
    below[:, 0] = 0.0
    below[:, 1:-1] = 0.5 * (1.0 + np.vectorize(math.erf)(distances))
    return np.diff(below, axis=1)


def confusion_with_kappa(
    skill: Skill,
    kappa: float,
    kappa_of: Callable[[_Floats], float],
    n_grades: int,
    intended: Sequence[int],
) -> _Floats | None:
    """Return the confusion of a trainee with some kappa, or None if there is none."""
    low, high = 1e-3, 1.0 if skill == "pair" else _MAX_NOISE
    ends = [kappa_of(confusion(skill, x, n_grades, intended)) for x in (low, high)]
    if not ends[1] <= kappa <= ends[0]:
        return None
    for _ in range(60):  # kappa falls as the amount grows
        middle = 0.5 * (low + high)
        if kappa_of(confusion(skill, middle, n_grades, intended)) > kappa:
            low = middle
        else:
            high = middle
    return confusion(skill, low, n_grades, intended)


def draw_blocks(
    intended: Sequence[int], shape: tuple[int, int], rng: np.random.Generator
) -> _Integers:
    """Return intended grades in blocks of random order."""
    # takes and returns the shape (n_trainees, n_presentations)
    block = np.repeat(np.asarray(intended, dtype=np.int64), BLOCK_REPEATS)
    n_blocks = -(-shape[1] // block.size)
    drawn = rng.permuted(np.tile(block, (shape[0], n_blocks, 1)), axis=2)
    return drawn.reshape(shape[0], -1)[:, : shape[1]]


def draw_grades(probabilities: _Floats, rng: np.random.Generator) -> _Integers:
    """Return a grade for each row of probabilities of the grades."""
    # one grade a row, whatever shape the rows stand in
    rows = probabilities.cumsum(axis=-1)
    shares = rng.random(rows.shape[:-1])[..., None]
    codes: _Integers = (shares >= rows).sum(axis=-1, dtype=np.int64)
    return codes.clip(max=rows.shape[-1] - 1)
