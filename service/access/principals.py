"""Who asks: the owner of what is posted, what is seen, and how much is allowed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from service.store.designs import LOCAL

Scope = Literal["read", "write", "admin"]
#: Scopes from the least to the most; each holds those before it.
SCOPES: tuple[Scope, ...] = ("read", "write", "admin")


@dataclass(frozen=True)
class Principal:
    """One who asks.

    Attributes
    ----------
    owner : whose designs are posted and seen
    scope : ``read``: GET; ``write``: everything that computes or keeps something; ``admin``: everybody's designs
    key_id : of the key that was shown; None without one
    requests_per_minute : None is as many as there are
    max_stored_bytes : of the owner's designs; None is as many as there are
    """

    owner: str
    scope: Scope
    key_id: str | None = None
    requests_per_minute: int | None = None
    max_stored_bytes: int | None = None

    @property
    def sees(self) -> str | None:
        """Whose designs are seen; None is everybody's."""
        return None if self.scope == "admin" else self.owner

    def may(self, needed: Scope) -> bool:
        """Whether the scope holds the one that is needed."""
        return SCOPES.index(self.scope) >= SCOPES.index(needed)


#: Who asks where no keys are asked for on this machine: its own user.
OPERATOR = Principal(LOCAL, "admin")
#: Who asks without a key where anybody may.
ANYBODY = Principal(LOCAL, "write")
