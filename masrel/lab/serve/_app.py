"""The pages of a study as an application that a web server calls."""

import mimetypes
from pathlib import Path

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from masrel.errors import MasrelError
from masrel.lab.serve._access import Access
from masrel.lab.serve._coordinator_routes import coordinator_routes
from masrel.lab.serve._desk import Desk
from masrel.lab.serve._middleware import Middleware
from masrel.lab.serve._rater_routes import rater_routes

_STATIC = Path(__file__).with_name("static")


def make_app(desk: Desk, access: Access) -> Middleware:
    """Return the application: every request passes `Middleware` first."""
    app = Starlette(
        routes=[
            *rater_routes(desk, access),
            *coordinator_routes(desk, access),
            _static(),
        ],
        exception_handlers={
            HTTPException: _not_there,
            MasrelError: _refused,
            OSError: _failed,
            Exception: _failed,
        },
    )
    app.state.access, app.state.desk = access, desk
    return Middleware(app, access)


def _static() -> Route:
    # Read once: no path of a request reaches the disk.
    files = {path.name: path.read_bytes() for path in _STATIC.glob("*.*")}

    async def show(request: Request) -> Response:
        name = request.path_params["name"]
        if name not in files:
            raise HTTPException(404)
        kind, _ = mimetypes.guess_type(name)
        return Response(files[name], media_type=kind)

    return Route("/static/{name}", show)


async def _not_there(_: Request, error: Exception) -> Response:
    status = error.status_code if isinstance(error, HTTPException) else 404
    why = "There is no such page." if status == 404 else str(error)
    return JSONResponse({"why": why}, status_code=status)


async def _refused(_: Request, error: Exception) -> Response:
    return JSONResponse({"why": str(error)}, status_code=422)


async def _failed(_: Request, error: Exception) -> Response:
    where = getattr(error, "filename", None)
    why = str(
        getattr(error, "strerror", None) or "The server failed; see its terminal."
    )
    return JSONResponse({"why": f"{where}: {why}" if where else why}, status_code=500)
