"""Doubts: columns and rows that may not be ratings.

In: a sheet, which column is what, and the grades. Out: warnings. What would make a
number wrong is refused, unless `--raters` or `--reference` names it.
"""

import itertools
import re
from collections.abc import Sequence

import numpy as np

from masrel.ratings._findings import (
    USUAL_MISSING,
    Finding,
    Reading,
    few,
    listed,
    quoted,
)
from masrel.ratings._grade_texts import is_number, normal_form, spelled_alike
from masrel.ratings._layout import (
    ITEM_NAME,
    Layout,
    criteria_of,
    names_rows,
    numbers_rows,
    sides_of,
    two_lines,
)
from masrel.ratings._sheet import Codes, Column, Sheet
from masrel.scales import Scale

# Names of columns that are seldom those of raters.
_OTHERS = re.compile(
    r"(age|sex|gender|comments?|notes?|remarks?|id|index|date|day|time|timestamp|"
    r"duration|lead_time|height|bmi|group|site|cent(er|re)|diagnosis|side|text|email|"
    r"unnamed: \d+)",
    re.IGNORECASE,
)
# Words of names of what is made of several ratings, and of what may stand beside, as in
# "majority_vote"; words of any such name, and of one of a column of two values.
_SUMS = frozenset(
    "gold golden gt maj adj ref reference final true correct key mode modal mean "
    "average avg median range sd std stdev variance total sum probability prob kappa "
    "agree agreed agreement disagree disagreement match matches matched unanimous "
    "same equal diff difference delta "
    "n count counts freq freqs frequency frequencies weight weights".split()
)
_BESIDE = frozenset(
    "label labels score scores rating ratings grade grades value values vote votes "
    "voting voted standard class category decision answer annotation ground expert y "
    "of all the is are row rater raters annotator annotators exact percent num number "
    "overall".split()
)
_SURE = frozenset(
    "majority consensus adjudicated adjudication truth groundtruth conf confidence "
    "confidences certainty".split()
)
_FLAGS = frozenset("agree agreed agreement disagree disagreement match correct".split())
_FREQUENCY = re.compile(
    r"n|w|wt|(.*[\W_])?(counts?|freqs?|frequenc(y|ies)|weights?|cases|n?obs|anzahl|"
    r"häufigkeit|effectifs?|frecuencia)([\W_].*)?",
    re.IGNORECASE,
)
# Names of rows that summarize the others.
_SUMMARY = re.compile(
    r"(grand )?(total|sum|mean|average|avg|median|sd|s\.d\.|std|min|max|n|count|all)s?"
    r"|[Σσ]|kappa|agreement",
    re.IGNORECASE,
)
_SEVERAL = re.compile(r"[;|[{]")  # what stands in cells of several labels
_MAX_COMPARED = 2000  # columns that are compared with all others
_ENOUGH = 3  # ratings of a column that are some grade of another's, if both rate
_ENOUGH_ROWS, _MANY_CATEGORIES = 4, 15  # of a table that is surely one of counts
_SHOWN = 5
_APART = "their names or grades, which do not occur as written in another column"


def doubt_columns(
    sheet: Sheet,
    layout: Layout,
    options: Reading,
    codes: Codes,
    scale: Scale,
    freq: Codes,
) -> list[Finding]:
    """Refuse or warn of columns of a wide table that are not raters."""
    # codes (n_items, n_raters): places in the scale, -1 where missing; freq (n_items,)
    names = [sheet.header[place] for place in layout.raters]
    findings = []
    if layout.frequency is None:
        findings = _frequencies(sheet, layout, options)
    elif 2 * freq[-1] == freq.sum() and any(
        _SUMMARY.fullmatch(column.texts[column.codes[-1]]) for column in sheet.columns
    ):
        raise sheet.refuse("sum row", where=sheet.where(len(freq) - 1))
    are_named = bool(options.raters or layout.criteria)
    if not are_named:
        _refuse_other_tables(sheet, layout, options, names, scale)
    if not (options.names_at or sheet.is_transposed):
        findings += _second_header(sheet, codes, scale, freq)
    # an item that is there twice is refused below, and no column is one of raters
    is_kept = options.repeated in ("error", "each")
    is_long = is_kept and layout.session == layout.by is None
    is_long &= any(
        len(sheet.columns[p].texts) < len(sheet.numbers) for p in layout.item[:1]
    )
    if layout.criteria:
        _refuse_scales(sheet, layout, codes)
    if not (are_named or is_long):
        findings += _no_raters(sheet, layout, options, codes, scale, freq)
    n, n_items = len(names), len(sheet.numbers)
    if layout.is_item_guessed and n > 2 * n_items and not sheet.is_transposed:
        findings.append(Finding("many raters", n=n, n_items=n_items))
    are_numbers = all(map(is_number, scale.grades))
    if are_numbers and not are_named and layout.frequency is None:
        findings += _looks_counted(sheet, names, codes, scale, freq)
    unrated = np.flatnonzero((codes < 0).all(axis=0))[:_SHOWN]
    return findings + [Finding("no grade of", rater=names[k]) for k in unrated]


def _refuse_other_tables(
    sheet: Sheet, layout: Layout, options: Reading, names: Sequence[str], scale: Scale
) -> None:
    # a contingency table, one without names of columns, or of items
    if len(layout.item) == 1 and len(names) == len(sheet.numbers) > 1:
        if _are_sides(sheet.columns[layout.item[0]].texts, names, scale):
            raise sheet.refuse("contingency", names=few(names))
    # a name of a column that the caller gives is no row
    is_named = options.item or options.ignore or options.by or options.frequency
    if sheet.has_header and not sheet.is_transposed and not is_named:
        _refuse_first_line(sheet, layout, names, scale)
    if layout.is_item_guessed:
        _refuse_first_column(sheet, layout.item[0], scale)


def _are_sides(rows: Sequence[str], names: Sequence[str], scale: Scale) -> bool:
    # and not numbered items and raters, such as item 1 and rater 1
    categories, _, raters = sides_of(rows, names) or ([], [], ("", ""))
    is_numbered = all(map(is_number, categories)) and ITEM_NAME.fullmatch(raters[0])
    are_counts = all(grade.isdecimal() for grade in scale.grades)
    return bool(categories) and (not any(raters) or (are_counts and not is_numbered))


def _refuse_first_line(
    sheet: Sheet, layout: Layout, names: Sequence[str], scale: Scale
) -> None:
    # names that are grades
    grades = set(map(normal_form, scale.grades))
    are_numbers = all(map(is_number, scale.grades))
    n_grades = sum(
        normal_form(name) in grades
        or name in USUAL_MISSING
        or (are_numbers and is_number(name))
        for name in names
    )
    items = [(sheet.header[p], sheet.columns[p].texts[0]) for p in layout.item]
    # P1 above P2; a name that is no item's above its names
    is_numbered = any(
        re.sub(r"\d+", "0", name) == re.sub(r"\d+", "0", cell) for name, cell in items
    )
    is_named = items and all(ITEM_NAME.fullmatch(name) for name, _ in items)
    if is_numbered or (n_grades >= len(names) / 2 and not is_named):
        raise sheet.refuse(
            "grades as names",
            where=sheet.at(0),
            columns=listed(names, _SHOWN),
            names=few(names),
        )


def _refuse_first_column(sheet: Sheet, place: int, scale: Scale) -> None:
    # a column that is the item because nothing else was, and may be a rater
    name, texts = sheet.header[place], sheet.columns[place].texts
    numbers = {float(grade) for grade in scale.grades if is_number(grade)}
    low, high = min(numbers, default=0.0), max(numbers, default=0.0) + 1
    values = [float(text) for text in texts if is_number(text)]
    n_near = sum(low <= value <= high for value in values)
    n_in_scale = sum(value in numbers for value in values)
    n_in_scale += len({t for t in texts if not is_number(t)} & {*scale.grades})
    is_rater = max(n_in_scale, n_near) >= len(texts) / 2 and not (
        ITEM_NAME.fullmatch(name) or (numbers_rows(sheet, place) and values[-1] > high)
    )
    if len(texts) < len(sheet.numbers):
        is_rater = n_in_scale == len(texts)
    if is_rater:
        where, quoted_name = sheet.at(0), quoted([name])
        raise sheet.refuse("first column", where=where, column=name, name=quoted_name)


# ---- columns that are no raters ----


def _frequencies(sheet: Sheet, layout: Layout, options: Reading) -> list[Finding]:
    # a column of how often each row is there, of rows that all differ otherwise
    item = [] if layout.is_item_guessed else [*layout.item]
    places = [k for k in range(len(sheet.header)) if k not in item]
    others = [place for place in places if not names_rows(sheet, place)]
    called = [place for place in others if _FREQUENCY.fullmatch(sheet.header[place])]
    for place in called:
        name, column = sheet.header[place], sheet.columns[place]
        rows = [sheet.columns[other].codes for other in others if other != place]
        if (
            rows
            and not _is_of_series(name, sheet.header)
            and not (options.raters and place in layout.raters)
            and all(
                is_number(t) and float(t) % 1 == 0 <= float(t) for t in column.texts
            )
            and 1 < len(column.codes) == len(np.unique(np.column_stack(rows), axis=0))
        ):
            finding = Finding("frequency", column=name, name=quoted([name]))
            # rows that have names, but those of row numbers, may be items
            is_item = any(not numbers_rows(sheet, place) for place in item)
            is_left = name in ",".join(options.ignore).split(",")
            is_left &= bool(options.raters or options.item)
            if is_left or (is_item and place not in layout.raters):
                return [finding]
            raise sheet.refuse("frequency", **finding.facts)
    return []


def _is_of_series(name: str, header: Sequence[str]) -> bool:
    # n beside m or o
    return len(name) == 1 and bool({chr(ord(name) - 1), chr(ord(name) + 1)} & {*header})


def _no_raters(
    sheet: Sheet,
    layout: Layout,
    options: Reading,
    codes: Codes,
    scale: Scale,
    freq: Codes,
) -> list[Finding]:
    # columns with another name than a rater's, or without a grade of the others
    names = [sheet.header[place] for place in layout.raters]
    named = _called_otherwise(sheet, layout)
    alone, sure = _alone(codes, scale, freq)
    vouched = {k for k, name in enumerate(names) if name in options.vouched}
    wrong = (named | sure) - vouched
    if not named:
        _refuse_criteria(sheet, names, {names[k] for k in sure})
    if wrong and not named and len(names) == 2:
        one, other = (
            listed([scale.grades[k] for k in np.unique(column[column >= 0])], _SHOWN)
            for column in codes.T
        )
        facts = {"one": one, "other": other, "names": quoted(names)}
        raise sheet.refuse("nothing in common", **facts)
    if wrong:
        raise sheet.refuse("no raters", **_facts(names, wrong, named))
    facts = _facts(names, alone - vouched, named)
    return [Finding("apart", **facts)] if alone - vouched else []


def _facts(names: Sequence[str], wrong: set[int], named: set[int]) -> dict[str, str]:
    # how columns are left aside; a list that is long is no help
    out, rest = (
        [name for k, name in enumerate(names) if (k in wrong) is is_out]
        for is_out in (True, False)
    )
    ignored = f"leave them out with --ignore{few(out)}, or " * bool(rest and few(out))
    is_gold = len(out) == 1 and called_gold(out[0])
    gold = f"; masrel diagnose --reference{few(out)} compares the others with it"
    return {
        "columns": listed(out, _SHOWN),
        "why": "their names" if wrong <= named else _APART,
        "advice": f"{ignored}name the raters with --raters"
        f"{few(rest) * (len(rest) > 1)}{gold * is_gold}",
    }


def refuse_named(sheet: Sheet, layout: Layout, options: Reading) -> None:
    """Refuse columns of a wide table that are called as no raters are."""
    if layout.kind != "wide" or options.raters or layout.criteria:
        return
    called = sorted(_called_otherwise(sheet, layout))
    names = [sheet.header[layout.raters[k]] for k in called]
    if wrong := [name for name in names if name not in options.vouched]:
        raise sheet.refuse(
            "no raters",
            columns=listed(wrong, _SHOWN),
            why="their names",
            advice=f"leave them out with --ignore{few(wrong)}",
        )


def _refuse_criteria(sheet: Sheet, names: Sequence[str], alone: set[str]) -> None:
    # columns whose names have two parts that others have, too
    ways = criteria_of(names)
    columns = {column for way in ways for of in way.values() for column in of.values()}
    if 2 * len(columns & alone) >= len(columns):
        return
    firsts = [next(iter(way.items())) for way in ways]
    if_so = (
        "only, --by-criterion reads all" if len(ways) == 1 else "if that is a criterion"
    )
    raise sheet.refuse(
        "criteria",
        first=listed(list(ways[0]), _SHOWN),
        second=listed(list(firsts[0][1]), _SHOWN),
        advice=", ".join(
            f"--raters{few([*of.values()])} reads {name or 'the first'!r} {if_so}"
            for name, of in firsts
        ),
    )


def _refuse_scales(sheet: Sheet, layout: Layout, codes: Codes) -> None:
    # criteria without a grade in common
    names = np.array([criterion for criterion, _ in layout.criteria])
    for criterion in dict.fromkeys(names.tolist()):
        met, others = codes[:, names == criterion], codes[:, names != criterion]
        are_rated = met.max() >= 0 <= others.max(initial=-1)
        if are_rated and np.intersect1d(met, others).max(initial=-1) < 0:
            raise sheet.refuse("other grades", criterion=criterion)


def _called_otherwise(sheet: Sheet, layout: Layout) -> set[int]:
    # which of the raters' columns are called as no raters are
    lower = {name.lower() for name in sheet.header}
    return {k for k, p in enumerate(layout.raters) if _is_no_rater(sheet, p, lower)}


def _is_no_rater(sheet: Sheet, place: int, lower: set[str]) -> bool:
    # lower: the names of all columns in lower case
    name, cells = sheet.header[place], {*sheet.columns[place].texts}
    words = _words(name)
    is_flag = bool(words & _FLAGS) and len(cells - {*USUAL_MISSING}) <= 2
    is_sum = _is_sum(words) and not _is_of_series(name, sheet.header)
    # Kim=Lee, mean of Kim and Lee
    of_two = len((words & lower) - {name.lower()}) > 1
    return bool(words & _SURE or _OTHERS.fullmatch(name)) or is_flag or is_sum or of_two


def called_gold(name: str) -> bool:
    """Return whether a name is not a person's but that of gold or a majority vote."""
    return _is_sum(_words(name)) or bool(_words(name) & _SURE)


# names of language models; Claude is a person, too, unless a version follows
_MODELS = re.compile(
    r"gpt|llama|gemini|mi[sx]tral|qwen|deepseek|llm|(claude|gemma|phi)[-_ ]?\w*\d"
)


def called_model(name: str) -> bool:
    """Return whether a name is that of a language model."""
    return _MODELS.search(name.lower()) is not None


def _words(name: str) -> set[str]:
    parts = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()
    return set(re.findall(r"[^\W\d_]+|\d+", parts))


def _is_sum(words: set[str]) -> bool:
    return bool(words & _SUMS) and words <= _SUMS | _BESIDE


def _alone(codes: Codes, scale: Scale, freq: Codes) -> tuple[set[int], set[int]]:
    # columns without a grade, or a value, in common with any other, and those of them
    # that surely should have one
    rated = [np.unique(column[column >= 0]) for column in codes.T]
    known = [k for k, grades in enumerate(rated) if len(grades)]
    if not 1 < len(known) <= _MAX_COMPARED:
        return set(), set()
    n_columns = np.bincount(np.concatenate(rated), minlength=len(scale.grades))
    alone = {k for k in known if (n_columns[rated[k]] == 1).all()}
    if all(map(is_number, scale.grades)):
        of_rest = codes[:, [k for k in known if k not in alone] or known]
        n_cells = freq @ (of_rest >= 0).sum(axis=1)
        if 2 * len(np.unique(of_rest[of_rest >= 0])) > n_cells:  # measurements
            values = np.array(scale.values)
            low, high = (values[[rated[k][end] for k in known]] for end in (0, -1))
            n_like = ((low[:, None] <= high) & (low <= high[:, None])).sum(axis=1)
            return {k for k, n in zip(known, n_like, strict=True) if n == 1}, set()
    elif any(map(_SEVERAL.search, scale.grades)):  # sets of labels, seldom equal
        return alone, set()
    return alone, {k for k in alone if freq @ (codes[:, k] >= 0) >= _ENOUGH}


def _looks_counted(
    sheet: Sheet, names: Sequence[str], codes: Codes, scale: Scale, freq: Codes
) -> list[Finding]:
    # Whole numbers whose sum is the same in every row, or in most and nowhere above
    # what one of them is alone, as where all raters agree.
    values = np.array([*scale.values, 0.0])  # a missing count, at -1, is 0
    if min(codes.shape) < 2 or (values < 0).any() or (values % 1 != 0).any():
        return []
    sums = values[codes].sum(axis=1)
    total = sums.max()
    # names of grades are numbers
    has_zeros = 0 in scale.values or (codes < 0).any() or all(map(is_number, names))
    share = np.average(sums == total, weights=freq)
    is_most = share == 1.0 or (values.max() == total and share >= 1 / 2)
    if total < 2 or not has_zeros or not is_most:
        return []
    finding = Finding("counts", total=total, names=few(names))
    is_sure = freq.sum() >= _ENOUGH_ROWS and len(names) <= _MANY_CATEGORIES
    if is_sure and scale.name == "observed":
        raise sheet.refuse("counts", **finding.facts)
    return [finding]


def _second_header(
    sheet: Sheet, codes: Codes, scale: Scale, freq: Codes
) -> list[Finding]:
    # a first row whose grades occur nowhere else, while those of the others do, or are
    # numbers, and these are none
    rest = np.bincount(codes[1:].ravel() + 1, minlength=len(scale.grades) + 1)[1:]
    n_met = np.count_nonzero(rest) + bool((codes[1:] < 0).any())
    first, is_text = codes[0][codes[0] >= 0], ~np.array([*map(is_number, scale.grades)])
    are_words = is_text[first].all() and not is_text[rest > 0].any()
    is_doubted = sheet.has_header and freq.sum() > 3 and is_text[first].any()
    are_rare = n_met <= codes[1:].size / 2 or are_words
    if not (is_doubted and are_rare) or rest[first].any():
        return []
    facts = two_lines(sheet)
    # raters who agree on a grade that comes once are no names
    if facts and (are_words or len(np.unique(first)) > 1):
        raise sheet.refuse("second header", **facts)
    usual = {"where": sheet.where(0), "advice": "delete it if these are names"}
    return [Finding("second header", **{**usual, **facts})]


def doubt_items(
    sheet: Sheet, layout: Layout, n_items: int, n_rows: int
) -> list[Finding]:
    """Warn of a long table none of whose items was rated twice."""
    columns = ", ".join(repr(sheet.header[place]) for place in layout.item)
    return [Finding("numbered", columns=columns)] if n_items == n_rows > 2 else []


def doubt_names(kind: str, names: Sequence[str]) -> list[Finding]:
    """Warn of names that differ by spelling alone."""
    return [
        Finding("alike", kind=kind, names=", ".join(map(repr, group)))
        for group in spelled_alike(names)[:_SHOWN]
    ]


def doubt_item_names(sheet: Sheet, item: Column) -> list[Finding]:
    """Refuse or warn of items that are comments, or sum up others."""
    odd = [
        name
        for name in item.texts
        if name[:1] == "#"
        or (len(name) < 14 and not name[-1].isdigit() and _SUMMARY.fullmatch(name))
    ]
    findings = doubt_names("items", item.texts)
    if not 0 < len(odd) < len(item.texts) / 2:
        return findings
    if odd == item.texts[-len(odd) :] or any(name[0] == "#" for name in odd):
        where = sheet.where(int(np.argmax(item.is_text(odd[0]))))
        raise sheet.refuse("summary row", where, item=odd[0])
    return [*findings, Finding("summary", names=listed(odd, _SHOWN))]


def doubt_counts(
    sheet: Sheet, layout: Layout, options: Reading, table: Codes
) -> list[Finding]:
    """Refuse or warn of a table of counts that has sums, or no column of items."""
    # of a table (n_rows, n_categories)
    names = [sheet.header[place] for place in layout.raters]
    findings = []
    are_sums = (2 * table == table.sum(axis=1)[:, None]).all(axis=0)
    for name in [] if options.raters else itertools.compress(names, are_sums):
        finding = Finding("sum column", column=name, name=quoted([name]))
        # a contingency table has as many rows, if no column is one of sums
        is_odd = len(names) > 2 and (layout.kind == "counts" or len(names) > len(table))
        if _SUMMARY.fullmatch(name) or (is_odd and len(table) >= _ENOUGH_ROWS):
            raise sheet.refuse("sum column", **finding.facts)
        findings += [finding] * is_odd
    if len(table) > 2 and (2 * table[-1] == table.sum(axis=0)).all():
        where = sheet.where(len(table) - 1)
        items = [sheet.columns[place] for place in layout.item]
        is_named = items and _SUMMARY.fullmatch(items[-1].texts[items[-1].codes[-1]])
        if is_named or (layout.kind == "counts" and len(table) >= _ENOUGH_ROWS):
            raise sheet.refuse("sum row", where=where)
        findings.append(Finding("sum row", where=where))
    findings += doubt_names("categories", names)
    if layout.kind == "table" or not layout.item:
        return findings
    name, column = sheet.header[layout.item[0]], sheet.columns[layout.item[0]]
    if (
        layout.is_item_guessed
        and all(text.isdecimal() for text in column.texts)
        and not (ITEM_NAME.fullmatch(name) or numbers_rows(sheet, layout.item[0]))
    ):
        raise sheet.refuse("category or item", column=name, name=quoted([name]))
    is_twice = len(column.texts) < len(column.codes) and layout.by is None
    if len(layout.item) == 1 and is_twice:
        findings.append(Finding("items twice", column=name))
    return findings
