"""``python -m service``: what ``gainfield serve`` does, with the same options and environment."""

from __future__ import annotations

from service.cli.main import serve_alone

if __name__ == "__main__":
    serve_alone()
