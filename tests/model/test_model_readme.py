"""The model's README names tests and files: they exist."""

import re
from pathlib import Path

README = (Path(__file__).parents[2] / "model" / "README.md").read_text()


def test_every_test_that_is_named_exists():
    tests = Path(__file__).parents[1]
    source = "\n".join(path.read_text() for path in tests.rglob("test_*.py"))
    names = set(re.findall(r"\btest_[a-z0-9_]+\b(?!\.py)", README))
    assert len(names) > 60
    assert [name for name in sorted(names) if f"def {name}(" not in source] == []


def test_every_file_that_is_named_exists():
    root = Path(__file__).parents[2]
    for name in set(re.findall(r"`(tests/[a-z0-9_/]+\.py)", README)):
        assert (root / name).is_file(), name
    for row in re.findall(r"^\| (`[a-z0-9_/]+\.py`.*?) \|", README, re.M):
        folder = ""
        for name in re.findall(r"`([a-z0-9_/]+\.py)`", row):
            folder = name.rsplit("/", 1)[0] + "/" if "/" in name else folder
            assert (root / "model" / (folder + name.rsplit("/", 1)[-1])).is_file(), name
