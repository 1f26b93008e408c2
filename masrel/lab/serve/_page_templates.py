"""Pages from templates, with everything escaped that comes from a study."""

import functools
from typing import TYPE_CHECKING

from starlette.requests import Request
from starlette.responses import HTMLResponse

if TYPE_CHECKING:
    from jinja2 import Environment


def render(request: Request, name: str, **context: object) -> HTMLResponse:
    """Return a page; its template knows `csrf`, which the page sends back."""
    return HTMLResponse(page(name, csrf=request.state.csrf, **context))


def page(name: str, **context: object) -> str:
    """Return a page as HTML."""
    return _environment().get_template(name).render(**context)


@functools.cache
def _environment() -> "Environment":
    # Imported here: what only serves files loads no templates.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("masrel.lab.serve"),
        autoescape=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
