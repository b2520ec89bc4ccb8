"""Each operation as a command for a shell, which runs as it stands."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import quote, urlencode


def curl_line(method: str, path: str, operation: dict[str, Any], keys: bool) -> str:
    """The command, a body below it.

    The variable GAINFIELD holds the address of the server, GAINFIELD_KEY the key where one is asked for.
    """
    key = ' -H "Authorization: Bearer $GAINFIELD_KEY"' if keys else ""
    verb = {"get": "", "post": " --json @-", "delete": " -X DELETE"}[method]
    address = f'"$GAINFIELD{_address(path, operation)}"'
    line = f"curl -fsS{key}{verb} {address}"
    if method != "post":
        return line
    examples = operation["requestBody"]["content"]["application/json"]["examples"]
    body = min((json.dumps(one["value"]) for one in examples.values()), key=len)
    if path == "/v1/designs":
        return f'curl -fsS{key} "$GAINFIELD/v1/examples/wind_tunnel" | {line}'
    return f"{line} <<'JSON'\n{body}\nJSON"


def _address(path: str, operation: dict[str, Any]) -> str:
    """Path and query with the examples of the parameters."""
    query = []
    for parameter in operation.get("parameters", []):
        shown = parameter.get("example", next(iter(parameter["schema"].get("examples", [])), None))
        if parameter["in"] == "path":
            path = path.replace(f"{{{parameter['name']}}}", quote(str(shown)))
        elif parameter["in"] == "query" and shown is not None:
            query += [(parameter["name"], one) for one in (shown if isinstance(shown, list) else [shown])]
    return path + (f"?{urlencode(query)}" if query else "")
