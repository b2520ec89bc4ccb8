"""Settings by option, environment and file of secrets, in this order; what none of them names has its default."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.refusing import Refused

if TYPE_CHECKING:
    from service.settings import Settings

#: Names a directory that holds settings as files, each called like its variable in small letters.
SECRETS_DIR = "GAINFIELD_SECRETS_DIR"


def chosen_settings(**given: object) -> Settings:
    """The settings, those that are not None by option.

    Raises
    ------
    Refused : one has a value that it does not take, or there is no directory of secrets where one is named
    """
    from pydantic import ValidationError

    from service.settings import Settings

    options: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    secrets = os.environ.get(SECRETS_DIR)
    if secrets is not None and not Path(secrets).is_dir():
        raise Refused("settings", f"{SECRETS_DIR}: there is no directory {secrets}")
    try:
        return Settings(**(options | {"_secrets_dir": secrets}))
    except ValidationError as error:
        wrong = [(".".join(map(str, one["loc"])), one["msg"]) for one in error.errors()]
        raise Refused("settings", "; ".join(f"{name}: {why}" for name, why in wrong)) from None
