"""The part of the page on coverage where most ratings are of one category."""

from collections.abc import Iterable, Iterator, Sequence

from docs.make.coverage.careless import SHARE, CarelessCell
from docs.make.coverage.rare import Held, RareCell
from docs.make.coverage.rare_studies import Shares

_TITLES = {
    "fleiss_kappa": "Fleiss' κ",
    "krippendorff_alpha": "α",
    "cohen_kappa": "Cohen's κ",
    "conger_kappa": "Conger's κ",
    "gwet_ac": "AC",
}
_POPULATIONS = {
    "alike": "alike",
    "unlike": "unlike",
    "double coding": "20 % double coding",
}
Cells = Sequence[RareCell]


def rare_summary(cells: Cells) -> list[list[str]]:
    """Rows: coefficient, cells, and how many fail by jackknife and by default."""
    rows = []
    for name in dict.fromkeys(cell.coefficient for cell in cells):
        here = [cell for cell in cells if cell.coefficient == name]
        row = [_title(name), str(len(here))]
        for method in ("jackknife", "default"):
            verdicts = [cell.verdict(method) for cell in here]
            least = min(cell.methods[method].coverage for cell in here)
            row += [str(verdicts.count("low")), f"{100 * least:.0f}"]
        row.append(str(verdicts.count("high")))
        rows.append(row)
    return rows


def rare_failures(cells: Cells) -> list[list[str]]:
    """Rows: the cells in which the default covers too little."""
    return [
        [
            _title(cell.coefficient),
            *_place(cell),
            f"{cell.question.kappa:g}",
            str(cell.n_defined),
            shown(cell, "default"),
            shown(cell, "jackknife"),
        ]
        for cell in cells
        if cell.verdict() == "low"
    ]


def rare_cells(cells: Cells) -> Iterator[tuple[list[str], list[list[str]]]]:
    """Tables of the default: heads, and rows of population, shares and sizes."""
    for weighted in (False, True):
        here = [cell for cell in cells if (len(cell.question.shares) > 2) == weighted]
        groups: dict[tuple[str, ...], dict[str, list[RareCell]]] = {}
        for cell in sorted(here, key=_order):
            of_place = groups.setdefault(_place(cell), {})
            of_place.setdefault(_column(cell), []).append(cell)
        if not here:
            continue
        columns = list(dict.fromkeys(map(_column, here)))
        kappas = " / ".join(
            f"{kappa:g}" for kappa in sorted({cell.question.kappa for cell in here})
        )
        head = ["raters", "rarer", "items × raters", *columns, "no κ, %"]
        rows = [
            [
                *place,
                *(" / ".join(shown(c, "default") for c in of[k]) for k in columns),
                " / ".join(_undefined(c) for c in of[columns[0]]),
            ]
            for place, of in groups.items()
        ]
        yield [*head[:2], f"{head[2]}, κ {kappas}", *head[3:]], rows


def _column(cell: RareCell) -> str:
    # Cohen's is of two raters what Conger's is of more
    name = cell.coefficient.replace("cohen_kappa", "conger_kappa")
    return _title(name).replace("Conger's κ", "Cohen's or Conger's κ")


def _undefined(cell: RareCell) -> str:
    return f"{100 - 100 * cell.n_defined / cell.n_studies:.0f}"


def careless_rows(cells: Iterable[CarelessCell]) -> list[list[str]]:
    """Rows: designs, coverage and studies without a careless rater."""
    return [
        [
            str(cell.design),
            f"{100 * cell.coverage:.0f}",
            f"{100 * cell.with_none:.0f}",
        ]
        for cell in cells
    ]


def careless_share() -> str:
    """How many raters are careless, in per cent."""
    return f"{100 * SHARE:.0f}"


def shown(cell: RareCell, method: str) -> str:
    """Return a coverage; bold: it is too little; italic: more than need be."""
    held: Held = cell.methods[method]
    text = f"{100 * held.coverage:.0f}"
    verdict = cell.verdict(method)
    return {"low": f"**{text}**", "high": f"*{text}*"}.get(verdict, text)


def _title(name: str) -> str:
    kind, _, weights = name.partition(", ")
    return f"{_TITLES[kind]}, {weights}" if weights else _TITLES[kind]


def _place(cell: RareCell) -> tuple[str, str, str]:
    question = cell.question
    return (
        _POPULATIONS[question.kind],
        _shares(question.shares),
        f"{question.n_items} × {question.n_raters}",
    )


def _order(cell: RareCell) -> tuple[object, ...]:
    question = cell.question
    return (
        len(question.shares),
        list(_POPULATIONS).index(question.kind),
        question.shares[-1],
        question.n_raters,
        question.n_items,
        question.kappa,
    )


def _shares(shares: Shares) -> str:
    if len(shares) == 2:
        return f"{100 * shares[1]:g} %"
    return ", ".join(f"{100 * share:g}" for share in shares) + " %"
