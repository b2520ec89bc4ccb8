"""The image and the Compose files, as far as they can be checked without an engine: what they name exists."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from fnmatch import fnmatch
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import pytest
import yaml

from service.access.exposure import keys_required
from service.cli.chosen_settings import SECRETS_DIR
from service.jobs.jobs import check_workers
from service.settings import Settings
from tests.service.cli.test_command import taken_by_the_command

ROOT = Path(__file__).resolve().parents[1]
DEPLOY = ROOT / "service" / "deploy"
TEXT = (ROOT / "Dockerfile").read_text()
#: Instructions of the Dockerfile, continued lines as one, comments left out.
LINES = [
    tuple(line.split(None, 1))
    for line in re.sub(r"\\\n\s*", " ", re.sub(r"(?m)^#.*\n", "", TEXT)).splitlines()
    if line.strip()
]


def _all(instruction: str) -> list[str]:
    return [rest for name, rest in LINES if name == instruction]


def _image_environment() -> dict[str, str]:
    return dict(word.split("=", 1) for line in _all("ENV") for word in shlex.split(line))


def _settings(environment: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Settings:
    """The settings of a container; every variable of ours must be one of them."""
    for name in [name for name in os.environ if name.startswith("GAINFIELD_")]:
        monkeypatch.delenv(name)
    for name, value in environment.items():
        if name.startswith("GAINFIELD_") and name != SECRETS_DIR:
            assert name.removeprefix("GAINFIELD_").lower() in Settings.model_fields, name
            monkeypatch.setenv(name, value)
    monkeypatch.setenv("GAINFIELD_DATA_DIR", str(tmp_path))
    return Settings()


def _left_out(path: str) -> bool:
    """Whether .dockerignore keeps a path out of the build: the last pattern that fits it, or what holds it, decides."""
    out = False
    parents = ["/".join(path.split("/")[: n + 1]) for n in range(path.count("/") + 1)]
    for line in (ROOT / ".dockerignore").read_text().splitlines():
        pattern = line.removeprefix("!").removeprefix("**/")
        if (
            line
            and not line.startswith("#")
            and any(fnmatch(one, pattern) or fnmatch(one.rpartition("/")[2], pattern) for one in parents)
        ):
            out = not line.startswith("!")
    return out


def test_what_the_image_copies_is_there_and_all_that_it_needs() -> None:
    copied = [shlex.split(line) for line in _all("COPY") if not line.startswith("--from")]
    sources = [source for words in copied for source in words[:-1]]
    for source in sources:
        assert (ROOT / source).exists(), source
        assert not _left_out(source), source
        assert ".." not in source
    packages = re.search(r"packages = \[(.*?)\]", (ROOT / "pyproject.toml").read_text())
    assert packages is not None
    assert set(json.loads(f"[{packages[1]}]")) <= set(sources)
    for secret in ("service/deploy/secrets/postgres_password", "data/gainfield.db", ".git/config", ".venv/bin/python"):
        assert _left_out(secret), secret
    assert not _left_out("service/store/store.py")


def test_the_image_runs_as_nobody_in_particular(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(_all("FROM")) == 2
    assert _all("USER") == ["10001:10001"]
    instructions = [name for name, _ in LINES]
    assert "RUN" not in instructions[instructions.index("USER") :]
    environment = _image_environment()
    assert [environment[f"{name}_NUM_THREADS"] for name in ("OPENBLAS", "OMP", "MKL")] == ["1", "1", "1"]
    settings = _settings(environment, tmp_path, monkeypatch)
    assert keys_required(settings)
    assert environment["GAINFIELD_DATA_DIR"] == _all("VOLUME")[0] == _all("WORKDIR")[1]
    assert str(settings.port) == _all("EXPOSE")[0]


def test_the_image_installs_extras_that_exist() -> None:
    (install,) = [line for line in _all("RUN") if "pip install" in line]
    project = (ROOT / "pyproject.toml").read_text()
    extras = re.search(r"'\.\[(.*?)\]'", install)
    assert extras is not None
    for extra in extras[1].split(","):
        assert re.search(rf"(?m)^{extra} = \[", project), extra
    assert {"dask", "postgres"} <= set(extras[1].split(","))
    constraints = install.split("--constraint ")[1].split()[0]
    assert (ROOT / constraints).is_file()


def test_the_image_runs_our_command() -> None:
    (command,) = _all("CMD")
    _is_ours(json.loads(command))


def test_the_image_is_healthy_when_the_service_is(running_service: str) -> None:
    (check,) = _all("HEALTHCHECK")
    words = json.loads(check.partition("CMD ")[2])
    assert words[0] == "python"
    for port, healthy in ((running_service.rpartition(":")[2], True), ("1", False)):
        ended = subprocess.run(
            [sys.executable, *words[1:]], env=os.environ | {"GAINFIELD_PORT": port}, capture_output=True, timeout=30
        )
        assert (ended.returncode == 0) is healthy


def _is_ours(words: list[str]) -> None:
    """A command of ours, or of Dask, with options that it has."""
    if words[0] == "gainfield":
        taken_by_the_command(words)
        return
    assert words[0] == "dask"
    (found,) = [point for point in entry_points(group="dask_cli") if point.name == words[1]]
    known = {option for parameter in found.load().params for option in (*parameter.opts, *parameter.secondary_opts)}
    for word in words[2:]:
        assert not word.startswith("--") or word in known, word


def _merged(*names: str) -> dict[str, Any]:
    """Compose files over each other: mappings and lists of secrets grow, all else is replaced."""

    def over(below: Any, above: Any) -> Any:
        if isinstance(below, dict) and isinstance(above, dict):
            return below | {key: over(below.get(key), value) for key, value in above.items()}
        if isinstance(below, list) and above and all(str(one).endswith(".pem") for one in above):
            return below + above
        return above

    document: dict[str, Any] = {}
    for name in names:
        document = over(document, yaml.safe_load((DEPLOY / name).read_text()))
    return document


@pytest.fixture(params=[("compose.yaml",), ("compose.yaml", "compose.tls.yaml")], ids=["internal", "tls"])
def compose(request: pytest.FixtureRequest) -> dict[str, Any]:
    return _merged(*request.param)


def test_what_compose_names_is_declared(compose: dict[str, Any]) -> None:
    for name, service in compose["services"].items():
        assert set(service["networks"]) <= set(compose["networks"]), name
        assert set(service.get("secrets", ())) <= set(compose["secrets"]), name
        assert set(service.get("depends_on", {})) <= set(compose["services"]), name
        for volume in service.get("volumes", ()):
            assert volume.partition(":")[0] in compose["volumes"], name
        for path in re.findall(
            r"/run/secrets/(\S+?)(?:['\",\]]|$)", json.dumps([service.get("command"), service.get("environment")])
        ):
            assert path in service["secrets"], path
        assert "healthcheck" in service, name
        if name != "database":
            _is_ours(service["command"])
            assert service["read_only"]
            assert service["cap_drop"] == ["ALL"]
            assert "/tmp" in service["tmpfs"]
            assert (DEPLOY / service["build"]["context"] / "Dockerfile").resolve() == ROOT / "Dockerfile"
    for secret in compose["secrets"].values():
        assert secret["file"].startswith("./secrets/")
    assert "secrets/" in (DEPLOY / ".gitignore").read_text().splitlines()


def test_settings_of_compose_are_taken(
    compose: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("service", "migrate"):
        environment = compose["services"][name]["environment"]
        settings = _settings(_image_environment() | environment, tmp_path, monkeypatch)
        check_workers(settings)
        assert keys_required(settings)
        assert environment[SECRETS_DIR] == "/run/secrets"
        assert "gainfield_database_url" in compose["services"][name]["secrets"]
    assert "database_url" in Settings.model_fields


def test_nobody_but_its_own_reaches_the_database_or_the_scheduler(compose: dict[str, Any]) -> None:
    services = compose["services"]
    on = {
        network: {name for name, one in services.items() if network in one["networks"]}
        for network in compose["networks"]
    }
    assert compose["networks"]["compute"]["internal"]
    assert compose["networks"]["store"]["internal"]
    assert on["compute"] == {"service", "scheduler", "worker"}
    assert on["store"] == {"service", "migrate", "database"}
    assert [name for name, one in services.items() if "ports" in one] == ["service"]
    assert all(port.startswith("127.0.0.1:") for port in services["service"]["ports"])


def test_tables_are_migrated_before_the_service_starts(compose: dict[str, Any]) -> None:
    services = compose["services"]
    assert services["migrate"]["command"] == ["gainfield", "migrate"]
    assert services["migrate"]["depends_on"]["database"]["condition"] == "service_healthy"
    waits = {name: one["condition"] for name, one in services["service"]["depends_on"].items()}
    assert waits == {
        "database": "service_healthy", "migrate": "service_completed_successfully", "scheduler": "service_healthy",
    }  # fmt: skip


def test_with_tls_nothing_is_insecure() -> None:
    services = _merged("compose.yaml", "compose.tls.yaml")["services"]
    assert services["service"]["environment"]["GAINFIELD_DASK_ALLOW_INSECURE"] == "false"
    assert services["service"]["environment"]["GAINFIELD_DASK"].startswith("tls://")
    for name in ("scheduler", "worker"):
        assert "tcp://" not in json.dumps(services[name]["command"])
        assert {"--tls-ca-file", "--tls-cert", "--tls-key"} <= set(services[name]["command"])


def test_the_health_of_the_composed_service_is_its_readiness(running_service: str) -> None:
    command = _merged("compose.yaml")["services"]["service"]["healthcheck"]["test"]
    assert command[:2] == ["CMD", "python"]
    port = running_service.rpartition(":")[2]
    code = [word.replace("127.0.0.1:8000", f"127.0.0.1:{port}") for word in command[2:]]
    assert subprocess.run([sys.executable, *code], capture_output=True, timeout=30).returncode == 0
