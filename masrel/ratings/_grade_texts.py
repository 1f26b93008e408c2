"""What a cell of a foreign table means: which grade it is, or that there is none.

Every text that occurs is looked at once. Two texts are one grade only where that cannot
be wrong, and each time it is noted; whatever else looks alike is warned of.
"""

import math
import re
import shlex
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cache
from itertools import count, pairwise

import numpy as np
from numpy.typing import NDArray

from masrel.errors import ParameterError, RatingsError
from masrel.scales import MODIFIED_ASHWORTH, Scale

USUAL_MISSING = ("", "NA")
"""Cells that stand for a missing grade unless the scale has them."""

# Whole numbers that programs write for "missing", where they lie far from the others.
_CODES = frozenset(
    sign * int(digit * n) for digit in "789" for n in range(1, 6) for sign in (1, -1)
) | {-1, 999999, -999999}

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,5})?", re.ASCII)
_NUMBER_BEGINS = frozenset("+-.0123456789")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+", re.ASCII)
_HALF_GRADE = re.compile(r"\d+([+-]+|[A-Za-z])")  # 1+, 4-, 2a: numbers, more or less
_UNPLAIN = re.compile(r"[^\x21-\x7e]")  # blanks, and letters that may have two forms
_INVISIBLE = re.compile("[\u200b-\u200f\u2060\ufeff\u00ad]")
_NEEDS_CARE = re.compile(r"[\s'\"`=,.:;!]")
# Dashes, and Cyrillic and Greek letters that look like Latin ones.
_LOOK_ALIKE = str.maketrans(
    "‐‑‒–—―−‘’“”авекмнорстухіαικνορτυχ", "-------''\"\"abekmhopctyxiaikvoptux"
)
_SHOWN = 6  # texts that a message lists
_LONGEST = 60  # letters of a text that it shows
_SCALE = 10  # widest span of grades of a scale, rather than of measurements
_MANY_GRADES = 15  # of the longest usual scale: Borg's, from 6 to 20

MEASUREMENTS = "look like measurements"
"""What a warning says that concerns only coefficients of equal grades."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeOptions:
    """What a caller says of the grades."""

    categories: tuple[str, ...] | None = None  # every grade of the scale in order
    missing_codes: tuple[str, ...] = ()  # codes of missing grades beside the usual ones
    decimal: str = "."


@dataclass(slots=True, kw_only=True)
class Grades:
    """The texts of a table's cells as grades."""

    scale: Scale
    codes: NDArray[np.int64]  # (n_texts,): place in the scale, -1 where missing
    merged: dict[str, list[str]] = field(default_factory=dict)  # grade to its spellings
    n_missing: dict[str, int] = field(default_factory=dict)  # code to number of cells
    warnings: list[str] = field(default_factory=list)

    @property
    def is_ordered(self) -> bool:
        """Whether the order of the scale is more than that of the alphabet."""
        return self.scale.name != "observed" or all(map(is_number, self.scale.grades))


def coded_texts(cells: NDArray[np.object_]) -> tuple[NDArray[np.int64], list[str]]:
    """Return the texts of cells and where each occurs; blanks around them go."""
    # (n,) -> (n,) places in the texts
    listed = cells.tolist()
    number: dict[str, int] = defaultdict(count().__next__)  # a new one is the next
    codes = np.arange(len(listed))
    if _are_different(listed):
        uniques = listed
    else:
        codes = np.fromiter(map(number.__getitem__, listed), np.int64, len(listed))
        uniques = list(number)
    if not _UNPLAIN.search("".join(uniques)):
        return codes, uniques
    texts = [_plain(text) for text in uniques]
    place: dict[str, int] = {}
    places = [place.setdefault(text, len(place)) for text in texts]
    if len(place) < len(texts):
        codes = np.array(places, dtype=np.int64)[codes]
    return codes, list(place)


def _are_different(texts: Sequence[str]) -> bool:
    # a few tell of nearly all columns that texts are there twice
    few = texts[:1000]
    return len(set(few)) == len(few) and len(set(texts)) == len(texts)


def _plain(text: str) -> str:
    # One letter may be written in two ways that are the same by Unicode's own rule.
    text = text.strip()
    return text if text.isascii() else unicodedata.normalize("NFC", text).strip()


def is_number(text: str) -> bool:
    """Return whether a text is a finite decimal number in ASCII."""
    return bool(_NUMBER.fullmatch(text)) and math.isfinite(float(text))


def read_grades(
    texts: Sequence[str],
    freq: NDArray[np.int64],
    options: GradeOptions,
    where: Callable[[int], str],
) -> Grades:
    """Decide which grade each text is; `where` says where a text first stands."""
    # freq (n_texts,): how many cells have each
    options = _checked(options)
    declared = options.categories or ()
    absent = set(_missing_codes(texts, options))
    as_number = {text: _decimal_point(text, options.decimal) for text in texts}
    places = [i for i, text in enumerate(texts) if text not in absent and freq[i]]
    grades = Grades(
        scale=MODIFIED_ASHWORTH, codes=np.full(len(texts), -1, dtype=np.int64)
    )
    for text, n in zip(texts, freq.tolist(), strict=True):
        if text in absent and n:
            grades.n_missing[text] = int(n)
    met = {texts[i]: int(freq[i]) for i in places}
    if not met:
        raise RatingsError("needed at least one grade, got none")
    first = {texts[i]: i for i in places}

    def stands(text: str) -> str:
        return where(first[text])

    if declared:
        grades.scale = Scale(name="declared", grades=declared)
        grade_of = _declared_grades(met, declared, as_number, stands)
    else:
        _refuse_doubtful(met, options, stands)
        grade_of = _observed_grades(met, as_number, stands)
        grades.scale = _observed_scale(list(dict.fromkeys(grade_of.values())))
        grades.warnings += _doubts_of_grades(met, grade_of, as_number, stands)
    place = {grade: code for code, grade in enumerate(grades.scale.grades)}
    spellings: dict[str, list[str]] = {}
    for i in places:
        grade = grade_of[texts[i]]
        grades.codes[i] = place[grade]
        spellings.setdefault(grade, []).append(texts[i])
    grades.merged = {g: s for g, s in spellings.items() if len(s) > 1 or s != [g]}
    return grades


def _checked(options: GradeOptions) -> GradeOptions:
    # categories and codes as cells are: without blanks around them, by one Unicode form
    declared = tuple(map(_plain, options.categories or ()))
    codes = tuple(map(_plain, options.missing_codes))
    again = [grade for grade in dict.fromkeys(declared) if declared.count(grade) > 1]
    if again or "" in declared:
        what = f"repeated: {again}" if again else "got none between two commas"
        raise ParameterError(f"--categories: needed every grade once, {what}")
    numbers = {Decimal(grade) for grade in declared if is_number(grade)}
    for code in codes:
        if code in declared or (is_number(code) and Decimal(code) in numbers):
            raise ParameterError(
                f"--categories, --missing: {code!r} is a grade or missing, not both"
            )
    return replace(options, categories=declared or None, missing_codes=codes)


def _missing_codes(texts: Sequence[str], options: GradeOptions) -> list[str]:
    # texts that stand for a missing grade; numbers among the codes by their value
    declared = options.categories or ()
    codes = {c for c in USUAL_MISSING if c not in declared} | set(options.missing_codes)
    numbers = {Decimal(code) for code in options.missing_codes if is_number(code)}
    return [
        text
        for text in texts
        if text in codes or (numbers and is_number(text) and Decimal(text) in numbers)
    ]


def _decimal_point(text: str, decimal: str) -> str | None:
    # the number as Python writes it, or None
    if decimal != ".":
        text = text.replace(decimal, ".") if "." not in text else ""
    return text if is_number(text) else None


def _shown(texts: Sequence[str]) -> str:
    shown = ", ".join(repr(text[:_LONGEST]) for text in texts[:_SHOWN])
    n_more = len(texts) - _SHOWN
    return shown + (f" and {n_more} more" if n_more > 0 else "")


def _declared_grades(
    met: Mapping[str, int],
    declared: Sequence[str],
    as_number: Mapping[str, str | None],
    stands: Callable[[str], str],
) -> dict[str, str]:
    # text to the category it is: the same text, else the same number
    is_numeric = all(map(is_number, declared))
    numbers = {Decimal(c): c for c in declared} if is_numeric else {}
    if len(numbers) < len(declared):  # 1 and 1.0 are two grades: 01 is neither
        numbers = {}
    grade_of: dict[str, str] = {}
    wrong: list[str] = []
    for text in met:
        number = as_number[text]
        turned = f"{text[1:]}+"  # clinicians write +1 for 1+
        if text in declared:
            grade_of[text] = text
        elif text.startswith("+") and turned in declared:
            grade_of[text] = turned
        elif number is not None and Decimal(number) in numbers:
            grade_of[text] = numbers[Decimal(number)]
        else:
            wrong.append(text)
    if wrong:
        likely = [t for t in wrong if _looks_missing(t)]
        hint = f"; --missing {quoted(likely)} if it is missing" if likely else ""
        raise RatingsError(
            f"{stands(wrong[0])}: needed one of {', '.join(declared)}, got "
            f"{_shown(wrong)}{hint}"
        )
    return grade_of


def _refuse_doubtful(
    met: Mapping[str, int], options: GradeOptions, stands: Callable[[str], str]
) -> None:
    likely = [text for text in met if _looks_missing(text)]
    if likely:
        raise RatingsError(
            f"{stands(likely[0])}: {_shown(likely)} looks like a missing grade: "
            f"--missing {quoted(likely)} counts it as one, --categories with it in the "
            "scale as a grade"
        )
    broken = [text for text in met if "\n" in text or "\r" in text]
    if broken:
        raise RatingsError(
            f"{stands(broken[0])}: needed a grade on one line, got "
            f"{_shown(broken[:1])}: a quote may be opened and not closed"
        )
    commas = [text for text in met if _DECIMAL_COMMA.fullmatch(text)]
    rest = [t for t in met if t not in commas and not is_number(t)]
    if commas and not rest and options.decimal == ".":
        raise RatingsError(
            f"{stands(commas[0])}: {_shown(commas)} looks like a number with a decimal "
            "comma: --decimal , reads it so, --categories makes it text"
        )


_LOOKS_MISSING = (
    "n/a na nan -nan null none nil nat n.a n/d n.d n.r <na> <null> (null) (blank) "
    "(empty) #n/a #na #null! #value! #div/0! #ref! #name? #num! 1.#qnan 1.#ind -1.#ind "
    "\\n . - -- --- ? ?? missing blank undefined unrated notrated norating notassessed "
    "notapplicable notavailable"
)


@cache
def _missing_forms() -> frozenset[str]:
    # normal forms of what is a missing grade unless somebody says otherwise
    return frozenset(["", *map(normal_form, _LOOKS_MISSING.split())])


def _looks_missing(text: str) -> bool:
    return normal_form(text) in _missing_forms()


def quoted(names: Sequence[str]) -> str:
    """Return a list as an option takes it on a command line."""
    return shlex.quote(",".join(names))


def _observed_grades(
    met: Mapping[str, int],
    as_number: Mapping[str, str | None],
    stands: Callable[[str], str],
) -> dict[str, str]:
    # text to grade where nobody declared a scale
    plus = [t for t in met if t.startswith("+") and as_number[t] is not None]
    others = [t for t in met if t[0].isdigit() and _positive(as_number[t])]
    others += [t for t in met if f"+{t[:-1]}" in plus and t.endswith("+")]
    if plus and others:
        raise RatingsError(
            f"{stands(plus[0])}: {_shown(plus)} beside grades such as "
            f"{others[0]!r} may be that number or the grade '{plus[0][1:]}+': "
            "--categories with the scale in order tells"
        )
    if any(as_number[text] is None for text in met):
        return {text: text for text in met}
    shortest: dict[Decimal, str] = {}
    for text in sorted(met, key=lambda t: (len(t), t)):
        shortest.setdefault(Decimal(str(as_number[text])), str(as_number[text]))
    return {text: shortest[Decimal(str(as_number[text]))] for text in met}


def _positive(number: str | None) -> bool:
    return number is not None and float(number) > 0


def _observed_scale(grades: Sequence[str]) -> Scale:
    if all(map(is_number, grades)):
        return Scale(name="observed", grades=tuple(sorted(grades, key=Decimal)))
    # No other scale has a grade 1+: its order is known, and its other grades.
    if "1+" in grades and set(grades) <= set(MODIFIED_ASHWORTH.grades):
        return MODIFIED_ASHWORTH
    return Scale(name="observed", grades=tuple(sorted(grades)))


def normal_form(text: str) -> str:
    """Return what texts have in common that a reader takes for the same."""
    plain = text.casefold()
    if plain.isalnum() and plain.isascii():  # as most names of items are
        if plain.isdigit():
            return plain.lstrip("0") or "0"
        if not plain[0].isdigit():
            return plain
    if not plain.isascii():
        plain = _INVISIBLE.sub("", unicodedata.normalize("NFKC", plain))
        plain = plain.casefold().translate(_LOOK_ALIKE)
        plain = "".join(str(unicodedata.decimal(c, c)) for c in plain)
    if _NEEDS_CARE.search(plain):
        plain = "".join(plain.split()).strip("'\"`=")
        if _DECIMAL_COMMA.fullmatch(plain):
            plain = plain.replace(",", ".")
        plain = plain.rstrip(".,:;!") or plain[:1]
    if plain[:1] in _NUMBER_BEGINS and is_number(plain):
        return f"{Decimal(plain).normalize():f}"
    return plain


def alike_texts(texts: Sequence[str]) -> list[list[str]]:
    """Return the texts, all different, that differ by spelling alone, together."""
    if _differ_plainly(texts):
        return []
    forms = list(map(normal_form, texts))
    if len(set(forms)) == len(forms):
        return []
    groups: dict[str, list[str]] = {}
    for form, text in zip(forms, texts, strict=True):
        groups.setdefault(form, []).append(text)
    return [group for group in groups.values() if len(group) > 1]


def _differ_plainly(texts: Sequence[str]) -> bool:
    # whether all are numbers without a zero in front, or names of letters and digits
    # that differ in small letters, too, as most names of items are
    joined = "".join(texts)
    if not (joined.isascii() and joined.isalnum()):
        return False
    lines = "\n".join(["", *texts, ""]).lower()
    if joined.isdecimal():
        is_short = lines.count("\n0") == lines.count("\n0\n")
        return is_short or len(set(map(len, texts))) == 1
    if re.search(r"\n\d", lines):
        return False
    return len(set(lines.split("\n"))) == len(texts) + 1


def _doubts_of_grades(
    met: Mapping[str, int],
    grade_of: Mapping[str, str],
    as_number: Mapping[str, str | None],
    stands: Callable[[str], str],
) -> list[str]:
    # what looks wrong in a scale that nobody declared
    freq: dict[str, int] = {}
    for text, n in met.items():
        freq[grade_of[text]] = freq.get(grade_of[text], 0) + n
    warnings = [
        "grades that differ by spelling alone are counted as different: "
        + ", ".join(f"{text!r} ({freq[text]} times)" for text in group)
        for group in alike_texts(list(freq))
    ]
    numbers = [text for text in met if as_number[text] is not None]
    others = [text for text in met if as_number[text] is None]
    if not others:
        warnings += _same_floats(list(freq)) + _measurements(freq)
    if all(map(_HALF_GRADE.fullmatch, others)):
        return warnings + _far_codes([g for g in freq if is_number(g)], freq)
    return warnings + _stray(numbers, others, met, stands)


def _same_floats(grades: Sequence[str]) -> list[str]:
    # numbers that differ beyond the digits of a float
    by_value: dict[float, str] = {}
    for grade in grades:
        other = by_value.setdefault(float(grade), grade)
        if other != grade:
            return [
                f"{other} and {grade} are too near to be told apart as numbers, so "
                "that grades weigh by their place in the scale"
            ]
    return []


def _measurements(freq: Mapping[str, int]) -> list[str]:
    # more numbers than a scale has grades, most of which hardly ever come again
    n_ratings = sum(freq.values())
    if len(freq) <= _MANY_GRADES or 2 * len(freq) <= n_ratings:
        return []
    return [
        f"{len(freq)} different numbers in {n_ratings} ratings {MEASUREMENTS}: "
        "percent agreement and unweighted kappas count only those that are equal; "
        "--coefficients icc_a1 or --metric interval weigh how far they lie from each "
        "other"
    ]


def _far_codes(grades: Sequence[str], freq: Mapping[str, int]) -> list[str]:
    # numbers such as 99 and -9 that lie far from all others, at either end
    warnings = []
    for is_top in (False, True):
        order = sorted(grades, key=Decimal, reverse=is_top)
        values = [abs(float(grade) - float(order[-1])) for grade in order]
        codes = 0
        while codes < len(order) - 1 and _is_code(order[codes]):
            codes += 1
        for n_far in range(1, codes + 1):
            gap, rest = values[n_far - 1] - values[n_far], values[n_far:]
            step = max((a - b for a, b in pairwise(rest)), default=0)
            is_odd = not is_top and float(order[n_far - 1]) < 0 <= float(order[n_far])
            is_off_scale = rest[0] <= _SCALE and gap > max(2 * step, 2)
            if is_odd or is_off_scale or gap >= rest[0] + 1:
                far = sorted(order[:n_far], key=Decimal)
                named = ", ".join(f"{g} ({freq[g]} times)" for g in far)
                warnings.append(
                    f"{named}: far from the other grades; if missing ones are meant, "
                    f"--missing {quoted(far)}"
                )
                break
    return warnings


def _is_code(grade: str) -> bool:
    value = float(grade)
    return value.is_integer() and int(value) in _CODES


def _stray(
    numbers: Sequence[str],
    others: Sequence[str],
    met: Mapping[str, int],
    stands: Callable[[str], str],
) -> list[str]:
    # texts among numbers, or numbers among texts, whichever are fewer
    n_numbers, n_others = (sum(map(met.__getitem__, t)) for t in (numbers, others))
    if n_others <= n_numbers:
        forms = set(map(normal_form, numbers))  # those are named already
        strays = [
            text
            for text in others
            if not _HALF_GRADE.fullmatch(text) and normal_form(text) not in forms
        ]
        what, so = "no number", ", so that all grades are text"
    else:
        strays = list(numbers)
        what, so = "a number among grades that are text", ""
    return strays and [
        f"{what}: {_shown(strays)} ({stands(strays[0])}){so}; if that is missing, "
        f"--missing {quoted(strays)}"
    ]
