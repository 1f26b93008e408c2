r"""A whole report as a LaTeX file that pdflatex and lualatex compile."""

import textwrap
from collections.abc import Iterator

from masrel.pages._sections import Block, Document, Drawing, Listing
from masrel.tables._latex import lacking_letters, latex_table, latex_text
from masrel.tables._tables import Table


def report_latex(document: Document) -> str:
    """Return a report as a LaTeX file beside the folder of its figures."""
    body = "\n".join(_body(document))
    lacking = lacking_letters(body)
    head = [
        f"% Made by masrel {latex_text(document.version)}. Compile it twice in this "
        "folder.",
        *(_HEAD_OF_LUALATEX if lacking else _HEAD),
        *_PREAMBLE,
    ]
    letters = " ".join(lacking)
    return "\n".join(head).replace("LETTERS", letters) + "\n" + body + "\n"


_HEAD = (
    r"\documentclass[a4paper]{article}",
    r"\usepackage{iftex}",
    r"\ifPDFTeX",
    r"\usepackage[T1]{fontenc}",
    r"\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}",
    r"\fi",
)
_HEAD_OF_LUALATEX = (
    "% Needs lualatex, and in the line of setmainfont a font with LETTERS",
    r"\documentclass[a4paper]{article}",
    r"\usepackage{iftex}",
    r"\ifPDFTeX",
    r"\errmessage{This report has letters that pdflatex cannot set: use lualatex}",
    r"\fi",
    r"\usepackage{fontspec}",
    r"% \setmainfont{Noto Serif CJK KR}",
)
_PREAMBLE = (
    r"\usepackage[margin=25mm]{geometry}",
    r"\usepackage{array,booktabs,float,graphicx,longtable}",
    r"\usepackage[hidelinks,pdfusetitle]{hyperref}",
    "% Without this line tables and figures float",
    r"\floatplacement{table}{H}\floatplacement{figure}{H}",
    "% An old graphicx knows no texts for who cannot see a figure",
    r"\makeatletter\@ifundefined{KV@Gin@alt}{\define@key{Gin}{alt}{}}{}\makeatother",
    "% No figure is enlarged",
    r"\makeatletter\def\naturalwidth{\ifdim\Gin@nat@width>\linewidth\linewidth",
    r"\else\Gin@nat@width\fi}\makeatother",
    r"\setlength{\emergencystretch}{3em}\setlength{\belowcaptionskip}{6pt}",
)


def _body(document: Document) -> Iterator[str]:
    yield rf"\title{{{latex_text(document.title)}}}"
    yield r"\author{}"
    yield r"\date{}"
    if document.tag:
        head = latex_text(document.tag.removesuffix(".").upper())
        yield rf"\pagestyle{{myheadings}}\markright{{\textbf{{{head}}}}}"
    yield r"\begin{document}"
    yield r"\maketitle"
    if document.banner:
        banner = rf"\centering\bfseries {latex_text(document.banner)}"
        yield (
            rf"\noindent\fbox{{\parbox{{\dimexpr\linewidth-2\fboxsep-2\fboxrule}}"
            rf"{{{banner}}}}}\par\medskip"
        )
    yield latex_text(document.provenance)
    yield ""
    yield latex_text(f"{document.tag} {document.result}".strip())
    yield r"\tableofcontents"
    for section in document.sections:
        yield ""
        yield rf"\section{{{latex_text(section.title)}}}\label{{sec:{section.name}}}"
        for block in section.blocks:
            yield ""
            yield _block(block, document.tag)
    yield ""
    yield r"\section*{Provenance}"
    yield rf"masrel {latex_text(document.version)}."
    yield r"\begin{description}\raggedright\small"
    for name, digest in document.inputs:
        yield rf"\item[{latex_text(name)}] \texttt{{{latex_text(digest)}}}"
    yield r"\end{description}"
    yield r"\end{document}"


def _block(block: Block, tag: str) -> str:
    content = block.content
    if isinstance(content, Table):
        return latex_table(content)
    if isinstance(content, Drawing):
        return _figure(content, block.files["png"], tag)
    if isinstance(content, Listing):
        # as it is, so that it can be copied out of the file
        lines = [part for line in content.text.splitlines() for part in _broken(line)]
        begin = rf"\subsection*{{{latex_text(content.title)}}}"
        small = r"\begingroup\footnotesize\begin{verbatim}"
        return "\n".join([begin, small, *lines, r"\end{verbatim}\endgroup"])
    text = latex_text(content.text)
    return rf"\emph{{{text}}}" if content.absent else text


def _broken(line: str) -> list[str]:
    # a line of a listing, in lines that fit
    return textwrap.wrap(line, 96, subsequent_indent="    ") or [""]


def _figure(drawing: Drawing, file: str, tag: str) -> str:
    label = rf"\textbf{{{latex_text(tag)}}} " if tag else ""
    size = r"width=\naturalwidth,height=.8\textheight,keepaspectratio"
    lines = [
        r"\begin{figure}",
        r"\centering",
        rf"\includegraphics[{size},alt={{{latex_text(drawing.alt)}}}]{{{file}}}",
        rf"\caption{{{label}{latex_text(drawing.caption)}}}",
        rf"\label{{fig:{drawing.name}}}",
        r"\end{figure}",
    ]
    return "\n".join(lines)
