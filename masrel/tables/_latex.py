r"""Tables as LaTeX that pdflatex and lualatex compile.

Every text is escaped. A letter that pdflatex cannot set is named in the first lines.
"""

import re
import unicodedata
from collections.abc import Sequence

from masrel.tables._tables import SYMBOL, Column, Table, page_cells

_ROWS_OF_A_PAGE = 40
_APART = "\N{ZERO WIDTH SPACE}"
_MAY_BREAK = "\N{BREAK PERMITTED HERE}"
_LONG_WORD = re.compile(r"\S{20,}")  # such as an address: it may break after "/"

# Widths in letters of ten points: of a line, of what a column takes beside its letters,
# and from which on a column of text may be broken into lines; how many more letters
# there are in a line of each smaller size.
_LINE, _GAP, _NARROW_GAP, _LONG_TEXT = 88.0, 2.4, 1.6, 18
_SIZES = {r"\small": 1.1, r"\footnotesize": 1.25, r"\scriptsize": 1.43}
_SMALLEST = (r"\scriptsize", 1.43)

_GREEK = dict(
    zip(
        "αβγδεζηθκλμνξπρστυφχψωΓΔΘΛΞΠΣΥΦΨΩ",
        "alpha beta gamma delta varepsilon zeta eta theta kappa lambda mu nu xi pi rho "
        "sigma tau upsilon varphi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma "
        "Upsilon Phi Psi Omega".split(),
        strict=True,
    )
)

_ESCAPES = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "&": r"\&",
        "%": r"\%",
        "$": r"\$",
        "#": r"\#",
        "_": r"\_",
        "{": r"\{",
        "}": r"\}",
        "~": r"$\sim$",
        "^": r"\textasciicircum{}",
        _APART: "{}",
        _MAY_BREAK: r"\allowbreak{}",
        "−": "$-$",
        "–": "--",
        "±": r"$\pm$",
        "∞": r"$\infty$",
        "≥": r"$\geq$",
        "≤": r"$\leq$",
        "≠": r"$\neq$",
        "≈": r"$\approx$",
        "×": r"$\times$",
        "→": r"$\rightarrow$",
        "<": r"$<$",
        ">": r"$>$",
        "|": r"$|$",
        "[": "{[}",  # after the end of a line LaTeX would take it for a distance
        "*": "{*}",
        "²": "$^2$",
        "\t": " ",
        "\n": " ",
        **{letter: rf"$\{name}$" for letter, name in _GREEK.items()},
        **{
            letter: rf"\textsuperscript{{{unicodedata.normalize('NFKD', letter)}}}"
            for letter in "ᵃᵇᶜᵈᵉᶠᵍʰⁱʲᵏˡᵐⁿᵒᵖʳˢᵗᵘᵛʷˣʸᶻ"
        },
    }
)
_ACCENTS = frozenset(
    "\N{COMBINING GRAVE ACCENT}\N{COMBINING ACUTE ACCENT}\N{COMBINING TILDE}"
    "\N{COMBINING CIRCUMFLEX ACCENT}\N{COMBINING DIAERESIS}\N{COMBINING CARON}"
    "\N{COMBINING RING ABOVE}\N{COMBINING CEDILLA}"
)
# Marks of formulas: above a Greek letter, and above another one, as LaTeX names them.
_MARKS = {
    "\N{COMBINING DOT ABOVE}": ("dot", "."),
    "\N{COMBINING DIAERESIS}": ("ddot", '"'),
    "\N{COMBINING CIRCUMFLEX ACCENT}": ("hat", "^"),
    "\N{COMBINING MACRON}": ("bar", "="),
    "\N{COMBINING TILDE}": ("tilde", "~"),
}
_MARKED = re.compile(f"([A-Za-z{''.join(_GREEK)}])([{''.join(_MARKS)}])")
_LETTERS = frozenset("ßæøœłıÆØŒŁ…‘’“”—§¶£·³¹°")


def as_latex(table: Table) -> str:
    r"""Return a table as LaTeX that needs the packages its first line names.

    What was read stands above it in comments.
    """
    text = latex_table(table)
    packages = [
        name
        for name, mark in {
            "array": "arraybackslash",
            "booktabs": "toprule",
            "graphicx": "resizebox",
            "longtable": r"\begin{longtable}",
        }.items()
        if mark in text
    ]
    comments = [rf"needs \usepackage{{{','.join(packages)}}}"]
    if lacking := lacking_letters(text):
        comments += [f"needs lualatex and a font with {' '.join(lacking)}"]
    comments += "\n".join(table.read).splitlines()
    return "".join(f"% {line}\n" for line in comments) + text


def lacking_letters(text: str) -> list[str]:
    """Return the letters of a LaTeX text that pdflatex does not set."""
    return sorted({letter for letter in text if not _is_set(letter)})


def latex_table(table: Table) -> str:
    columns, body = page_cells(table)
    size, letters, is_shrunk = _layout(columns, body)
    tag = rf"\textbf{{{latex_text(table.tag)}}} " if table.tag else ""
    caption = rf"\caption{{{tag}{latex_text(table.caption)}}}"
    label = rf"\label{{tab:{table.name}}}"
    heading = [r"\toprule", _line([c.heading for c in columns]), r"\midrule"]
    sizes = [size] if size else []
    if len(body) > _ROWS_OF_A_PAGE:  # the heading stands again on every page
        kind, end, is_shrunk = "longtable", r"\par\endgroup", False
        begin = [r"\begingroup", *sizes, rf"\begin{{longtable}}{{{letters}}}"]
        begin += [rf"{caption} {label} \\", *heading, r"\endfirsthead"]
        begin += [*heading, r"\endhead"]
    else:
        kind, end = "tabular", r"\end{table}"
        begin = [r"\begin{table}", r"\centering", caption, label, *sizes]
        begin += [r"\resizebox{\linewidth}{!}{%"] if is_shrunk else []
        begin += [rf"\begin{{tabular}}{{{letters}}}", *heading]
    close = rf"\end{{{kind}}}" + ("}" if is_shrunk else "")
    lines = [*begin, *map(_line, body), r"\bottomrule", close]
    if table.notes:
        notes = r" \\ ".join(map(latex_text, table.notes))
        lines.append(rf"\par\smallskip\footnotesize\raggedright {notes}")
    return "\n".join([*lines, end]) + "\n"


def _layout(
    columns: Sequence[Column], body: Sequence[Sequence[str]]
) -> tuple[str, str, bool]:
    # size of the letters, how columns are set, and whether the table is scaled to fit
    cells = [[column.heading for column in columns], *body]
    widths = [max(map(len, texts)) for texts in zip(*cells, strict=True)]
    plain = [{"left": "l", "center": "c"}.get(c.align, "r") for c in columns]
    if sum(widths) + _GAP * len(columns) <= _LINE:
        return "", "".join(plain), False
    room = _LINE - _NARROW_GAP * len(columns)
    long = {
        place: width
        for place, (column, width) in enumerate(zip(columns, widths, strict=True))
        if column.align == "left" and width > _LONG_TEXT
    }
    short = sum(widths) - sum(long.values())
    needed = short + _LONG_TEXT * len(long)
    size, factor = next(
        (each for each in _SIZES.items() if needed <= room * each[1]), _SMALLEST
    )
    for place, width in long.items():  # what the others leave, by their lengths
        left = max(0.97 * room * factor - short, _LONG_TEXT * len(long))
        share = min(left * width / sum(long.values()), width) / factor / _LINE
        part = "." + str(min(int(1000 * share), 999)).zfill(3)  # of a line
        plain[place] = rf">{{\raggedright\arraybackslash}}p{{{part}\linewidth}}"
    is_shrunk = not long and needed > room * factor
    return size + r"\setlength{\tabcolsep}{4pt}", "".join(plain), is_shrunk


def _line(cells: Sequence[str]) -> str:
    return " & ".join(map(latex_text, cells)) + r" \\"


def latex_text(text: str) -> str:
    # symbols of the model are set as such; all else is escaped
    text = _LONG_WORD.sub(_breakable, unicodedata.normalize("NFC", text))
    parts = SYMBOL.split(text)
    shown = [_escape(parts[0])]
    for letters, index, after in zip(*(parts[k::3] for k in (1, 2, 3)), strict=True):
        symbol = _escape(letters).replace("$", " ").strip()
        shown += [rf"${symbol}_{{\mathrm{{{index}}}}}$", _escape(after)]
    return "".join(shown)


def _breakable(word: re.Match[str]) -> str:
    return word[0].replace("/", f"/{_MAY_BREAK}")


def _escape(text: str) -> str:
    # of an option's two hyphens TeX would make a dash
    text = text.replace("--", f"-{_APART}-")
    pieces = (c if _is_set(c) else unicodedata.normalize("NFD", c) for c in text)
    first, *others = _MARKED.split("".join(pieces))
    shown = [_plain(first)]
    for letter, mark, after in zip(*(others[k::3] for k in range(3)), strict=True):
        of_formula, of_text = _MARKS[mark]
        is_greek = letter in _GREEK
        name = rf"\{_GREEK[letter]}" if is_greek else letter
        marked = rf"$\{of_formula}{{{name}}}$" if is_greek else rf"\{of_text}{{{name}}}"
        shown += [marked, _plain(after)]
    return "".join(shown)


def _plain(text: str) -> str:
    return unicodedata.normalize("NFC", text).translate(_ESCAPES)


def _is_set(letter: str) -> bool:
    # whether pdflatex sets it without further packages: of letters with accents those
    # of Latin-1 and Latin Extended-A
    parts = unicodedata.normalize("NFD", letter)
    is_accented = parts[0].isascii() and _ACCENTS.issuperset(parts[1:])
    return letter in _LETTERS or (is_accented and letter <= "ſ")
