"""``python -m service``: serve the API. Options override the ``GAINFIELD_*`` environment, which overrides defaults."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

#: On small matrices more BLAS threads are several times slower; numpy reads these when it is imported.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

#: How long open answers, streams of events among them, may go on when the server is told to stop [s].
GRACE = 3


def arguments() -> dict[str, object]:
    """The options that were given, by the name of their setting."""
    parser = argparse.ArgumentParser(prog="python -m service", description="Serve the Gainfield API.")
    parser.add_argument("--host", help="address to listen on (default 127.0.0.1)")
    parser.add_argument("--port", type=int, help="port to listen on (default 8000)")
    parser.add_argument("--data-dir", type=Path, help="directory of the design store (default data)")
    return {name: value for name, value in vars(parser.parse_args()).items() if value is not None}


def main() -> None:
    """Serve until interrupted."""
    given = arguments()
    import uvicorn
    from pydantic import ValidationError

    from model.memory import keep_freed_memory
    from service.app import create_app
    from service.settings import Settings

    try:
        settings = Settings(**given)  # type: ignore[arg-type]
    except ValidationError as error:
        wrong = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())
        raise SystemExit(f"settings: {wrong}") from None
    keep_freed_memory()
    uvicorn.run(
        create_app(settings),
        host=settings.host,
        port=settings.port,
        server_header=False,
        timeout_graceful_shutdown=GRACE,
    )


if __name__ == "__main__":
    main()
