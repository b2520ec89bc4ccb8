"""The door: who a request comes from, whether it may ask for this, and whether not too often."""

from __future__ import annotations

from dataclasses import dataclass

from anyio import CapacityLimiter, to_thread
from starlette._utils import get_route_path
from starlette.datastructures import Headers
from starlette.types import Scope as AsgiScope

from service.access.exposure import is_loopback, keys_required
from service.access.keys import KnownKeys
from service.access.principals import ANYBODY, OPERATOR, Principal, Scope
from service.access.rates import Allowance, Rates
from service.settings import Settings
from service.store.keys import KeyStore
from service.wire.refusals import FieldRefusal, NotAllowed, QuotaExceeded, TooManyRequests, Unauthenticated

#: What everybody may read: pages, their files, and what says that and what the server is.
OPEN = frozenset({"/", "/healthz", "/readyz", "/v1/version", "/openapi.json", "/docs", "/redoc", "/favicon.ico"})
OPEN_BELOW = ("/docs-assets/", "/workbench/")
_READING = ("GET", "HEAD", "OPTIONS")
#: What is asked of those who may see everybody's figures.
ADMINISTRATION = frozenset({"/metrics"})


@dataclass(frozen=True)
class Admitted:
    """One who may ask, and what is left of their rate; None where they have none."""

    principal: Principal
    allowance: Allowance | None = None


class Door:
    """What is asked of every request before any route sees it.

    Raises
    ------
    Unauthenticated, NotAllowed, TooManyRequests, StoreUnavailable : from `admit`
    """

    def __init__(self, settings: Settings, keys: KeyStore) -> None:
        self.required = keys_required(settings)
        self._anonymous = OPERATOR if is_loopback(settings.host) else ANYBODY
        self._anonymous_rate = settings.anonymous_requests_per_minute
        self._keys = keys
        self._known = KnownKeys(keys)
        self._rates = Rates()
        # Keys are looked up beside the threads of the routes: these may all be at work.
        self._threads = CapacityLimiter(4)

    async def admit(self, scope: AsgiScope) -> Admitted:
        """Who asks, when they may."""
        path = get_route_path(scope)
        if scope["method"] in _READING and (path in OPEN or path.startswith(OPEN_BELOW)):
            return Admitted(self._anonymous)
        address = (scope.get("client") or ("unknown",))[0]
        token = _shown(Headers(scope=scope))
        if token is None:
            return self._without_key(address)
        principal = await self._with_key(token, address)
        needed: Scope = "read" if scope["method"] in _READING else "write"
        if path in ADMINISTRATION:
            needed = "admin"
        if not principal.may(needed):
            raise NotAllowed(f"this needs a key of scope {needed}; the key shown has scope {principal.scope}")
        if principal.requests_per_minute is None or principal.key_id is None:
            return Admitted(principal)
        return Admitted(principal, _within(self._rates.of_key(principal.key_id, principal.requests_per_minute), "key"))

    def check_room(self, principal: Principal) -> None:
        """Refuse to keep more when the owner has stored what the key allows.

        What begins below the quota is kept, so that the last design may go beyond it.

        Raises
        ------
        QuotaExceeded, StoreUnavailable
        """
        limit = principal.max_stored_bytes
        if limit is not None and (stored := self._keys.stored_bytes(principal.owner)) >= limit:
            detail = f"the designs of this owner have {stored} bytes; the quota max_stored_bytes of the key is {limit}"
            raise QuotaExceeded(detail, FieldRefusal("", f"{stored} bytes are stored", "B", f"< {limit} before more"))

    def _without_key(self, address: str) -> Admitted:
        if self.required:
            raise Unauthenticated("this server asks for a key: Authorization: Bearer gf_<id>_<secret>, or X-API-Key")
        if self._anonymous_rate is None:
            return Admitted(self._anonymous)
        return Admitted(self._anonymous, _within(self._rates.of_address(address, self._anonymous_rate), "address"))

    async def _with_key(self, token: str, address: str) -> Principal:
        principal, was_good = self._known.remembered(token)
        if principal is not None:
            return principal
        if not was_good and (wait := self._rates.wait_for_keys(address)):
            raise TooManyRequests("too many keys of this address opened nothing", wait=wait)
        principal = await to_thread.run_sync(self._known.looked_up, token, limiter=self._threads)
        if principal is None:
            self._rates.wrong_key(address)
            raise Unauthenticated("the key opens nothing: it is unknown, wrong or revoked")
        return principal


def _shown(headers: Headers) -> str | None:
    """The one key that a request shows; None without one.

    Raises
    ------
    Unauthenticated : several that differ
    """
    shown = set(headers.getlist("x-api-key"))
    for value in headers.getlist("authorization"):
        scheme, _, token = value.partition(" ")
        if scheme.lower() == "bearer":
            shown.add(token.strip())
    if len(shown) > 1:
        raise Unauthenticated("the request shows several keys")
    return shown.pop() if shown else None


def _within(allowance: Allowance, whose: str) -> Allowance:
    if not allowance.taken:
        detail = f"more than {allowance.limit} requests in a minute of this {whose}"
        raise TooManyRequests(detail, wait=allowance.wait, allowance=(allowance.limit, allowance.left, allowance.wait))
    return allowance
