"""Which grade a text is, or that there is none.

Every text that occurs is looked at once. Two texts are one grade only where that cannot
be wrong, and each time it is noted; whatever else looks alike is warned of.
"""

import math
import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import pairwise

import numpy as np

from masrel.errors import ParameterError, RatingsError
from masrel.ratings._findings import (
    USUAL_MISSING,
    Finding,
    Reading,
    listed,
    quoted,
)
from masrel.ratings._sheet import Codes, Column, Sheet, plain
from masrel.scales import MODIFIED_ASHWORTH, Scale

# Whole numbers that programs write for "missing", where they lie far from the others.
_CODES = frozenset(
    sign * int(digit * n) for digit in "789" for n in range(1, 6) for sign in (1, -1)
) | {-1, 999999, -999999}

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,5})?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+", re.ASCII)
_HALF_GRADE = re.compile(r"\d+([+-]+|[A-Za-z])")  # 1+, 4-, 2a: numbers, more or less
_INVISIBLE = re.compile("[\u200b-\u200f\u2060\ufeff\u00ad]")
# Dashes, and Cyrillic and Greek letters that look like Latin ones.
_LOOK_ALIKE = str.maketrans(
    "‐‑‒–—―−‘’“”авекмнорстухіαικνορτυχ", "-------''\"\"abekmhopctyxiaikvoptux"
)
_LOOKS_MISSING = (
    "n/a na nan -nan null none nil nat n.a n/d n.d n.r <na> <null> (null) (blank) "
    "(empty) #n/a #na #null! #value! #div/0! #ref! #name? #num! 1.#qnan 1.#ind -1.#ind "
    "\\n . - -- --- ? ?? missing blank undefined unrated notrated norating notassessed "
    "notapplicable notavailable"
)
_SCALE = 10  # widest span of grades of a scale, rather than of measurements
_Refuse = Callable[..., RatingsError]  # of a code, texts, and facts
_MANY_GRADES = 15  # of the longest usual scale: Borg's, from 6 to 20


@dataclass(slots=True, kw_only=True)
class Grades:
    """The texts of a table's cells as grades."""

    scale: Scale
    codes: Codes  # (n_rows, n_columns): place in the scale, -1 where missing
    merged: dict[str, list[str]] = field(default_factory=dict)  # grade to its spellings
    n_missing: dict[str, int] = field(default_factory=dict)  # code to number of cells
    findings: list[Finding] = field(default_factory=list)


def is_number(text: str) -> bool:
    """Return whether a text is a finite decimal number in ASCII."""
    return bool(_NUMBER.fullmatch(text)) and math.isfinite(float(text))


def graded(sheet: Sheet, places: Sequence[int], options: Reading) -> Grades:
    """Return which grades the cells of some columns are."""
    number: dict[str, int] = {}
    codes = np.empty((len(sheet.numbers), len(places)), dtype=np.int64)
    for k, column in enumerate(sheet.columns[place] for place in places):
        of_text = [number.setdefault(text, len(number)) for text in column.texts]
        codes[:, k] = np.array(of_text, dtype=np.int64)[column.codes]
    cells = Column(codes.ravel(), list(number)).rows(slice(None))
    weights = np.repeat(sheet.freq, len(places))
    n_cells = np.bincount(cells.codes, weights, len(cells.texts)).astype(np.int64)
    freq = dict(zip(cells.texts, n_cells.tolist(), strict=True))

    def where(text: str) -> str:
        row, k = divmod(int(np.argmax(cells.is_text(text))), len(places))
        return f"{sheet.where(row)}, column {sheet.header[places[k]]!r}"

    grades = _grades(sheet, freq, options, where)
    return replace(grades, codes=grades.codes[cells.codes].reshape(codes.shape))


def _grades(
    sheet: Sheet,
    freq: dict[str, int],
    options: Reading,
    where: Callable[[str], str],
) -> Grades:
    # of the texts, as if they were the cells; freq: how many cells have each
    declared, codes = _declared(options)
    # codes of missing grades; numbers among those that are named by their value
    absent = {code for code in USUAL_MISSING if code not in declared} | set(codes)
    if values := {Decimal(code) for code in codes if is_number(code)}:
        absent |= {t for t in freq if is_number(t) and Decimal(t) in values}
    met = {text: n for text, n in freq.items() if n and text not in absent}
    if not met:
        raise sheet.refuse("no grades")

    def refuse(code: str, texts: Sequence[str], **facts: str) -> RatingsError:
        return sheet.refuse(code, where(texts[0]), None, got=listed(texts), **facts)

    written = dict(zip(met, met, strict=True))
    if options.decimal != ".":
        written = {t: "" if "." in t else t.replace(options.decimal, ".") for t in met}
    number = {t: Decimal(w) if is_number(w) else None for t, w in written.items()}
    findings: list[Finding] = []
    if declared:
        scale = Scale(name="declared", grades=declared)
        grade_of = _declared_grades(number, declared, refuse)
    else:
        _refuse_doubtful(number, options, refuse)
        grade_of, scale = _observed(number, options.decimal)
        findings = _doubts(met, number, grade_of, where)
    code = {grade: k for k, grade in enumerate(scale.grades)}
    spellings: dict[str, list[str]] = {}
    for text, grade in grade_of.items():
        spellings.setdefault(grade, []).append(text)
    return Grades(
        scale=scale,
        codes=np.array([code.get(grade_of.get(t, ""), -1) for t in freq], np.int64),
        merged={g: s for g, s in spellings.items() if len(s) > 1 or s != [g]},
        n_missing={text: n for text, n in freq.items() if n and text in absent},
        findings=findings,
    )


def _declared(options: Reading) -> tuple[tuple[str, ...], tuple[str, ...]]:
    # categories and codes of missing grades as cells are
    declared = tuple(map(plain, options.categories or ()))
    codes = tuple(map(plain, options.missing_codes))
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
    return declared, codes


def _declared_grades(
    number: dict[str, Decimal | None], declared: Sequence[str], refuse: _Refuse
) -> dict[str, str]:
    # text to the category it is: the same text, else the same number
    categories: dict[Decimal | None, str]
    categories = {Decimal(grade): grade for grade in declared if is_number(grade)}
    if len(categories) < len(declared):
        categories = {}  # text, or 1 and 1.0 are two grades: 01 is neither
    grade_of: dict[str, str] = {}
    for text, value in number.items():
        turned = f"{text[1:]}+" * text.startswith("+")  # clinicians write +1 for 1+
        same = [grade for grade in (text, turned) if grade in declared]
        if same or value in categories:
            grade_of[text] = same[0] if same else categories[value]
    if wrong := [text for text in number if text not in grade_of]:
        likely = [text for text in wrong if normal_form(text) in _MISSING_FORMS]
        hint = f"; --missing {quoted(likely)} if it is missing" if likely else ""
        raise refuse("other grade", wrong, scale=", ".join(declared), hint=hint)
    return grade_of


def _refuse_doubtful(
    number: dict[str, Decimal | None], options: Reading, refuse: _Refuse
) -> None:
    # what may be no grade, or one of two
    commas = [text for text in number if _DECIMAL_COMMA.fullmatch(text)]
    rest = [text for text in number if text not in commas and not is_number(text)]
    plus = [t for t, value in number.items() if t[0] == "+" and value is not None]
    others = [t for t, value in number.items() if t[0].isdigit() and value]
    others += [t for t in number if t[-1] == "+" and f"+{t[:-1]}" in plus]
    is_comma = not rest and options.decimal == "."
    doubts = {
        "looks missing": [t for t in number if normal_form(t) in _MISSING_FORMS],
        "broken": [t for t in number if "\n" in t or "\r" in t][:1],
        "decimal comma": commas if is_comma else [],
        "plus": plus if others else [],
    }
    for code, texts in doubts.items():
        if texts:
            raise refuse(
                code,
                texts,
                codes=quoted(texts),
                grade=f"{texts[0][1:]}+",
                other="".join(others[:1]),
            )


def _observed(
    number: dict[str, Decimal | None], mark: str
) -> tuple[dict[str, str], Scale]:
    # text to grade where nobody declared a scale, and the scale
    if None not in number.values():
        shortest: dict[Decimal | None, str] = {}  # of equal numbers
        for text in sorted(number, key=lambda text: (len(text), text)):
            shortest.setdefault(number[text], text.replace(mark, "."))
        grades = tuple(sorted(shortest.values(), key=Decimal))
        grade_of = {text: shortest[value] for text, value in number.items()}
        return grade_of, Scale(name="observed", grades=grades)
    scale = Scale(name="observed", grades=tuple(sorted(number)))
    # No other scale has a grade 1+: its order is known, and its other grades.
    if "1+" in number and number.keys() <= set(MODIFIED_ASHWORTH.grades):
        scale = MODIFIED_ASHWORTH
    return {text: text for text in number}, scale


# ---- what looks alike, or wrong ----


def normal_form(text: str) -> str:
    """Return what texts have in common that a reader takes for the same."""
    form = text.casefold()
    if form.isascii() and form.isalnum():  # as names of items are
        if form.isdigit():
            return form.lstrip("0") or "0"
        if form[0].isalpha():
            return form
    if not form.isascii():
        form = _INVISIBLE.sub("", unicodedata.normalize("NFKC", form))
        form = form.casefold().translate(_LOOK_ALIKE)
        form = "".join(str(unicodedata.decimal(c, c)) for c in form)
    form = "".join(form.split()).strip("'\"`=")
    if _DECIMAL_COMMA.fullmatch(form):
        form = form.replace(",", ".")
    form = form.rstrip(".,:;!") or form[:1]
    return f"{Decimal(form).normalize():f}" if is_number(form) else form


# of what is a missing grade unless somebody says otherwise
_MISSING_FORMS = frozenset(["", *map(normal_form, _LOOKS_MISSING.split())])


def spelled_alike(texts: Sequence[str]) -> list[list[str]]:
    """Return the texts, all different, that differ by spelling alone, together."""
    forms = list(map(normal_form, texts))
    if len(set(forms)) == len(forms):
        return []
    groups: dict[str, list[str]] = {}
    for form, text in zip(forms, texts, strict=True):
        groups.setdefault(form, []).append(text)
    return [group for group in groups.values() if len(group) > 1]


def _doubts(
    met: dict[str, int],
    number: dict[str, Decimal | None],
    grade_of: dict[str, str],
    where: Callable[[str], str],
) -> list[Finding]:
    # what looks wrong in a scale that nobody declared
    freq: Counter[str] = Counter()
    for text, n in met.items():
        freq[grade_of[text]] += n
    findings = []
    for group in spelled_alike(list(freq)):
        grades = ", ".join(f"{text!r} ({freq[text]} times)" for text in group)
        findings.append(Finding("alike grades", grades=grades))
    numbers = [text for text in met if number[text] is not None]
    others = [text for text in met if number[text] is None]
    n_ratings = sum(freq.values())
    if not others:
        # numbers that differ beyond the digits of a float
        pairs = pairwise(sorted(freq, key=Decimal))
        near = [(one, other) for one, other in pairs if float(one) == float(other)]
        for one, other in near[:1]:
            findings.append(Finding("too near", one=one, other=other))
        # more numbers than a scale has grades, most of which hardly ever come again
        if len(freq) > _MANY_GRADES and 2 * len(freq) > n_ratings:
            findings.append(Finding("measurements", n=len(freq), n_ratings=n_ratings))
    if all(map(_HALF_GRADE.fullmatch, others)):
        return findings + _far_codes([g for g in freq if is_number(g)], freq)
    # texts among numbers, or numbers among texts, whichever are fewer
    code, strays = "number", numbers
    if sum(map(met.__getitem__, others)) <= n_ratings / 2:
        forms = set(map(normal_form, numbers))  # those are named already
        strays = [t for t in others if not _HALF_GRADE.fullmatch(t)]
        strays = [text for text in strays if normal_form(text) not in forms]
        code = "no number"
    if strays:
        finding = Finding(
            code, got=listed(strays), where=where(strays[0]), codes=quoted(strays)
        )
        findings.append(finding)
    return findings


def _far_codes(grades: Sequence[str], freq: dict[str, int]) -> list[Finding]:
    # numbers such as 99 and -9 that lie far from all others, at either end
    findings = []
    for is_top in (False, True):
        order = sorted(grades, key=Decimal, reverse=is_top)
        values = [abs(float(grade) - float(order[-1])) for grade in order]
        for n_far, grade in enumerate(order[:-1], start=1):
            if not (float(grade).is_integer() and int(float(grade)) in _CODES):
                break
            gap, rest = values[n_far - 1] - values[n_far], values[n_far:]
            step = max((a - b for a, b in pairwise(rest)), default=0)
            is_odd = not is_top and float(grade) < 0 <= float(order[n_far])
            is_off_scale = rest[0] <= _SCALE and gap > max(2 * step, 2)
            if is_odd or is_off_scale or gap >= rest[0] + 1:
                far = sorted(order[:n_far], key=Decimal)
                named = ", ".join(f"{g} ({freq[g]} times)" for g in far)
                findings.append(Finding("far", grades=named, codes=quoted(far)))
                break
    return findings
