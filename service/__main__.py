"""``python -m service``: serve the API. Options override the ``GAINFIELD_*`` environment, which overrides defaults."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

#: On small matrices more BLAS threads are several times slower; numpy reads these when it is imported.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")


def arguments() -> dict[str, object]:
    """The options that were given, by the name of their setting."""
    parser = argparse.ArgumentParser(prog="python -m service", description="Serve the Gainfield API.")
    parser.add_argument("--host", help="address to listen on (default 127.0.0.1)")
    parser.add_argument("--port", type=int, help="port to listen on (default 8000)")
    parser.add_argument("--data-dir", type=Path, help="directory of the design store (default data)")
    parser.add_argument("--workers", type=int, help="server processes (default 1)")
    return {name: value for name, value in vars(parser.parse_args()).items() if value is not None}


def main() -> None:
    """Serve until interrupted."""
    given = arguments()
    from pydantic import ValidationError

    from service.access.exposure import Exposed
    from service.refusals import StoreUnavailable
    from service.server import serve
    from service.settings import Settings

    try:
        settings = Settings(**given)  # type: ignore[arg-type]
    except ValidationError as error:
        wrong = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())
        raise SystemExit(f"settings: {wrong}") from None
    try:
        serve(settings)
    except (Exposed, StoreUnavailable, ValueError) as refused:
        raise SystemExit(f"gainfield: {refused}") from None


if __name__ == "__main__":
    main()
