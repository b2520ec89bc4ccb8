"""Kept results as bytes: exact, the same every time, no pickle, and damage is seen."""

import base64
import io
import json
import pickle
import subprocess
import sys
from dataclasses import dataclass, replace
from hashlib import sha256

import numpy as np
import pytest

from design.classical.infeasibility import Infeasibility
from design.outcome import Outcome, Outcomes
from design.specs import Spec
from model.arrays import FloatArray, GridArrays
from schedules.digests import digest_of, study_digest
from schedules.exact_bytes import read, written
from schedules.parts import Synthesised, parts, synthesise


@dataclass(frozen=True, eq=False)
class Kept(GridArrays):
    numbers: FloatArray
    same: FloatArray
    poles: np.ndarray
    flags: np.ndarray
    counts: np.ndarray
    outcomes: Outcomes
    words: tuple
    size: float
    mode: complex


KINDS = (Kept, Outcomes)
#: Numbers that texts and careless comparisons lose.
HARD = np.array([0.0, -0.0, np.nan, np.inf, -np.inf, 5e-324, 0.1, 1.0 + 2**-52, -np.pi])


def _kept(**changes):
    payload_nan = np.frombuffer(b"\x01\x00\x00\x00\x00\x00\xf8\xff")  # a nan of its own
    numbers = np.concatenate([HARD, payload_nan])
    outcomes = Outcomes.all_ok((3,)).failing(
        np.array([False, True, False]), Outcome.INFEASIBLE, lambda _: "reason with \N{ROCKET}, \x00, and \udc80"
    )
    made = Kept(
        numbers, numbers.copy(), np.array([complex(np.nan, -0.0), 1j]), np.array([[True, False]]),
        np.array([], dtype=np.int64), outcomes, ("a", 1, None, True, (0.1, np.nan)), float("inf"), complex(-0.0, 2.5),
    )  # fmt: skip
    return replace(made, **changes)


def test_comes_back_to_the_last_bit():
    kept = _kept()
    back = read(written(kept), KINDS)
    for name in ("numbers", "same", "poles", "flags", "counts"):
        one, other = getattr(back, name), getattr(kept, name)
        assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
        assert not one.flags.writeable
    assert back.outcomes.codes.tolist() == kept.outcomes.codes.tolist()
    assert all(isinstance(code, Outcome) for code in back.outcomes.codes)
    assert back.outcomes.reasons.tolist() == kept.outcomes.reasons.tolist()
    assert back.words[:4] == kept.words[:4]
    assert np.isnan(back.words[4][1])
    assert (back.size, back.mode) == (np.inf, kept.mode)
    assert np.signbit(back.mode.real)
    assert written(back) == written(kept)


def test_every_bit_counts():
    contents = {written(_kept())}
    for change in ({"numbers": -HARD}, {"size": np.nextafter(1.0, 2.0)}, {"size": 1.0}, {"words": ("a",)}):
        contents.add(written(_kept(**change)))
    assert len(contents) == 5


def test_equal_arrays_are_written_once():
    wide = np.random.default_rng(0).standard_normal(10_000)
    both = len(written(_kept(numbers=wide, same=wide.copy())))
    assert both < 1.2 * wide.nbytes
    assert len(written(_kept(numbers=wide, same=wide[::-1]))) > 2.0 * wide.nbytes


@pytest.fixture(scope="module")
def study(wind_tunnel_study):
    """Of a controller with gains at some points and reasons at the others."""
    specs = (Spec("damping_ratio", "min", np.linspace(0.4, 0.99, 8).reshape(2, 4)),)
    return replace(wind_tunnel_study, controllers=(replace(wind_tunnel_study.controllers[1], specs=specs),))


@pytest.fixture(scope="module")
def synthesised(study):
    """Its only part."""
    found = synthesise(study, parts(study)[0])
    assert 0 < found.design.outcomes.ok.sum() < 8
    return found


def test_a_synthesis_comes_back_with_its_reasons(synthesised):
    content = synthesised.to_bytes()
    back = Synthesised.from_bytes(content)
    assert back.to_bytes() == content
    assert (back.part, back.study) == (synthesised.part, synthesised.study)
    lost = np.flatnonzero(~back.design.outcomes.ok)
    assert back.design.outcomes.reasons.tolist() == synthesised.design.outcomes.reasons.tolist()
    for i in lost:
        assert isinstance(back.design.infeasibility[i], Infeasibility)
        assert back.design.infeasibility[i].describe() == synthesised.design.infeasibility[i].describe()


def test_the_same_bytes_in_another_process_at_another_time(study, synthesised):
    program = (
        "import sys, pickle, base64\n"
        "from schedules.parts import parts, synthesise\n"
        "study = pickle.loads(base64.b64decode(sys.stdin.read()))\n"
        "sys.stdout.buffer.write(synthesise(study, parts(study)[0]).to_bytes())\n"
    )
    sent = base64.b64encode(pickle.dumps(study))
    done = subprocess.run([sys.executable, "-c", program], input=sent, capture_output=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr.decode()
    assert done.stdout == synthesised.to_bytes()


def test_damage_is_seen(synthesised):
    content = synthesised.to_bytes()
    rng = np.random.default_rng(1)
    for place in [0, 31, 32, 33, len(content) - 1, *rng.integers(0, len(content), 40)]:
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(rng.integers(8))
        with pytest.raises(ValueError, match="damaged"):
            Synthesised.from_bytes(bytes(damaged))
    for length in (0, 5, 32, 100, len(content) // 2, len(content) - 1):
        with pytest.raises(ValueError, match="damaged"):
            Synthesised.from_bytes(content[:length])
    with pytest.raises(ValueError, match="damaged"):
        Synthesised.from_bytes(content + b"\0")


def _signed(archived):
    return sha256(archived).digest() + archived


def _archive(words, **arrays):
    content = io.BytesIO()
    np.savez(content, words=np.array(words), **arrays)
    return content.getvalue()


def _said(value, layout="gainfield 1"):
    return json.dumps({"layout": layout, "value": value})


@pytest.mark.parametrize(
    "archived",
    [
        b"",
        b"no archive",
        b"PK\x03\x04" + bytes(100),
        _archive("not json"),
        _archive("[" * 100_000),
        _archive(json.dumps([1, 2])),
        _archive(_said(None)),
        _archive(_said(None, "gainfield 2")),
        _archive(_said({"array": 3})),
        _archive(_said({"array": 0}), **{"0": np.array([1.0])}),
        _archive(_said({"outcome": "splendid"})),
        _archive(_said({"kind": "Popen", "of": {"args": "true"}})),
        _archive(_said({"kind": "Part", "of": {"controller": "nf", "start": 0}})),
        _archive(_said({"kind": "Part", "of": {"controller": "nf", "start": 3, "stop": 1}})),
        _archive(_said({"kind": "Synthesised", "of": {"part": 1, "study": "", "design": 2}})),
        _archive(_said({"objects": [1, 2, 3], "shape": [2]})),
        _archive(_said({"something": "else"})),
    ],
)
def test_bytes_of_something_else_are_refused_even_with_their_digest(archived):
    with pytest.raises(ValueError, match="not a"):
        Synthesised.from_bytes(_signed(archived))


def test_no_pickle_is_read():
    content = io.BytesIO()
    np.savez(content, words=np.array([{"layout": "gainfield 1"}], dtype=object))
    with pytest.raises(ValueError, match="not a kept result"):
        read(_signed(content.getvalue()), KINDS)


def test_what_cannot_be_kept_is_said():
    for wrong in ({"a": 1}, [1], b"bytes", object(), Kept):
        with pytest.raises(TypeError, match="cannot be kept"):
            written(_kept(words=(wrong,)))
    with pytest.raises(ValueError, match="not a kept result"):
        read(written(_kept()), (Outcomes,))


# Digests.


def test_digests_tell_apart_what_is_not_the_same():
    values = [
        (), ((),), (None,), ("",), ("None",), (0,), (0.0,), (-0.0,), (np.nan,), (False,), ("a", "b"), ("ab",),
        (("a",), "b"), (("a", "b"),), (np.array([1.0]),), (np.array([[1.0]]),), (np.array([1]),), ({"a": 1},),
        ({"a": "1"},), ({"b": 1},), (Spec("overshoot", "max", 0.1),), (Spec("overshoot", "max", 0.2),),
    ]  # fmt: skip
    assert len({digest_of(*value) for value in values}) == len(values)
    assert digest_of({"a": 1, "b": 2}) == digest_of({"b": 2, "a": 1})
    assert digest_of(np.nan) == digest_of(float("nan"))
    for wrong in (object(), {1, 2}, np.array([object()]), digest_of):
        with pytest.raises(TypeError, match="has no digest"):
            digest_of(wrong)


def test_equal_studies_made_twice_have_equal_digests(wind_tunnel_study):
    nf = wind_tunnel_study.controllers[0]
    limit = np.linspace(0.3, 0.5, 8).reshape(2, 4)

    def varying():
        return replace(nf, specs=(Spec("damping_ratio", "min", limit.copy()),))

    assert study_digest(wind_tunnel_study, varying()) == study_digest(replace(wind_tunnel_study, name="b"), varying())
    assert study_digest(wind_tunnel_study, varying()) != study_digest(wind_tunnel_study, nf)
