"""What a paper cites: the entries of a BibTeX file, and what each is cited for."""

import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from masrel.agreement import COEFFICIENTS
from masrel.estimates import Interval
from masrel.scales import PublishedScale

_FILE = Path(__file__).with_name("templates") / "references.bib"

# Words in the method of an interval to what it rests on
_METHODS = {
    "jackknife": "efron1981",
    "bootstrap": "efron1993",
    "Dirichlet-multinomial": "mosimann1962",
    "delta method": "gwet2014",
}

_SCALES = {
    "modified-ashworth": ("bohannon1987",),
    "ashworth": ("ashworth1964",),
    "tardieu": ("gracies2010",),
    "modified-tardieu": ("boyd1999",),
    "updrs-rigidity": ("goetz2008",),
}


def coefficient_references(coefficient: str, weights: str) -> tuple[str, ...]:
    """Return the keys of what a coefficient is cited for."""
    if (entry := COEFFICIENTS.get(coefficient)) is None:  # kappa of a category
        return ()
    is_alpha = coefficient == "krippendorff_alpha"
    is_of_kappa = entry.weighted and weights != "identity" and not is_alpha
    return (*entry.references, "cohen1968") if is_of_kappa else entry.references


def interval_references(interval: Interval) -> tuple[str, ...]:
    """Return the keys of what the method of an interval is cited for."""
    return tuple(key for words, key in _METHODS.items() if words in interval.method)


def scale_references(scale: PublishedScale | None) -> tuple[str, ...]:
    """Return the keys of what a scale is cited for, if it is one of the literature."""
    return () if scale is None else _SCALES[scale.id]


@cache
def _entries() -> dict[str, str]:
    # key -> entry as it stands in the file
    text = _FILE.read_text(encoding="utf-8")
    entries = (entry.strip() for entry in text.split("\n\n"))
    return {entry.partition("{")[2].partition(",")[0]: entry for entry in entries}


def bibtex(keys: Iterable[str]) -> str:
    """Return entries as BibTeX, in the order of their keys."""
    return "\n\n".join(_entries()[key] for key in sorted(set(keys)))


def cited(keys: Iterable[str]) -> str:
    """Return references in brackets with a space before them; nothing for none."""
    names = "; ".join(map(_author_year, keys))
    return f" ({names})" if names else ""


@cache
def _fields(key: str) -> dict[str, str]:
    # of an entry, without the braces that keep capitals
    fields = re.findall(r"^  (\w+) = \{(.*)\},?$", _entries()[key], re.M)
    return {name: re.sub("[{}]", "", text) for name, text in fields}


def _author_year(key: str) -> str:
    fields = _fields(key)
    surnames = [name.partition(",")[0] for name in fields["author"].split(" and ")]
    if len(surnames) > 2 or surnames[-1] == "others":
        return f"{surnames[0]} et al., {fields['year']}"
    return f"{' & '.join(surnames)}, {fields['year']}"


def reference_texts(keys: Iterable[str]) -> list[str]:
    """Return references as a paper lists them."""
    return sorted(map(_reference_text, set(keys)))


def _reference_text(key: str) -> str:
    fields = _fields(key)
    authors = "; ".join(fields["author"].split(" and ")).replace("; others", " et al.")
    where = fields.get("journal") or fields.get("booktitle") or fields["publisher"]
    number = f"({fields['number']})" if "number" in fields else ""
    parts = (where, f"{fields.get('volume', '')}{number}", fields.get("pages", ""))
    listed = ", ".join(filter(None, parts)).replace("--", "–")
    doi = f" https://doi.org/{fields['doi']}" if "doi" in fields else ""
    return f"{authors} ({fields['year']}). {fields['title']}. {listed}.{doi}"
