"""Who may talk to the studio: the token, the Host and Origin of a request, and what every answer tells the browser."""

from __future__ import annotations

import hmac
import secrets

from tornado.web import HTTPError, RequestHandler

from splinefeed.studio.house import House

#: Names that the loopback interface goes by.
HOSTS = ("127.0.0.1", "localhost")


class Guard:
    """The token of this server, and the checks of a request.

    token  stands in the address that the user opens; the page gets a cookie in its place, which no other site's
           requests carry (SameSite=Strict)
    """

    def __init__(self, port: int) -> None:
        self.token = secrets.token_urlsafe(24)
        self._cookie = secrets.token_urlsafe(24)
        self.port = port
        self.cookie_name = f"splinefeed-{port}"  # cookies do not know ports

    @property
    def address(self) -> str:
        """What the user opens."""
        return f"http://127.0.0.1:{self.port}/?token={self.token}"

    def check(self, handler: RequestHandler, *, entrance: bool = False) -> None:
        """Raise HTTPError for a request that is not from our page; entrance: the token may stand in for the cookie."""
        request = handler.request
        if request.host not in {f"{host}:{self.port}" for host in HOSTS}:
            raise HTTPError(421, reason="this server answers to 127.0.0.1 and localhost only")  # DNS rebinding
        origin = request.headers.get("Origin")
        if origin is not None and origin != f"http://{request.host}":
            raise HTTPError(403, reason="the request is from another site")
        if request.headers.get("Sec-Fetch-Site") == "cross-site" and not entrance:
            raise HTTPError(403, reason="the request is from another site")
        if origin is None and (request.method != "GET" or request.headers.get("Upgrade")):
            raise HTTPError(403, reason="the request does not say where it is from")
        if _same(handler.get_cookie(self.cookie_name) or "", self._cookie):
            return
        if entrance and _same(handler.get_query_argument("token", ""), self.token):
            handler.set_cookie(self.cookie_name, self._cookie, path="/", httponly=True, samesite="Strict")
            return
        raise HTTPError(403, reason="the token is missing or wrong: open the address that splinefeed studio printed")


class Guarded(RequestHandler):
    """What all our handlers share: the guard before anything else, and headers that keep the browser to our files."""

    guard: Guard
    house: House
    entrance = False

    def initialize(self, guard: Guard, house: House) -> None:
        """Take the parts of the studio."""
        self.guard, self.house = guard, house

    def set_default_headers(self) -> None:
        """Headers of every answer."""
        for name, value in headers(self.application.settings["port"]).items():
            self.set_header(name, value)

    def prepare(self) -> None:
        """Check who asks."""
        self.guard.check(self, entrance=self.entrance)


def _same(given: str, expected: str) -> bool:
    return hmac.compare_digest(given.encode(errors="replace"), expected.encode())


def headers(port: int) -> dict[str, str]:
    """What every answer carries: no script, style, picture or connection but ours, no frame, nothing kept.

    Inline styles are allowed, which Plotly sets on its axes and brings for its maps; the page itself writes no HTML.
    """
    sockets = " ".join(f"ws://{host}:{port}" for host in HOSTS)
    policy = (
        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
        f"connect-src 'self' {sockets}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return {
        "Content-Security-Policy": policy,
        "X-Content-Type-Options": "nosniff",
        "X-Frame-Options": "DENY",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Cache-Control": "no-store",
        "Server": "splinefeed",
    }
