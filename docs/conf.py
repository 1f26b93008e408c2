"""The site: Sphinx reads the pages of this folder as they stand on a forge.

Build it by ``sphinx-build -W --keep-going docs out/site``. The links of a page named
``index.md`` to the pages below it are the tree of the site; nothing else lists them.
"""

import ast
import importlib
import inspect
import re
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from itertools import pairwise
from os.path import normpath, relpath
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util.logging import getLogger

import masrel

DOCS = Path(__file__).parent
_META = tomllib.loads((DOCS.parent / "pyproject.toml").read_text("utf-8"))["project"]
_SOURCE = _META["urls"]["Source"] if "urls" in _META else ""
_HAS_ADDRESS = bool(_SOURCE) and "OWNER" not in _SOURCE

project = _META["name"]
author = _META["authors"][0]["name"]
copyright = f"{author}, {_META['license']}"  # noqa: A001 (the name that Sphinx reads)
version = release = masrel.__version__
root_doc = "index"
extensions = [
    "myst_parser",
    "notfound.extension",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx_click",
    "sphinx_copybutton",
]
exclude_patterns = ["make", "figures", "_*"]
templates_path = ["_templates"]
nitpicky = True
# Parts of an alias of numpy's; no package index has the inventories of other projects
nitpick_ignore_regex = [("py:class", r"(numpy|collections)\..*")]
highlight_language = "none"
smartquotes = False
suppress_warnings = ["misc.highlighting_failure"]  # output of commands is no language

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
# MathJax as one file with its letters, so that formulas need no network
_MATHJAX = Path(str(find_spec("sphinx-mathjax-offline").origin)).parent
mathjax_path = "tex-svg.js"

numpydoc_show_class_members = False
autosummary_ignore_module_all = False
autosummary_imported_members = True
autodoc_typehints = "none"  # numpydoc has them in words
autodoc_member_order = "bysource"
default_role = "literal"  # as docstrings use one backtick

html_theme = "pydata_sphinx_theme"
html_title = f"masrel {version}"
html_static_path = ["_static", f"{_MATHJAX}/static/mathjax/{mathjax_path}"]
html_favicon = html_logo = "_static/icon.svg"
html_baseurl = _META["urls"]["Documentation"] if _HAS_ADDRESS else ""
html_extra_path = ["robots.txt"]
html_sidebars = {"have_ratings": [], "run_study": []}  # nothing lies below these
html_show_sourcelink = False
html_css_files = ["site.css"]
html_search_scorer = str(DOCS / "_static/scorer.js")
html_theme_options: dict[str, Any] = {
    "check_switcher": False,
    "header_links_before_dropdown": 8,
    "logo": {"text": project},
    "footer_end": ["version-switcher"],
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "navbar_persistent": ["search-button"],
    "switcher": {
        "json_url": f"{html_baseurl}_static/switcher.json",
        "version_match": "dev" if "dev" in version else version,
    },
    "use_edit_page_button": _HAS_ADDRESS,
}
html_context = {"doc_path": "docs", "default_mode": "auto"}
if _HAS_ADDRESS:
    _USER, _REPOSITORY = _SOURCE.split("/")[-2:]
    html_context |= {"github_user": _USER, "github_repo": _REPOSITORY}
    html_context |= {"github_version": "main"}
copybutton_prompt_text = "$ "
notfound_context = {
    "title": "Page not found",
    "body": "<h1>Page not found</h1>\n<p>The page was moved or never existed. Search "
    "for it above, or begin with one of the two doors: I have ratings, or I run a "
    "study.</p>",
}
copybutton_exclude = ".linenos, .gp, .go"

# Files beside this folder, and the pages that show them
_SHOWN = {
    "CONTRIBUTING.md": "development/contributing.md",
    "CHANGELOG.md": "development/changelog.md",
    "SECURITY.md": "development/security.md",
    "studies/hess2012/README.md": "reference/hess2012.md",
}
# Pages whose folder has no index: the index that lists them
_LISTED_BY = {"decisions": "development"}

_PYTHON = (DOCS / "reference/api/index.md").read_text("utf-8")
MODULES = re.findall(r"^ +(masrel[.\w]*)$", _PYTHON, re.M)


def _constants_of(name: str) -> list[str]:
    # Packages load their names on first use, and autodoc looks without using them.
    module, constants = importlib.import_module(name), []
    for entry in module.__all__:
        thing = getattr(module, entry)
        setattr(module, entry, thing)
        if inspect.isclass(thing) and thing in _SEEN:  # two modules have it
            thing.__module__ = name
        elif inspect.isclass(thing):
            _SEEN.append(thing)
        elif not inspect.isroutine(thing) and not inspect.ismodule(thing):
            constants.append(entry)
    return constants


_SEEN = list[type]()
autosummary_context = {"constants": {name: _constants_of(name) for name in MODULES}}


def setup(app: Sphinx) -> None:
    """Connect what is below."""
    app.connect("source-read", _read)
    app.connect("autodoc-process-docstring", _of_constant)
    app.connect("env-check-consistency", _check)


def _read(app: Sphinx, name: str, source: list[str]) -> None:
    file, text = DOCS / f"{name}.md", source[0]
    if not file.exists():
        return
    if shown := re.search(r"^The site shows \[.*\]\((.*)\) here\.$", text, re.M):
        origin = file.parent / shown[1]
        app.env.note_dependency(str(origin))
        text = origin.read_text("utf-8")
        text = _LINK.sub(lambda link: _rebased(link, origin, file), text)
    text = _LINK.sub(lambda link: _inside(link, file), text)
    text = re.sub(r"^```\n(?=\$ )", "```console\n", text, flags=re.M)
    if file.name == "index.md":
        below = "\n".join(dict.fromkeys(_below(file, text)))
        text += f"\n```{{toctree}}\n:hidden:\n\n{below}\n```\n"
    source[0] = text


_LINK = re.compile(r"(\]\()(?![a-z]+:)([^)#\s]+)")


def _rebased(link: re.Match[str], origin: Path, file: Path) -> str:
    # the target of a link in one file, as seen from another
    return link[1] + relpath(origin.parent / link[2], file.parent)


def _inside(link: re.Match[str], file: Path) -> str:
    # a file beside this folder has a page in it
    target = relpath(normpath(file.parent / link[2]), DOCS.parent)
    if target not in _SHOWN:
        return link[0]
    return link[1] + relpath(DOCS / _SHOWN[target], file.parent)


def _below(index: Path, text: str) -> list[str]:
    # pages that the index links to, and that no nearer index has
    targets = [normpath(index.parent / link[2]) for link in _LINK.finditer(text)]
    pages = [Path(target) for target in targets if target.endswith(".md")]
    return [
        relpath(page.with_suffix(""), index.parent)
        for page in pages
        if page != index and _index_of(page) == index
    ]


def _index_of(page: Path) -> Path:
    folder = page.parent.parent if page.name == "index.md" else page.parent
    folder = DOCS / _LISTED_BY.get(folder.name, folder)
    while not (folder / "index.md").exists():
        folder = folder.parent
    return folder / "index.md"


def _check(app: Sphinx, env: BuildEnvironment) -> None:
    # every public name has its place
    del app
    documented = {*MODULES, *env.domaindata["py"]["objects"]}
    for name in MODULES:
        for entry in importlib.import_module(name).__all__:
            if f"{name}.{entry}" not in documented:
                getLogger(__name__).warning("no page has %s.%s", name, entry)


def _of_constant(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    # a constant has no docstring at run time: the text below its assignment is read
    del app, thing, options
    if what == "data":
        module, _, entry = name.rpartition(".")
        lines[:] = _documented_constants(sys.modules[module].__file__ or "")[entry]


@cache
def _documented_constants(file: str) -> dict[str, list[str]]:
    # those of the module count before others of its folder
    files = [*sorted(Path(file).parent.rglob("*.py")), Path(file)]
    return dict(pair for source in files for pair in _documented(source))


def _documented(source: Path) -> Iterator[tuple[str, list[str]]]:
    for statement, below in pairwise(ast.parse(source.read_text("utf-8")).body):
        match statement, below:
            case (
                (
                    ast.Assign(targets=[ast.Name(id=target)])
                    | ast.AnnAssign(target=ast.Name(id=target))
                ),
                ast.Expr(value=ast.Constant(value=str(text))),
            ):
                yield target, inspect.cleandoc(text).splitlines()
