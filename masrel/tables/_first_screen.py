"""What is shown first: what was read of a file, the tables of answers, and notes."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from masrel.agreement import COEFFICIENTS
from masrel.analysis._file_estimates import Answer, Questions, Row
from masrel.estimates import _population
from masrel.ratings import Finding, RatingsFile
from masrel.tables._answer_tables import Detail, answer_table
from masrel.tables._tables import (
    SIMULATED,
    Table,
    counted,
    number,
    p_text,
    percent,
    significant,
)

_SHOWN = 12  # raters that are named

# Scales to what is said of them where nobody declared them
_SCALES = {
    "MAS": "Scale: Modified Ashworth, {} (recognised by 1+); --categories changes it.",
    "observed": "Scale: the grades in the data; --categories changes it. AC and "
    "Brennan-Prediger depend on the scale.",
}


def first_screen(
    ratings: RatingsFile,
    questions: Questions,
    answered: Sequence[Answer],
    *,
    detail: Detail = "brief",
    items: str = "items",
    is_text: bool = True,
    in_sentences: bool = False,
) -> list[Table]:
    """Return the tables of answers, the first with what was read above it."""
    # items: what they are called; is_text: whether a sentence of result is shown, too;
    # in_sentences: whether notes of estimates are for sentences
    tables = [
        answer_table(
            answer,
            bands=questions.words,
            detail=detail,
            items=items,
            in_sentences=in_sentences and answer.name == "agreement",
            data="simulated" if ratings.simulated else "foreign",
        )
        for answer in answered
    ]
    if is_text:
        at, text = result_sentence(answered, items)
        tables[at] = replace(tables[at], notes=(*text.splitlines(), *tables[at].notes))
        tables[0] = replace(tables[0], caption="")
    first, *more = tables
    read, notes = what_was_read(ratings, items, detail), left_out(ratings, questions)
    return [replace(first, read=tuple(read), notes=(*first.notes, *notes)), *more]


def what_was_read(
    file: RatingsFile, items: str = "items", detail: Detail = "brief"
) -> list[str]:
    """Return the lines that say what was read, above a table."""
    read = file.read
    sheet = f"sheet {read['sheet']}" if read.get("sheet") else None
    ways = (read["format"], read.get("delimiter"), read.get("encoding"), sheet)
    form = "" if detail == "brief" else f" ({', '.join(filter(None, ways))})"
    names = read["raters"]
    more = f" and {len(names) - _SHOWN} more" * (len(names) > _SHOWN)
    raters = ", ".join(names[:_SHOWN]) + more
    columns = [repr(name) if name else "the first column" for name in read["item"]]
    clusters, frequency = read.get("clusters"), read.get("frequency")
    in_clusters = f" in {counted(read.get('n_clusters', 0), 'cluster')} by {clusters!r}"
    texts = {
        f" named by {' and '.join(columns)}": columns and read["layout"] != "table",
        in_clusters: clusters,
        f" counted by {frequency!r}": frequency,
    }
    named = "".join(text for text, is_so in texts.items() if is_so)
    rated = f"{counted(read['n_items'], 'item', items)}{named}"
    by = counted(read["n_raters"], "rater")
    first = f"Read {Path(read['file']).name}{form}: {rated}, {by}"
    parts = _of_grades(file)
    if detail != "brief" and file.scale.name in _SCALES:
        parts.append(_SCALES[file.scale.name].format(", ".join(file.scale.grades)))
    return [first + (f" ({raters})." if raters else "."), " ".join(parts)]


def _of_grades(file: RatingsFile) -> list[str]:
    read, scale, repeated = file.read, file.scale, file.read["n_repeated"]
    grades = list(read["grades"].items())
    listed = (
        f"{len(grades)} from {grades[0][0]} to {grades[-1][0]}"
        if len(grades) > _SHOWN
        else ", ".join(f"{grade} ×{n}" for grade, n in grades)
    )
    name = " (Modified Ashworth Scale)" if scale.name == "MAS" else ""
    codes = ", ".join(f"{n} {c or 'empty'}" for c, n in read["missing"].items())
    rows = ", ".join(f"{n} {why}" for why, n in read["dropped"].items())
    kinds: dict[str, list[str]] = {}
    for rater, kind in read.get("kinds", {}).items():
        kinds.setdefault(kind, []).append(rater)
    by = ". ".join(
        f"{kind.capitalize()}: {', '.join(of[:_SHOWN])}" for kind, of in kinds.items()
    )
    same = [" = ".join(of) for of in read["merged"].values() if len(of) > 1]
    texts = {
        f"{by}.": by,
        f"Grades{name}: {listed}.": True,
        f"Missing: {codes or read['n_missing']}.": read["n_missing"],
        f"Repeated ratings: {repeated}; used: {read['repeated']}.": repeated,
        f"Rows left out: {rows}.": rows,
        f"Unit removed: {read.get('unit')}.": "unit" in read,
        f"Thousands separator removed: {read.get('thousands')!r}.": "thousands" in read,
        f"Read as the same grade: {'; '.join(same[:_SHOWN])}.": same,
    }
    return [text for text, is_so in texts.items() if is_so]


def left_out(ratings: RatingsFile, questions: Questions) -> list[str]:
    """Return what is left out of all that could be estimated."""
    if not questions.takes_all or ratings.is_ordered:
        return []
    return [
        "Left out: the six forms of ICC, Kendall's W and Robinson's A, which need "
        "grades that are numbers or --categories with every grade in order."
    ]


def lacks_interval(answer: Answer) -> bool:
    """Return whether some estimate has no interval and could have one."""
    return any(
        row.estimate.interval is None
        and row.estimate.reason is None
        and COEFFICIENTS[row.estimate.coefficient].formula is not None
        for row in answer.estimates
    )


def reading_warnings(ratings: RatingsFile, first: Answer) -> tuple[Finding, ...]:
    """Return what may have been read wrongly."""
    # of measurements it is warned unless all coefficients weigh how far they lie from
    # each other
    estimates = [row.estimate for row in first.estimates if first.name == "agreement"]
    # and of limits, whose grades need not be alike
    is_warned = not (estimates or first.name.startswith("limits")) or any(
        not COEFFICIENTS[estimate.coefficient].needs_order
        and estimate.weights in ("identity", "nominal")
        for estimate in estimates
    )
    return tuple(
        finding
        for finding in ratings.warnings
        if is_warned or finding.code != "measurements"
    )


# ---- what the tables come to, in one sentence ----

# Answers to a number that must be there, and what is said of its row
_RESULTS = {
    "differences": (
        "low",
        "{title} of {first} minus that of {second} is {difference} ({level} % "
        "confidence interval {low} to {high}; p-value {p_value}).",
    ),
    "equality": (
        "p_value",
        "The test that {title} is the same in all groups has a p-value of {p_value} "
        "({test}).",
    ),
    "diagnosis_raters": (
        "without",
        "{of} would be highest without {rater}{group}: {without}, a change of "
        "{change}.",
    ),
    "limits_of_agreement": (
        "lower",
        "{first} minus {second}{group} is {mean}{unit} on average; 95 % of such "
        "differences are expected between {lower} and {upper}{unit}.",
    ),
    "limits_with_repeats": (
        "value",
        "{first} minus {second}{group} is {value}{unit} on average; 95 % of such "
        "differences are expected between {low_limit} and {high_limit}{unit}.",
    ),
    "limits_that_follow": (
        "value",
        "{first} minus {second}{group} changes by {slope} for each unit of their "
        "mean; if the mean is {average}{unit}, 95 % of such differences are expected "
        "between {low_limit} and {high_limit}{unit}.",
    ),
    "limits_of_ratios": (
        "value",
        "{first} is {value} times {second}{group} on average; 95 % of such ratios are "
        "expected between {low_limit} and {high_limit}.",
    ),
    "limits_with_mean": (
        "value",
        "95 % of single measurements{group} are expected within {value}{unit} of the "
        "mean of all raters.",
    ),
}


def result_sentence(answered: Sequence[Answer], items: str) -> tuple[int, str]:
    """Return the place of the answer that says most, and what it says."""
    if verdicts := "\n".join(_verdicts(answered, items)):
        return 0, verdicts
    for at in reversed(range(len(answered))):
        name, rows, of = answered[at].name, answered[at].shown or (), answered[at].of
        key, text = _RESULTS.get(name, ("", ""))
        if known := [row for row in rows if (x := row.get(key)) is not None and x == x]:
            row = max(known, key=_says_most)
            in_units = name.startswith("limits")
            words = {key: number(x, 3, in_units=in_units) for key, x in row.items()}
            words |= {
                "of": of,
                "p_value": p_text(row.get("p_value")),
                "level": percent(row.get("level") or 0.0),
                "unit": f" {of}" if of else "",
                "group": f" ({row['group']})" if row.get("group") else "",
            }
            return at, text.format(**words)
    if not answered[0].estimates:
        return 0, "The limits of agreement are undefined."
    return 0, _agreement(answered[0], items)


# Answers about judges to what is said of each row
_VERDICTS = {
    "judges": "{judge}{group} {may}: it is worse by less than ε = {epsilon}, if at "
    "all, for {n_rejected} of {n_humans} humans, and {n_needed}.{no_proof} On "
    "{advantage} % of {items} its grade is at least as close to those of the other "
    "humans as a human's is{ends}.",
    "judge_reference": "{judge}{group} {may}: it gives the grade of {reference} on "
    "{difference} % {more} of the {items} than {human}{ends}; {margin} % fewer would "
    "be acceptable.{no_proof}",
    "truth": "By the ratings alone, {class}{group} is the class of {share} % of "
    "{items}{ends}, if raters err independently.",
    "preferences": "{judge} gives the same verdict in both orders on {agreement} % of "
    "{n_pairs} pairs; the share won by the answer shown first minus the share won by "
    "the one shown second is {value} %{ends}.",
    "rates": "{grade} is right for {value} % of {items}{group} by {title}{ends}; "
    "{judge} alone gives {naive} %.",
}
_IN_PERCENT = (
    *("advantage", "agreement", "difference", "value", "naive", "share"),
    *("low", "high", "margin"),
)


def _verdicts(answered: Sequence[Answer], items: str) -> Iterator[str]:
    """Return what is shown of every judge, and what is not, in a sentence or two."""
    for answer in answered:
        for row in answer.shown or () if answer.name in _VERDICTS else ():
            if not row.get("is_default", True):
                continue
            passes, n = row.get("is_passed"), -(-row.get("n_humans", 0) // 2)
            of = {**row, "margin": row.get("epsilon")}
            of |= {"difference": abs(row.get("difference") or 0.0)}
            of |= {
                key: number(100.0 * share, 1)
                for key in _IN_PERCENT
                if isinstance(share := of.get(key), float)
            }
            ends = ""
            if row.get("low") is not None and row.get("reason") is None:
                to = row.get("population", "other items").replace("items", items)
                kind = "credible" if answer.name == "truth" else "confidence"
                ends = f" ({percent(row['level'])} % {kind} interval "
                ends += f"{of['low']} to {of['high']} %, for {to} like these)"
            words: Row = {
                **of,
                "group": f" ({row['group']})" if row.get("group") else "",
                "may": "can replace a human"
                if passes
                else "has not been shown to be able to replace a human",
                "n_needed": f"{n} {'is' if n == 1 else 'are'} "
                f"{'enough' if passes else 'needed'}",
                "no_proof": "" if passes else " This does not prove that it is worse.",
                "more": "fewer" if (row.get("difference") or 0.0) < 0.0 else "more",
                "items": items,
                "ends": ends,
            }
            yield _VERDICTS[answer.name].format(**words)


def judge_sentences(answered: Sequence[Answer], items: str, data: str) -> str:
    """Return what is shown of every judge, one a line."""
    stamp = f"{SIMULATED}. " if data == "simulated" else ""
    return "\n".join(f"{stamp}{text}" for text in _verdicts(answered, items))


def _says_most(row: Row) -> tuple[float, bool]:
    # that without which agreement is highest, or of a coefficient for chance
    return row.get("change") or 0.0, _allows_for_chance(row.get("coefficient", ""))


def _allows_for_chance(name: str) -> bool:
    return name in COEFFICIENTS and COEFFICIENTS[name].chance_corrected


def _agreement(answer: Answer, items: str) -> str:
    """Return how often raters agree, and the first kappa; of groups its ends."""
    rows = answer.estimates
    main = max(rows, key=lambda row: _allows_for_chance(row.estimate.coefficient))
    estimate, name = main.estimate, main.title + "," * (", " in main.title)
    in_units = COEFFICIENTS[estimate.coefficient].in_units
    value = partial(number, digits=3, in_units=in_units)
    if len(same := [row for row in rows if row.title == main.title]) > 1:
        known = [row for row in same if row.estimate.reason is None] or same
        ends = sorted(known, key=lambda row: row.estimate.value)
        low, high = (
            f"{value(row.estimate.value)} ({row.group})" for row in (ends[0], ends[-1])
        )
        return f"{name} ranges from {low} to {high}."
    text = f"{name} is {value(estimate.value)}"
    by_name = {(of.estimate.coefficient, of.estimate.weights): of for of in rows}
    share = by_name.get(("percent_agreement", "identity"), main)
    if share is not main and share.estimate.reason is None:
        others = share.estimate.n_raters > 2
        who = "Two raters picked at random" if others else "The two raters"
        how_often = f"{significant(100.0 * share.estimate.value, 3)} % of the time"
        allows = f"{name}, which allows for chance, is {value(estimate.value)}"
        text = f"{who} give the same grade {how_often}; {allows}"
    if (interval := estimate.interval) is not None and interval.reason is None:
        kind = f"{percent(interval.level)} % {interval.kind}"
        low, high = value(interval.low), value(interval.high)
        both = f"interval from {low} to {high}"
        what = f"lower bound of {low}" if interval.is_one_sided else both
        to = _population(interval).replace("items", items)
        text += f", with a {kind} {what} for {to} like these"
    return f"{text}."
