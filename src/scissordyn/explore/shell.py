"""What the browser gets at once, while the libraries of the page are imported: its frame, its scripts and its colours."""

from __future__ import annotations

import asyncio
import re
from html import escape
from importlib.util import find_spec
from pathlib import Path

from tornado.httputil import HTTPMessageDelegate, HTTPServerRequest
from tornado.routing import Router
from tornado.web import Application, RequestHandler, StaticFileHandler

from scissordyn.explore.access import Access

SCRIPTS = (
    "static/js/bokeh.min.js",
    "static/js/bokeh-widgets.min.js",
    "static/js/bokeh-tables.min.js",
    "static/extensions/panel/panel.min.js",
)
"""What the page's libraries need in the browser, in this order; modules are imported by the browser itself."""

ELEMENT = "sd-page"
BEGIN = "autoload.js"
EARLY = ("early.js", "motion.json")
"""The first drawing: the mechanism as it is declared, and its motion."""

INSIDE = ("autoload.js", "ws")
"""What the page's own server answers; whatever else its libraries would answer is not reached."""

CAREFUL = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""For browsers: no other site may show the page in a frame, read what it has, or learn its address."""

STYLE = """
:root { --sd-back: #ffffff; --sd-ink: #222222; --sd-faint: #5f6670; --sd-fill: #e4e4e4; --sd-line: #b8bdc4; --sd-field: #f4f5f6;
  --sd-blue: #0072B2; --sd-green: #009E73; --sd-contact: #C04F00; --sd-free: #56B4E9; --sd-part: #CC79A7; --sd-trail: #B87700 }
:root[data-sd-theme=dark] { --sd-back: #1d2126; --sd-ink: #e8e8e8; --sd-faint: #a0a6ad; --sd-fill: #3a4048; --sd-line: #565e68;
  --sd-field: #2a2f36; --sd-blue: #56B4E9; --sd-green: #33C79A; --sd-contact: #FF8A3D; --sd-free: #8ED0F5; --sd-part: #E2A3C7;
  --sd-trail: #F0B83A; color-scheme: dark }
html, body { display: flow-root; box-sizing: border-box; height: 100%; margin: 0; padding: 0 }
body { background: var(--sd-back); padding: 0 10px }
#sd-page { display: grid; height: 100%; gap: 0 10px; grid-template-columns: 340px minmax(420px, 1fr) minmax(400px, 1fr);
  grid-template-rows: auto minmax(240px, 1fr) 90px 200px;
  grid-template-areas: "bar bar bar" "form canvas curves" "orbit canvas curves" "orbit table curves" }
@media (max-width: 1179px) {
  html, body { height: auto }
  #sd-page { height: auto; grid-template-columns: minmax(280px, 340px) minmax(340px, 1fr);
    grid-template-rows: auto 480px 300px auto;
    grid-template-areas: "bar bar" "form canvas" "orbit table" "curves curves" }
}
@media (max-width: 719px) {
  #sd-page { grid-template-columns: minmax(0, 1fr); grid-template-rows: auto 380px auto 300px auto 320px;
    grid-template-areas: "bar" "canvas" "curves" "table" "orbit" "form" }
}
#sd-start { font: 13px/1.4 system-ui, sans-serif; color: var(--sd-faint); margin: 10px 0 }
"""

ICON = (
    "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 16 16'%3E%3Cpath d='M2 3 14 13M2 13 14 3' "
    "stroke='%230072B2' stroke-width='2.4'/%3E%3Ccircle cx='8' cy='8' r='2.2' fill='%23D55E00'/%3E%3C/svg%3E"
)

FRAME = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{name} - scissordyn</title>
<link rel="icon" href="{icon}">
<style>{style}</style>
<script>
document.documentElement.dataset.sdTheme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
// the scripts below are all that the page needs: none is loaded a second time
window._bokeh_onload_callbacks = []; window._bokeh_is_loading = 0;
// the page's components import nothing: they need no maps of imports, which a library of its own would give old browsers
window.importShim = Object.assign(url => import(url), {{ addImportMap: () => {{ }} }});
</script>
{scripts}
<script type="module">
// No style sheet of the page sets colours and widths of figures, and the size of letters stays: to ask for them before each
// line and each axis costs more than drawing it.
try {{
  Bokeh.require("core/visuals/visual").VisualProperties.prototype._get_css_value = () => "";
  const plot = Bokeh.require("models/plots/plot_canvas").PlotView.prototype;
  const {{ get }} = Object.getOwnPropertyDescriptor(plot, "base_font_size"), known = new WeakMap();
  Object.defineProperty(plot, "base_font_size", {{ get() {{
    if (!known.has(this) && this.el.isConnected) known.set(this, get.call(this));
    return known.get(this) ?? get.call(this);
  }} }});
}} catch (error) {{ console.warn(`figures are drawn as slowly as they come: ${{error}}`); }}
</script>
<script defer src="start.js"></script>
</head>
<body><p id="sd-start" role="status">{name}: starting</p><div id="{element}"></div>
<script type="module" async src="early.js"></script></body>
</html>
"""


def area(name: str) -> dict[str, str]:
    """Where in the frame a part of the page stands: "bar", "form", "canvas", "curves", "orbit" or "table"."""
    return {"grid-area": name, "min-width": "0", "min-height": "0"}


class Entrance(Router):
    """The way into the server: its first page and the files of the libraries, and whatever else once they are imported."""

    def __init__(self, name: str, access: Access) -> None:
        self.access = access
        self.inside: Router | None = None
        self.asked = False
        self._open = asyncio.Event()
        self._early = {name: Awaited() for name in EARLY}
        self.frame = FRAME.format(
            name=escape(name),
            icon=ICON,
            style=STYLE,
            element=ELEMENT,
            scripts="\n".join(f'<script defer src="{script}"></script>' for script in SCRIPTS),
        )
        files = {"panel": package_folder("panel") / "dist", "bokeh": package_folder("bokeh") / "server" / "static" / "js"}
        self._first = Application(
            [
                (r"/[^/]+/", Frame, {"frame": self.frame}),
                (r"/[^/]+/start\.js", Start, {"ready": self._open}),
                *((rf"/[^/]+/{re.escape(name)}", Early, {"content": content}) for name, content in self._early.items()),
                (r"/[^/]+/static/extensions/panel/(.*)", Files, {"path": files["panel"]}),
                (r"/[^/]+/static/js/(.*)", Files, {"path": files["bokeh"]}),
                (r".*", Refused, {"status": 404, "said": "nothing here"}),
            ]
        )

    def draw(self, script: str) -> None:
        """Answer those who wait for the script of the first drawing."""
        self._early["early.js"].come(script)

    def move(self, motion: str) -> None:
        """Answer those who wait for the motion of the first drawing."""
        self._early["motion.json"].come(motion)

    def admit(self, inside: Router) -> None:
        """Let requests through to the page's own server, which is ready now."""
        self.inside = inside
        self._open.set()

    def find_handler(self, request: HTTPServerRequest, **more: object) -> HTTPMessageDelegate | None:
        """Whoever answers a request."""
        refused = self.access.refusal(request)
        if refused is not None:
            status, said = refused
            return self._first.get_handler_delegate(request, Refused, {"status": status, "said": said})
        asked = request.path.removeprefix(self.access.folder)
        self.asked |= asked == ""
        if asked in INSIDE and self.inside is not None:
            return self.inside.find_handler(request, **more)
        return self._first.find_handler(request, **more)


class Careful(RequestHandler):
    """An answer with the headers of the page, and without a word about this program in an error."""

    def set_default_headers(self) -> None:
        """Headers of every answer."""
        self.clear_header("Server")
        for name, value in CAREFUL.items():
            self.set_header(name, value)


class Refused(Careful):
    """One line that says why."""

    def initialize(self, status: int, said: str) -> None:
        self.status, self.said = status, said

    def prepare(self) -> None:
        """Answer, whatever the method."""
        self.set_status(self.status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{self.said}\n")


class Files(Careful, StaticFileHandler):
    """A file of a library."""


class Frame(Careful):
    """The first page."""

    def initialize(self, frame: str) -> None:
        self.frame = frame

    def get(self) -> None:
        """Answer at once."""
        self.set_header("Cache-Control", "no-store")
        self.finish(self.frame)


class Start(Careful):
    """The script that begins the session of a page; it comes when there is somebody to begin it."""

    def initialize(self, ready: asyncio.Event) -> None:
        self.ready = ready

    async def get(self) -> None:
        """Wait, then send the browser on."""
        await self.ready.wait()
        self.set_header("Cache-Control", "no-store")
        self.redirect(BEGIN)


class Awaited:
    """A text that comes later."""

    def __init__(self) -> None:
        self.text = ""
        self.there = asyncio.Event()

    def come(self, text: str) -> None:
        """Have it."""
        self.text = text
        self.there.set()


class Early(Careful):
    """A part of the first drawing, when it is there."""

    def initialize(self, content: Awaited) -> None:
        self.content = content

    async def get(self) -> None:
        """Wait, then answer."""
        await self.content.there.wait()
        kind = "text/javascript" if self.request.path.endswith(".js") else "application/json"
        self.set_header("Content-Type", f"{kind}; charset=utf-8")
        self.set_header("Cache-Control", "no-store")
        self.finish(self.content.text)


def package_folder(package: str) -> Path:
    """The folder of a package that is not imported yet."""
    found = find_spec(package)
    assert found is not None
    assert found.origin is not None
    return Path(found.origin).parent
