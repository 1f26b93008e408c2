"""Rating scales: grades in order, as text, with the values weights use."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from masrel._input import refuse

__all__ = [
    "MODIFIED_ASHWORTH",
    "PUBLISHED_SCALES",
    "PublishedScale",
    "Scale",
    "published_scale",
]


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
        refuse(
            (not self.grades, f"scale {self.name!r}: needs at least one grade"),
            *(
                (
                    not isinstance(grade, str) or not grade.strip(),
                    f"scale {self.name!r}: grades must be text, got {grade!r}",
                )
                for grade in self.grades
            ),
        )
        repeated = sorted(g for g, n in Counter(self.grades).items() if n > 1)
        refuse(
            (repeated, f"scale {self.name!r}: grades must differ, repeated: {repeated}")
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
        needed = f"needed one of {', '.join(self.grades)}"
        absent = f"{grade!r} is not a grade of {self.name}: {needed}"
        refuse((grade not in self.grades, absent))
        return self.grades.index(grade)


MODIFIED_ASHWORTH = Scale(name="MAS", grades=("0", "1", "1+", "2", "3", "4"))
"""The Modified Ashworth Scale (Bohannon and Smith 1987)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedScale:
    """A published scale, with the name that protocols use.

    Attributes
    ----------
    id : str
        What a protocol calls it: ``scale = "modified-ashworth"``.
    title : str
        Its name in full.
    scale : Scale
        Its name and grades.
    source : str
        Where it was published, and whose its wording is.
    meanings : mapping of str to str
        What each grade means, in masrel's own words. Empty if not even these can
        replace the owner's form.
    angles : tuple of (str, str)
        Angles that belong to a grade, in degrees: their names, and what they are.
    """

    id: str
    title: str
    scale: Scale
    source: str
    meanings: Mapping[str, str] = field(default_factory=dict, hash=False)
    angles: tuple[tuple[str, str], ...] = ()


# Nobody is known to have licensed the original wordings to everybody, so that none of
# them stands here; docs/reference/scales.md says more.
_TARDIEU_MEANINGS = MappingProxyType(
    {
        "0": "nothing resists anywhere along the movement",
        "1": "a little resistance, but no catch at an angle that one could name",
        "2": "a clear catch at one angle stops the movement, then gives way",
        "3": "at one angle clonus that dies away within 10 s of holding the stretch",
        "4": "at one angle clonus that goes on after 10 s of holding the stretch",
    }
)

_R1 = ("R1", "catch or clonus, stretched fast")
_R2 = ("R2", "end of range, stretched slowly")

_OF_THE_LITERATURE = (
    PublishedScale(
        id="modified-ashworth",
        title="Modified Ashworth Scale",
        scale=MODIFIED_ASHWORTH,
        source="Bohannon RW, Smith MB. Phys Ther 1987;67(2):206-207. "
        "doi:10.1093/ptj/67.2.206",
        meanings=MappingProxyType(
            {
                "0": "tone is as usual",
                "1": "tone slightly up: a catch that lets go, or a little resistance "
                "where the range ends",
                "1+": "tone slightly up: a catch, then a little resistance over less "
                "than half of the range that is left",
                "2": "tone clearly up over most of the range; the limb still moves "
                "with ease",
                "3": "tone strongly up; moving the limb is hard",
                "4": "the limb is fixed, bent or straight",
            }
        ),
    ),
    PublishedScale(
        id="ashworth",
        title="Ashworth Scale",
        scale=Scale(name="Ashworth", grades=("0", "1", "2", "3", "4")),
        source="Ashworth B. Practitioner 1964;192:540-542",
        meanings=MappingProxyType(
            {
                "0": "tone is as usual",
                "1": "tone slightly up: a catch when the limb is moved",
                "2": "tone clearly up; the limb still moves with ease",
                "3": "tone strongly up; moving the limb is hard",
                "4": "the limb is fixed, bent or straight",
            }
        ),
    ),
    PublishedScale(
        id="tardieu",
        title="Tardieu Scale",
        scale=Scale(name="Tardieu", grades=("0", "1", "2", "3", "4")),
        source="Tardieu G, Shentoub S, Delarue R. Rev Neurol 1954;91(2):143-144; "
        "grades of Gracies JM et al. Arch Phys Med Rehabil 2010;91(3):421-428. "
        "doi:10.1016/j.apmr.2009.11.017",
        meanings=_TARDIEU_MEANINGS,
        angles=(_R1, _R2),
    ),
    PublishedScale(
        id="modified-tardieu",
        title="Modified Tardieu Scale",
        scale=Scale(name="MTS", grades=("0", "1", "2", "3", "4")),
        source="Boyd RN, Graham HK. Eur J Neurol 1999;6(Suppl 4):S23-S35",
        meanings=_TARDIEU_MEANINGS,
        angles=(_R1, _R2),
    ),
    PublishedScale(
        id="updrs-rigidity",
        title="UPDRS, rigidity (item 22; item 3.3 of the MDS-UPDRS)",
        scale=Scale(name="UPDRS rigidity", grades=("0", "1", "2", "3", "4")),
        source="Goetz CG et al. Mov Disord 2008;23(15):2129-2170. "
        "doi:10.1002/mds.22340. The form is the International Parkinson and Movement "
        "Disorder Society's, which licenses its use: rate by that form",
    ),
)

PUBLISHED_SCALES: Mapping[str, PublishedScale] = MappingProxyType(
    {published.id: published for published in _OF_THE_LITERATURE}
)
"""Scales of the literature, by what a protocol calls them."""


def published_scale(scale: Scale) -> PublishedScale | None:
    """Return the published scale that a scale is, or is a part of.

    Parameters
    ----------
    scale : Scale
        Any scale.

    Returns
    -------
    PublishedScale or None
        The one of this name, if it has every grade of the scale.

    Examples
    --------
    >>> published_scale(Scale(name="MAS", grades=("1", "1+", "2"))).id
    'modified-ashworth'
    >>> published_scale(Scale(name="pain", grades=("0", "1"))) is None
    True
    """
    known = (
        of
        for of in _OF_THE_LITERATURE
        if of.scale.name == scale.name and set(scale.grades) <= set(of.scale.grades)
    )
    return next(known, None)
