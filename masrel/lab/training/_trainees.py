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

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

Skill = Literal["noise", "range", "lapses", "shift", "pair"]
"""How a trainee errs; what varies from trainee to trainee of a kind is one number."""

SKILLS: tuple[Skill, ...] = get_args(Skill)

BLOCK_SETS = 3
"""Presentations of a block, for each model one time."""

_LAPSES = 0.02  # share of presentations to which any grade is given
_MANY_LAPSES = 0.1  # of the kind "lapses"
_SHIFT = 0.4  # of the kind "shift", in grades
_MAX_NOISE = 50.0  # grades: what is perceived then says nothing


def confusion(
    skill: Skill, amount: float, n_grades: int, intended: Sequence[int]
) -> Floats:
    """Return the probability of each grade for each intended one.

    Parameters
    ----------
    skill : {"noise", "range", "lapses", "shift", "pair"}
        "noise" confuses neighbours; "range" does, and gives no grade that no model has;
        "lapses" does, and gives any grade in a tenth of the presentations; "shift"
        does, and grades too high; "pair" confuses the two middle models alone.
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
        # of two neighbours in the middle of the intended grades
        codes = sorted(set(intended))
        low, high = codes[(len(codes) - 1) // 2 :][:2]
        table[low, [low, high]] = table[high, [high, low]] = 1.0 - amount, amount
    else:
        table = _noisy(amount, _SHIFT if skill == "shift" else 0.0, n_grades)
    lapses = _MANY_LAPSES if skill == "lapses" else _LAPSES
    table = (1.0 - lapses) * table + lapses / n_grades
    if skill == "range":
        table *= np.isin(np.arange(n_grades), intended)
        table /= table.sum(axis=1, keepdims=True)
    return table


def _noisy(sd: float, shift: float, n_grades: int) -> Floats:
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
    kappa_of: Callable[[Floats], float],
    n_grades: int,
    intended: Sequence[int],
) -> Floats | None:
    """Return the confusion of a trainee with some kappa, or None if impossible."""
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


def draw_training(
    confusion: Floats,
    intended: Sequence[int],
    order: str,
    shape: tuple[int, int],
    rng: np.random.Generator,
) -> tuple[Integers, Integers, Floats | None]:
    """Return codes of intended grades and of those given, and how much each counts."""
    # all of the shape, so many trainees and presentations; None where all count alike
    codes = np.asarray(intended, dtype=np.int64)
    if order == "blocked":
        met = codes[draw_blocks(codes.size, shape, rng)]
        return met, draw_grades(confusion[met], rng), None
    trainees = np.arange(shape[0])
    wrong = np.zeros((shape[0], codes.size), dtype=np.int64)  # the last time
    models, grades = np.empty(shape, dtype=np.int64), np.empty(shape, dtype=np.int64)
    for at in range(shape[1]):
        shares = (1 + wrong).cumsum(axis=1)
        model = (rng.integers(0, shares[:, -1])[:, None] >= shares).sum(axis=1)
        models[:, at] = model
        grades[:, at] = draw_grades(confusion[codes[model]], rng)
        wrong[trainees, model] = grades[:, at] != codes[model]
    met = codes[models]
    return met, grades, adaptive_weights(models, grades != met, codes.size)


def adaptive_weights(
    models: Integers, wrong: NDArray[np.bool_], n_models: int
) -> Floats:
    """Return how much each presentation in adaptive order counts, 1 on average."""
    # models, from 0, and whether they were misgraded: both (..., n_presentations). A
    # model counts the less the likelier it was to be drawn, so that kappa is that of
    # models which are as likely as each other.
    tickets = np.ones((*models.shape[:-1], n_models))  # 2 if misgraded the last time
    weights = np.empty(models.shape)
    for at in range(models.shape[-1]):
        model = models[..., at, None]
        drawn = np.take_along_axis(tickets, model, axis=-1)
        weights[..., at] = tickets.sum(axis=-1) / (n_models * drawn[..., 0])
        np.put_along_axis(tickets, model, 1.0 + wrong[..., at, None], axis=-1)
    return weights


def draw_blocks(
    n_models: int, shape: tuple[int, int], rng: np.random.Generator
) -> Integers:
    """Return models in random order, each at least once in every block."""
    # takes and returns the shape (n_trainees, n_presentations)
    size = BLOCK_SETS * n_models
    n_blocks = -(-shape[1] // size)
    models = rng.integers(0, n_models, (shape[0] * n_blocks, size))
    every = np.arange(n_models)
    # a model that stands in no place of a block is lacking there
    while (lacking := (models[..., None] != every).all(axis=1).any(axis=1)).any():
        models[lacking] = rng.integers(0, n_models, (int(lacking.sum()), size))
    return models.reshape(shape[0], -1)[:, : shape[1]]


def draw_grades(probabilities: Floats, rng: np.random.Generator) -> Integers:
    """Return a grade for each row of probabilities of the grades."""
    # one grade a row, whatever shape the rows stand in
    rows = probabilities.cumsum(axis=-1)
    shares = rng.random(rows.shape[:-1])[..., None]
    codes: Integers = (shares >= rows).sum(axis=-1, dtype=np.int64)
    return codes.clip(max=rows.shape[-1] - 1)
