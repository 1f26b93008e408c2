"""A simulated trainee who learns, for trying a training out."""

import math
from typing import ClassVar

from masrel.lab.protocol import Protocol
from masrel.lab.run._grade_sources import GradeRequest, Unattended
from masrel.lab.schedule._secret import Stream
from masrel.lab.training._trainees import confusion

# Noise of perception in grades: at first, in the end, and in how many presentations
# it comes nearer to the latter by a factor of e.
_FIRST_NOISE, _LAST_NOISE, _PRESENTATIONS = 1.2, 0.2, 12.0

_N_WORDS = 2.0**64


class SimulatedTrainee(Unattended):
    """A trainee who confuses neighbouring grades less and less.

    The grade depends on the seed of ``[simulated_raters]``, the rater, the model and
    the number of the presentation alone. Nothing here models a person.

    Parameters
    ----------
    protocol : Protocol
        The protocol.
    """

    name: ClassVar[str] = "simulated"

    def __init__(self, protocol: Protocol) -> None:
        self._seed = protocol.simulated_raters.seed
        self._grades = protocol.scale.grades
        self._intended = {
            model.id: self._grades.index(model.intended_grade)
            for model in protocol.models
            if model.intended_grade is not None
        }

    def grade(self, request: GradeRequest) -> str | None:
        """Return the grade that the trainee gives.

        Parameters
        ----------
        request : GradeRequest
            What was presented; its model has an intended grade.

        Returns
        -------
        str
            A grade of the scale.
        """
        shown = request.presentation
        learnt = math.exp(-(shown.position - 1) / _PRESENTATIONS)
        noise = _LAST_NOISE + (_FIRST_NOISE - _LAST_NOISE) * learnt
        n_grades = len(self._grades)
        table = confusion("noise", noise, n_grades, tuple(self._intended.values()))
        purpose = "trainee", request.rater, str(shown.position)
        share = Stream(self._seed, *purpose).word() / _N_WORDS
        row = table[self._intended[shown.model]].cumsum()
        return self._grades[min(int((share >= row).sum()), n_grades - 1)]
