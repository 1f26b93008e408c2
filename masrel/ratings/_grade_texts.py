"""Which grade a text is, or that it is missing.

Every text that occurs is looked at once. Two texts are one grade only where that cannot
be wrong, and each time it is noted; whatever else looks alike is warned of.
"""

import math
import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import pairwise

import numpy as np

from masrel.agreement._labels import text_of_set
from masrel.errors import ParameterError, RatingsError
from masrel.ratings._findings import (
    MOST_CODES,
    USUAL_MISSING,
    Finding,
    Reading,
    if_missing,
    listed,
    quoted,
)
from masrel.ratings._sheet import Codes, Column, Sheet, plain
from masrel.scales import MODIFIED_ASHWORTH, Scale

# Whole numbers that programs write for "missing", where they lie far from the others.
_CODES = frozenset(
    sign * int(digit * n) for digit in "789" for n in range(1, 6) for sign in (1, -1)
) | {-1, 999999, -999999}

# Thousands marks, and how each is written: there are several apostrophes and blanks.
_MARKS = {",": ",", ".": ".", "'": "'’", " ": " \u00a0\u2009\u202f"}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,5})?", re.ASCII)
_DIGITS = r"[0-9](?:[0-9.,'’ \u00a0\u2009\u202f]*[0-9])?"  # and marks of either kind
_DECIMAL_COMMA = re.compile(r"[+-]?\d+([.'’ \u00a0\u2009\u202f]\d{3})*,\d+", re.ASCII)
# A number and its unit, which begins with a letter or a sign: "1+" and "4-" are grades.
_WITH_UNIT = re.compile(rf"([+-]?[.,]?{_DIGITS})\s*((?:[^\W\d_]|[%‰°′″$€£]).*)")
_TRUTH = {"true": "1", "false": "0"}
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
    facts: dict[str, str] = field(default_factory=dict)  # marks that were taken off
    findings: list[Finding] = field(default_factory=list)


def is_number(text: str) -> bool:
    """Return whether a text is a finite decimal number in ASCII."""
    return bool(_NUMBER.fullmatch(text)) and math.isfinite(float(text))


def with_order(sheet: Sheet, places: Sequence[int], options: Reading) -> Reading:
    """Declare the ordered categories that all columns of grades have in a frame."""
    orders = sheet.facts.get("orders", {})
    first, *others = [orders.get(sheet.header[place], []) for place in places]
    absent = {*USUAL_MISSING, *options.missing_codes}
    order = [grade for grade in first if grade not in absent]
    is_told = options.categories or options.set_separator
    if is_told or not order or any(other != first for other in others):
        return options
    return replace(options, categories=order)


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

    numbers, findings = _Numbers(written=dict.fromkeys(met, "")), []
    if not declared:
        _refuse_missing(list(met), refuse)
    if not options.set_separator:
        delimiter = sheet.facts.get("delimiter")
        marks = {
            mark: delimiter != "semicolon"
            for mark in _MARKS
            # a number in a cell with a type has a point
            if not declared and (mark != "." or delimiter is not None)
        }
        numbers = _numbers_of(list(met), options, refuse, marks)
        numbers.written |= {} if declared else _truth(numbers.written, refuse)
    number = {
        t: Decimal(w) if is_number(w) else None for t, w in numbers.written.items()
    }
    if declared:
        scale = Scale(name="declared", grades=declared)
        grade_of = _declared_grades(number, declared, refuse)
    elif options.set_separator:
        grade_of = _sets(list(met), options.set_separator, refuse)
        scale = Scale(name="observed", grades=tuple(sorted(set(grade_of.values()))))
    else:
        _refuse_plus(number, refuse)
        grade_of, scale = _observed(number, numbers.written)
    if not declared:
        findings = numbers.findings + _doubts(met, number, grade_of, where)
    code = {grade: k for k, grade in enumerate(scale.grades)}
    spellings: dict[str, list[str]] = {}
    for text, grade in grade_of.items():
        spellings.setdefault(grade, []).append(text)
    return Grades(
        scale=scale,
        codes=np.array([code.get(grade_of.get(t, ""), -1) for t in freq], np.int64),
        merged={g: s for g, s in spellings.items() if len(s) > 1 or s != [g]},
        n_missing={text: n for text, n in freq.items() if n and text in absent},
        facts=numbers.facts,
        findings=findings,
    )


def _declared(options: Reading) -> tuple[tuple[str, ...], tuple[str, ...]]:
    # categories and codes of missing grades as cells are
    declared = tuple(map(plain, options.categories or ()))
    codes = tuple(map(plain, options.missing_codes))
    again = [grade for grade in dict.fromkeys(declared) if declared.count(grade) > 1]
    if again or "" in declared:
        what = f"repeated: {listed(again)}" if again else "got none between two commas"
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
        hint = if_missing(likely[:MOST_CODES])
        raise refuse("other grade", wrong, scale=", ".join(declared), hint=hint)
    return grade_of


def _refuse_missing(texts: Sequence[str], refuse: _Refuse) -> None:
    # what may be no grade
    if likely := [text for text in texts if normal_form(text) in _MISSING_FORMS]:
        raise refuse("looks missing", likely, codes=quoted(likely[:MOST_CODES]))
    if broken := [text for text in texts if "\n" in text or "\r" in text]:
        raise refuse("broken", broken[:1])


def _refuse_plus(number: dict[str, Decimal | None], refuse: _Refuse) -> None:
    # +1 beside 1 may be that number, or the grade 1+
    plus = [t for t, value in number.items() if t[0] == "+" and value is not None]
    others = [t for t, value in number.items() if t[0].isdigit() and value]
    others += [t for t in number if t[-1] == "+" and f"+{t[:-1]}" in plus]
    if plus and others:
        raise refuse("plus", plus, grade=f"{plus[0][1:]}+", other=others[0])


def _truth(written: dict[str, str], refuse: _Refuse) -> dict[str, str]:
    # true and false beside 0 and 1: these numbers, if there are no other grades
    truths = {t: _TRUTH[t.lower()] for t in written if t.lower() in _TRUTH}
    values = {Decimal(text) for text in written.values() if is_number(text)}
    if not truths or values.isdisjoint({0, 1}):
        return {}
    n_numbers = sum(map(is_number, written.values()))
    if values - {0, 1} or n_numbers + len(truths) < len(written):
        raise refuse("truth", list(truths))
    return truths


def _sets(texts: Sequence[str], separator: str, refuse: _Refuse) -> dict[str, str]:
    # text to the text of the set of its labels, in one order
    mark = separator.strip() or separator
    is_there = any(mark in text for text in texts)
    # a semicolon is in the text of a set
    if wrong := [t for t in texts if not is_there or (";" in t and mark != ";")]:
        raise refuse("no set", wrong, separator=separator)
    labels: dict[str, str] = {}
    for text in texts:
        # [x, y] as lists are written, with quotes or without
        is_list = re.fullmatch(r"\[.*\]|\{.*\}", text)
        parts = (text[1:-1] if is_list else text).split(mark)
        ends = "'\" " if is_list else None
        labels[text] = text_of_set({part.strip(ends) for part in parts} - {""})
    return labels


def _observed(
    number: dict[str, Decimal | None], written: dict[str, str]
) -> tuple[dict[str, str], Scale]:
    # text to grade where nobody declared a scale, and the scale
    if None not in number.values():
        shortest: dict[Decimal | None, str] = {}  # of equal numbers
        for text in sorted(written, key=lambda text: (len(written[text]), text)):
            shortest.setdefault(number[text], written[text])
        grades = tuple(sorted(shortest.values(), key=Decimal))
        grade_of = {text: shortest[value] for text, value in number.items()}
        return grade_of, Scale(name="observed", grades=grades)
    # No other scale has a grade 1+: its order is known, and its other grades.
    is_mas = "1+" in number and number.keys() <= set(MODIFIED_ASHWORTH.grades)
    observed = Scale(name="observed", grades=tuple(sorted(number)))
    return {text: text for text in number}, MODIFIED_ASHWORTH if is_mas else observed


# ---- numbers: their unit, their thousands marks, their decimal mark ----


@dataclass(slots=True, kw_only=True)
class _Numbers:
    """Texts as Python writes numbers."""

    written: dict[str, str]  # by text; where it is none, what is no number either
    facts: dict[str, str] = field(default_factory=dict)  # what was taken off
    findings: list[Finding] = field(default_factory=list)


def _numbers_of(
    texts: Sequence[str], options: Reading, refuse: _Refuse, marks: Mapping[str, bool]
) -> _Numbers:
    # grades as numbers are written; what may be two numbers is refused
    # marks: that may be of thousands unsaid, and whether a point in all numbers is that
    # of decimals; none where the scale is declared, and nothing is guessed
    numbers = _Numbers(written=dict(zip(texts, texts, strict=True)))
    if options.units or marks:
        _take_unit(numbers, options, refuse)
    _take_thousands(numbers, options, refuse, marks)
    written = numbers.written
    if options.decimal is None and marks:
        commas = [text for text, n in written.items() if _DECIMAL_COMMA.fullmatch(n)]
        if commas and all(re.fullmatch(f"[+-]?{_DIGITS}", n) for n in written.values()):
            raise refuse("decimal comma", commas)
    return numbers


def _take_unit(numbers: _Numbers, options: Reading, refuse: _Refuse) -> None:
    # off all numbers, if that was asked for; else it is refused
    matches = {
        text: (match[1], unicodedata.normalize("NFKC", match[2]))
        for text in numbers.written
        if not is_number(text) and (match := _WITH_UNIT.fullmatch(text))
    }
    units = Counter(unit for _, unit in matches.values())
    unit, n = units.most_common(1)[0] if units else ("", 0)
    others = [t for t in numbers.written if t not in matches or matches[t][1] != unit]
    if options.units:
        if others:
            stray = [t for t in others if t not in matches and not is_number(t)]
            of = f"the unit {unit!r}" if unit else "a unit"
            raise refuse("no unit", others, unit=of, hint=if_missing(stray))
        numbers.written = {text: number for text, (number, _) in matches.items()}
        numbers.facts["unit"] = unit
        return
    # 2a, 2b and 3 are grades, as 1+ is; a letter behind every number may be a unit
    are_grades = others and all(u.isalpha() and len(u) == 1 for u in units)
    if n > max(1, len(others)) and not are_grades:
        raise refuse("units", [t for t in matches if matches[t][1] == unit], unit=unit)


def _take_thousands(
    numbers: _Numbers, options: Reading, refuse: _Refuse, marks: Mapping[str, bool]
) -> None:
    # their marks off numbers, and a point before decimals
    mark, written = options.thousands, numbers.written
    if mark is None and (likely := _thousands_mark(written.values(), options, marks)):
        mark, is_told, ways = likely
        marked = [text for text, number in written.items() if _has(number, mark)]
        if not is_told:
            raise refuse("thousands", marked, ways=ways)
        facts = {"got": listed(marked), "mark": quoted([mark])}
        numbers.findings.append(Finding("thousands read", **facts))
    decimal = options.decimal or _decimal_beside(mark)
    if mark:
        numbers.facts["thousands"] = mark
        either = f"{_kinds(mark)}{re.escape(decimal)}"
        like = re.compile(rf"(?=.*\d)[+-]?[\d{either}]*", re.ASCII)
        for text, number in written.items():
            if _grouped(mark, decimal).fullmatch(number):
                written[text] = re.sub(f"[{_kinds(mark)}]", "", number)
            elif _has(number, mark) and like.fullmatch(number):
                raise refuse("groups", [text], mark=mark)
    if decimal != ".":
        numbers.written = {
            text: "" if "." in number else number.replace(decimal, ".")
            for text, number in written.items()
        }


def _thousands_mark(
    texts: Collection[str], options: Reading, marks: Mapping[str, bool]
) -> tuple[str, bool, str] | None:
    # the mark before three digits, nothing else, in all numbers that have it; whether
    # the numbers tell it from a decimal mark, and the options that do
    for mark in marks:
        decimal = options.decimal or _decimal_beside(mark)
        grouped = _grouped(mark, decimal)
        fits = (
            grouped.fullmatch(t)
            or is_number("" if _has(t, mark) else t.replace(decimal, "."))
            for t in texts
        )
        marked = [t for t in texts if _has(t, mark)] if all(fits) else []
        if not marked or mark == decimal:
            continue
        rest = [t.replace(decimal, ".") for t in texts if not _has(t, mark)]
        top = max((abs(float(number)) for number in rest), default=0.0)
        groups = [re.split(f"[{_kinds(mark)}]", text) for text in marked]
        # 1,200,000 and 1,200.5
        is_sure = max(map(len, groups)) > 2 or any(decimal in text for text in marked)
        most = 0.0 if is_sure else max(abs(float(".".join(g))) for g in groups)
        has_decimals = any(decimal in text for text in texts)
        # whether a mark before decimals cannot be meant
        is_known = mark not in ",." or options.decimal is not None or has_decimals
        # below 1,000 come numbers such as 900, not 0,900 or 0.9
        are_below = 100.0 <= top < 1000.0
        is_told = is_sure or (is_known and not rest)
        is_told |= are_below and (is_known or top > 2.0 * most)
        if mark == "." and options.decimal is None:
            # a point is that of decimals unless numbers without it are of another size
            is_near = top <= max(_SCALE, 2.0 * most) and not are_below
            if is_near and (rest or marks[mark]) and not (is_sure or is_known):
                continue
            is_told &= not has_decimals  # a decimal comma is for the caller to say
        ways = f"add --thousands {quoted([mark])} if it does"
        other = f", or --decimal {mark} if this is a decimal mark" * (not is_known)
        return mark, is_told, ways + other
    return None


# ---- numbers of items ----


def count_of(text: str, options: Reading) -> float:
    """Return a number of items, -1 if a text is not one, or may be in thousands."""
    mark = options.thousands or ""
    if mark and _grouped(mark, "").fullmatch(text):
        text = re.sub(f"[{_kinds(mark)}]", "", text)
    is_doubtful = options.decimal is None and _grouped(".", "").fullmatch(text)
    return float(text) if is_number(text) and not is_doubtful else -1.0


def if_thousands(text: str) -> str:
    """Return how a number of items is read if its mark is that of thousands."""
    likely = (mark for mark in _MARKS if _grouped(mark, "").fullmatch(text))
    return "".join(
        f"; if this is a thousands separator, add --thousands {quoted([mark])}"
        for mark in likely
    )


# ---- marks ----


def _decimal_beside(mark: str | None) -> str:
    # the usual decimal mark beside a thousands mark
    return "," if mark == "." else "."


def _kinds(mark: str) -> str:
    # of a class in a regular expression
    return re.escape(_MARKS.get(mark, mark))


def _has(text: str, mark: str) -> bool:
    return any(kind in text for kind in _MARKS.get(mark, mark))


def _grouped(mark: str, decimal: str) -> re.Pattern[str]:
    # numbers with the mark before every three digits
    after = rf"({re.escape(decimal)}\d*)?" if decimal else ""
    number = rf"[+-]?[1-9]\d{{0,2}}([{_kinds(mark)}]\d{{3}})+{after}"
    return re.compile(number, re.ASCII)


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
    findings = [
        Finding("alike grades", grades=", ".join(f"{t!r} ×{freq[t]}" for t in group))
        for group in spelled_alike(list(freq))
    ]
    numbers = [text for text in met if number[text] is not None]
    others = [text for text in met if number[text] is None]
    n_ratings = sum(freq.values())
    if not others:
        # numbers that differ beyond the digits of a float
        pairs = pairwise(sorted(freq, key=Decimal))
        near = [(one, other) for one, other in pairs if float(one) == float(other)]
        findings += [Finding("too near", one=a, other=b) for a, b in near[:1]]
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
    return findings + [
        Finding(code, got=listed(strays), where=where(first), hint=_hint(strays, met))
        for first in strays[:1]
    ]


def _hint(texts: Sequence[str], freq: Mapping[str, int]) -> str:
    # a large part of the ratings is not meant as missing
    is_rare = 4 * sum(map(freq.__getitem__, texts)) <= sum(freq.values())
    return if_missing(texts) if is_rare else ""


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
                named = ", ".join(f"{g} ×{freq[g]}" for g in far)
                findings.append(Finding("far", grades=named, hint=_hint(far, freq)))
                break
    return findings
