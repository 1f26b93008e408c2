r"""Tables as LaTeX that pdflatex and lualatex compile.

Every text is escaped. A letter that pdflatex cannot set is named in the first lines.
"""

import re
import unicodedata
from collections.abc import Sequence

from masrel.tables._tables import SYMBOL, Table, page_cells

_APART = "\N{ZERO WIDTH SPACE}"
_MAY_BREAK = "\N{BREAK PERMITTED HERE}"
_LONG_WORD = re.compile(r"\S{20,}")  # such as an address: it may break after "/"

_GREEK = dict(
    zip(
        "αβγδεζηθκλμνξπρστυφχψωΓΔΘΛΞΠΣΥΦΨΩ",
        "alpha beta gamma delta varepsilon zeta eta theta kappa lambda mu nu xi pi rho "
        "sigma tau upsilon varphi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma "
        "Upsilon Phi Psi Omega".split(),
        strict=True,
    )
)

MATH = {
    **{letter: rf"\{name}" for letter, name in _GREEK.items()},
    **{"−": "-", "±": r"\pm", "∞": r"\infty", "≥": r"\geq", "≤": r"\leq"},
    **{"≠": r"\neq", "≈": r"\approx", "×": r"\times", "→": r"\rightarrow"},
    "²": "^2",
    **{
        letter: rf"^{{\mathrm{{{unicodedata.normalize('NFKD', letter)}}}}}"
        for letter in "ᵃᵇᶜᵈᵉᶠᵍʰⁱʲᵏˡᵐⁿᵒᵖʳˢᵗᵘᵛʷˣʸᶻ"
    },
}
"""Letters that LaTeX sets as mathematics, and how it calls them."""

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
        "–": "--",
        "<": r"$<$",
        ">": r"$>$",
        "|": r"$|$",
        "[": "{[}",  # after the end of a line LaTeX would take it for a distance
        "*": "{*}",
        "\t": " ",
        "\n": " ",
        **{letter: f"${name}$" for letter, name in MATH.items()},
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
    r"""Return a table as LaTeX that needs booktabs; what was read is in comments."""
    columns, body = page_cells(table)
    letters = "".join({"left": "l", "center": "c"}.get(c.align, "r") for c in columns)
    tag = rf"\textbf{{{latex_text(table.tag)}}} " if table.tag else ""
    lines = [
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{tag}{latex_text(table.caption)}}}",
        rf"\label{{tab:{table.name}}}",
        rf"\begin{{tabular}}{{{letters}}}",
        *(r"\toprule", _line([c.heading for c in columns]), r"\midrule"),
        *map(_line, body),
        *(r"\bottomrule", r"\end{tabular}"),
    ]
    if table.notes:
        notes = r" \\ ".join(map(latex_text, table.notes))
        lines.append(rf"\par\smallskip\footnotesize\raggedright {notes}")
    text = "\n".join([*lines, r"\end{table}"]) + "\n"
    comments = [r"needs \usepackage{booktabs}"]
    if lacking := sorted({letter for letter in text if not _is_set(letter)}):
        comments.append(f"needs lualatex and a font with {' '.join(lacking)}")
    comments += "\n".join(table.read).splitlines()
    return "".join(f"% {line}\n" for line in comments) + text


def _line(cells: Sequence[str]) -> str:
    return " & ".join(map(latex_text, cells)) + r" \\"


def latex_text(text: str) -> str:
    # symbols of the model are set as such; all else is escaped
    text = _LONG_WORD.sub(
        lambda word: word[0].replace("/", f"/{_MAY_BREAK}"),
        unicodedata.normalize("NFC", text),
    )
    parts = SYMBOL.split(text)
    shown = [_escape(parts[0])]
    for letters, index, after in zip(*(parts[k::3] for k in (1, 2, 3)), strict=True):
        symbol = _escape(letters).replace("$", " ").strip()
        shown += [rf"${symbol}_{{\mathrm{{{index}}}}}$", _escape(after)]
    return "".join(shown)


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


def in_math(text: str) -> str:
    """Return a text with its Greek letters and signs as mathematics, and no other."""
    # a mark stands on its letter
    marked = _MARKED.sub(
        lambda of: rf"$\{_MARKS[of[2]][0]}{{{MATH.get(of[1], of[1])}}}$",
        unicodedata.normalize("NFD", text),
    )
    pieces = (f"${MATH[c]}$" if c in MATH else c for c in marked)
    return unicodedata.normalize("NFC", "".join(pieces))


def _plain(text: str) -> str:
    return unicodedata.normalize("NFC", text).translate(_ESCAPES)


def _is_set(letter: str) -> bool:
    # whether pdflatex sets it without further packages: of letters with accents those
    # of Latin-1 and Latin Extended-A
    parts = unicodedata.normalize("NFD", letter)
    is_accented = parts[0].isascii() and _ACCENTS.issuperset(parts[1:])
    return letter in _LETTERS or (is_accented and letter <= "ſ")
