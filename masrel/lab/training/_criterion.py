"""The criterion that ends a training: weighted kappa with the intended grades.

After every set of presentations (as many as there are models) the last ones are looked
at, in runs of every length up to the window. The evidence of a run of m is m times what
its kappa has above the reference, halfway between a kappa that is insufficient and one
that is sufficient; that of the training, at the time, is the largest of all runs. The
training is passed once this comes to the boundary.

It is the cumulative sum for learning curves [1]_ with kappa in place of a mean: what
was before the run says nothing about the rater as he or she is now.

.. [1] Biau, D. J., Porcher, R. (2010). A method for monitoring a process from an out of
   control to an in control state: application to the learning curve. Statistics in
   Medicine, 29(18), 1900-1909. https://doi.org/10.1002/sim.3947
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from masrel.agreement import COEFFICIENTS, declared_weights
from masrel.agreement._engine import Formula
from masrel.lab.protocol import Protocol
from masrel.lab.training._trainees import (
    SKILLS,
    Floats,
    Integers,
    Skill,
    confusion_with_kappa,
    draw_training,
)

_COHEN = cast("Formula", COEFFICIENTS["cohen_kappa"].formula)


N_SIMULATED = 5_000
"""Simulated trainees of each kind: an error of 5 % is then known to 0.3 %."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Criterion:
    """What a rater must show, and how it is looked at.

    Attributes
    ----------
    grades : tuple of str
        The scale, least first.
    weights : str
        Name of the weights of kappa.
    intended : tuple of int
        Code of the intended grade of each model that is presented.
    insufficient, sufficient : float
        The two kappas between which either decision is right.
    window : int
        Presentations of the longest run.
    max_presentations : int
        After as many the training ends.
    order : {"blocked", "adaptive"}
        How models are drawn.
    """

    grades: tuple[str, ...]
    weights: str
    intended: tuple[int, ...]
    insufficient: float
    sufficient: float
    window: int
    max_presentations: int
    order: str = "blocked"

    @property
    def reference(self) -> float:
        """Kappa from which on a run speaks for the rater."""
        return 0.5 * (self.insufficient + self.sufficient)

    @property
    def n_models(self) -> int:
        """Models that are presented, which make a set."""
        return len(self.intended)

    def evidence(
        self, intended: Integers, codes: Integers, weights: Floats | None = None
    ) -> Floats:
        """Return the evidence after each set of presentations.

        Parameters
        ----------
        intended, codes : ndarray of int, shape (..., n_presentations)
            Codes of the intended grades and of the rater's, in order.
        weights : ndarray of float, shape (..., n_presentations), optional
            How much each presentation counts; alike by default.

        Returns
        -------
        ndarray of float, shape (..., n_presentations // n_models)
            The largest of all runs that end there; minus infinity where kappa is
            undefined in all of them.
        """
        sums = self._sums(intended, codes, weights)  # (..., n_sets + 1, n_features)
        n_sets = sums.shape[-2] - 1
        largest = np.full((*sums.shape[:-2], n_sets), -np.inf)
        for length in range(1, min(n_sets, self.window // self.n_models) + 1):
            run = sums[..., length:, :] - sums[..., :-length, :]
            excess = _COHEN.value(run, self._disagreement()) - self.reference
            evidence = length * self.n_models * np.nan_to_num(excess, nan=-np.inf)
            looks = largest[..., length - 1 :]
            np.maximum(looks, evidence, out=looks)
        return largest

    def kappa(self, confusion: Floats) -> float:
        """Return kappa of a rater who grades by these probabilities.

        Parameters
        ----------
        confusion : ndarray of float, shape (n_grades, n_grades)
            Probability of each grade (columns) for each intended one (rows).

        Returns
        -------
        float
            Weighted kappa, each model presented equally often.
        """
        freq = np.bincount(self.intended, minlength=len(self.grades))
        sums = (freq[:, None] * confusion).ravel() @ self._features()
        return float(_COHEN.value(sums, self._disagreement()))

    def _disagreement(self) -> Floats:
        # of every two grades
        return np.asarray(declared_weights(self.weights, self.grades).v)

    def _features(self) -> Floats:
        # (n_grades², n_features): of each pair of an intended grade and another
        ranks = np.arange(len(self.grades))
        pairs = np.stack(np.meshgrid(ranks, ranks, indexing="ij"), axis=-1)
        return np.asarray(
            _COHEN.features(pairs.reshape(-1, 2), self._disagreement()).rows()
        )

    def _sums(
        self, intended: Integers, codes: Integers, weights: Floats | None
    ) -> Floats:
        # cumulative over sets, from 0 on
        n_sets = intended.shape[-1] // self.n_models
        cells = (intended * len(self.grades) + codes)[..., : n_sets * self.n_models]
        features = self._features()[cells]
        if weights is not None:
            features = features * weights[..., : cells.shape[-1], None]
        by_set = features.reshape(
            *cells.shape[:-1], n_sets, self.n_models, features.shape[-1]
        ).sum(axis=-2)
        sums = np.zeros((*cells.shape[:-1], n_sets + 1, features.shape[-1]))
        np.cumsum(by_set, axis=-2, out=sums[..., 1:, :])
        return sums


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """The boundary of a criterion, with the errors that it makes.

    Attributes
    ----------
    boundary : float
        The evidence that passes a training.
    false_passes : mapping of str to float
        By kind of trainee, the share that passes although kappa stays at the
        insufficient one; ``docs/howto/laboratory/training.md`` describes each kind. A
        kind is lacking where none of it is so bad.
    false_fails : mapping of str to float
        The same of those that do not pass although kappa is at the sufficient one from
        the first presentation on.
    """

    boundary: float
    false_passes: Mapping[Skill, float] = field(repr=False)
    false_fails: Mapping[Skill, float] = field(repr=False)

    @property
    def false_fail(self) -> float:
        """The largest share of any kind that fails wrongly; 1 if no kind can pass."""
        return max(self.false_fails.values(), default=1.0)


def training_criterion(protocol: Protocol) -> Criterion:
    """Return the criterion that a protocol sets.

    Parameters
    ----------
    protocol : Protocol
        Its scale, its models with intended grades, and ``[training]``.

    Returns
    -------
    Criterion
        What a rater must show.
    """
    rules, grades = protocol.training, protocol.scale.grades
    return Criterion(
        grades=grades,
        weights=rules.weights,
        intended=tuple(
            grades.index(model.intended_grade)
            for model in protocol.models
            if model.intended_grade is not None
        ),
        insufficient=rules.kappa_insufficient,
        sufficient=rules.kappa_sufficient,
        window=rules.window,
        max_presentations=rules.max_presentations,
        order=rules.order,
    )


def calibrate(
    criterion: Criterion,
    *,
    false_pass: float,
    rng: np.random.Generator | int,
    n_simulated: int = N_SIMULATED,
) -> Calibration:
    """Calibrate the boundary on simulated trainees.

    Parameters
    ----------
    criterion : Criterion
        What a rater must show.
    false_pass : float
        Share of trainees who may pass, in all looks together, though their kappa stays
        at the insufficient one: the largest of all kinds of trainees.
    rng : Generator or int
        Where randomness comes from.
    n_simulated : int, optional
        Trainees of each kind.

    Returns
    -------
    Calibration
        The smallest boundary at which fewer than `false_pass` do, by two standard
        errors of the simulation, and the errors it makes.

    Examples
    --------
    >>> criterion = Criterion(
    ...     grades=("0", "1", "2", "3"), weights="linear", intended=(0, 1, 2, 3),
    ...     insufficient=0.4, sufficient=0.8, window=48, max_presentations=48)
    >>> result = calibrate(criterion, false_pass=0.05, rng=1, n_simulated=500)
    >>> result.false_fail < 0.1
    True
    """
    generator = np.random.default_rng(rng)
    bad, good = (
        _simulated_evidence(criterion, kappa, n_simulated, generator)
        for kappa in (criterion.insufficient, criterion.sufficient)
    )
    boundary = max((_boundary(e, false_pass) for e in bad.values()), default=0.0)
    return Calibration(
        boundary=boundary,
        false_passes={kind: float((e >= boundary).mean()) for kind, e in bad.items()},
        false_fails={
            kind: float(1.0 - (e >= boundary).mean()) for kind, e in good.items()
        },
    )


def _simulated_evidence(
    criterion: Criterion, kappa: float, n_simulated: int, rng: np.random.Generator
) -> dict[Skill, Floats]:
    # By kind the largest evidence of each trainee with this kappa, (n_simulated,); not
    # of a kind that has none
    largest = {}
    shape = n_simulated, criterion.max_presentations
    for skill in SKILLS:
        confusion = confusion_with_kappa(
            skill, kappa, criterion.kappa, len(criterion.grades), criterion.intended
        )
        if confusion is not None:
            drawn = draw_training(
                confusion, criterion.intended, criterion.order, shape, rng
            )
            largest[skill] = criterion.evidence(*drawn).max(axis=1)
    return largest


def _boundary(largest: Floats, share: float) -> float:
    # largest evidence of each trainee: (n_simulated,). Two standard errors fewer come
    # to the boundary than may, so that other trainees seldom pass more often.
    values, n = np.sort(largest)[::-1], largest.size
    n_passing = share * n - 2.0 * math.sqrt(share * (1.0 - share) * n)
    return float(np.nextafter(values[max(0, int(n_passing))], np.inf))
