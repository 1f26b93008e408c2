"""A rating scale: its grades in order, as text, with the values weights use."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from masrel.errors import ParameterError

__all__ = ["MODIFIED_ASHWORTH", "Scale"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """A rating scale with its grades in declared order.

    Attributes
    ----------
    name : str
        Short name, such as ``"MAS"``.
    grades : tuple of str
        Every grade a rater may give, least first. Grades are text: "1" and "1+"
        are names, not numbers.
    values : tuple of float
        What the grades weigh: their values if all are numbers, else 1, 2, 3, ...

    Raises
    ------
    ParameterError
        If there are no grades, a grade is empty, or two are the same.

    Examples
    --------
    >>> MODIFIED_ASHWORTH.code("1+"), MODIFIED_ASHWORTH.values
    (2, (1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    >>> Scale(name="pain", grades=("0", "2.5", "10")).values
    (0.0, 2.5, 10.0)
    """

    name: str
    grades: tuple[str, ...]
    values: tuple[float, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.grades:
            raise ParameterError(f"scale {self.name!r}: needs at least one grade")
        for grade in self.grades:
            if not isinstance(grade, str) or not grade.strip():
                raise ParameterError(
                    f"scale {self.name!r}: grades must be text, got {grade!r}"
                )
        if len(set(self.grades)) < len(self.grades):
            repeated = sorted(g for g, n in Counter(self.grades).items() if n > 1)
            raise ParameterError(
                f"scale {self.name!r}: grades must differ, repeated: {repeated}"
            )
        ranks = tuple(float(rank) for rank in range(1, len(self.grades) + 1))
        try:
            numbers = tuple(float(grade) for grade in self.grades)
        except ValueError:
            numbers = ranks
        are_values = len(set(numbers)) == len(ranks) and all(
            map(math.isfinite, numbers)
        )
        object.__setattr__(self, "values", numbers if are_values else ranks)

    def weigh(self, rows: Iterable[Iterable[str | None]]) -> list[list[float | None]]:
        """Replace grades by their values.

        Parameters
        ----------
        rows : iterable of iterable of str or None
            Grades of the scale; None is missing.

        Returns
        -------
        list of list of float or None
            Their values, missing ones as they were.

        Examples
        --------
        >>> Scale(name="pain", grades=("0", "2.5", "10")).weigh([["10", None]])
        [[10.0, None]]
        """
        value: dict[str | None, float | None] = {None: None}
        value |= zip(self.grades, self.values, strict=True)
        return [[value[grade] for grade in row] for row in rows]

    def code(self, grade: str) -> int:
        """Return the rank of a grade, from 0.

        Parameters
        ----------
        grade : str
            A grade of the scale.

        Returns
        -------
        int
            Its position in the declared order.

        Raises
        ------
        ParameterError
            If the scale has no such grade.
        """
        if grade not in self.grades:
            raise ParameterError(
                f"{grade!r} is not a grade of {self.name}: "
                f"needed one of {', '.join(self.grades)}"
            )
        return self.grades.index(grade)


MODIFIED_ASHWORTH = Scale(name="MAS", grades=("0", "1", "1+", "2", "3", "4"))
"""The Modified Ashworth Scale (Bohannon and Smith 1987)."""
