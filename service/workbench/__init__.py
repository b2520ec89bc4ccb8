"""The workbench at ``/``: plain ES modules, style sheets and plotly's script, from files of this machine.

Files are sent with an entity tag and asked for again at every visit, so that a new release is seen at once. Plotly's
script is 4.8 MB and never changes under its name, which holds its version: browsers keep it for a year.
"""

from __future__ import annotations

from importlib.metadata import distribution
from pathlib import Path

from fastapi import FastAPI, Request, Response
from fastapi.responses import FileResponse
from fastapi.staticfiles import StaticFiles
from starlette.types import Scope

from service.wire.answering import answer

STATIC = Path(__file__).parent / "static"
_PLOTLY = distribution("plotly")  # asked for its files only: nothing of it is imported
SCRIPT = Path(str(_PLOTLY.locate_file("plotly/package_data/plotly.min.js")))
#: Below the page, so that it is found wherever a proxy puts the service.
SCRIPT_URL = f"workbench/plotly-{_PLOTLY.version}.min.js"

#: What the pages may load. Plotly writes style elements, hence the styles; it saves pictures through ``blob:`` and
#: ``data:`` images. It asks for no evaluation of text and no worker for the kinds of plot that are drawn here.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'; font-src 'self'; worker-src blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {"Content-Security-Policy": POLICY, "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer"}


class Files(StaticFiles):
    """Static files whose copies are checked by their tag before they are used again."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """The file or its absence, with the headers of the page."""
        response = await super().get_response(path, scope)
        response.headers.update({"Cache-Control": "no-cache", **HEADERS})
        return response


def install(app: FastAPI) -> None:
    """Serve the page at ``/`` and what it needs below ``/workbench``."""
    page = (STATIC / "index.html").read_text(encoding="utf-8").replace("{plotly}", SCRIPT_URL).encode()

    @app.get("/", include_in_schema=False)
    def workbench(request: Request) -> Response:
        return answer(request, page, media_type="text/html", headers={"Cache-Control": "no-cache", **HEADERS})

    @app.get(f"/{SCRIPT_URL}", include_in_schema=False)
    def plotly_script() -> FileResponse:
        kept = {"Cache-Control": "public, max-age=31536000, immutable", **HEADERS}
        return FileResponse(SCRIPT, media_type="text/javascript", headers=kept)

    app.mount("/workbench", Files(directory=STATIC), name="workbench")
