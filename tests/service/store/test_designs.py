"""The designs of a store, on SQLite and on PostgreSQL: what is kept, for whom, in which order, for how many at once."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from itertools import chain
from typing import Any

import pytest
from sqlalchemy import text, update

from service.store.designs import StoredDesign
from service.store.store import Store
from service.store.tables import designs
from service.wire.refusals import StoreUnavailable

Made = Callable[..., StoredDesign]
Open = Callable[[], Store]


def at_once(*works: Callable[[], Any]) -> list[Any]:
    """Results of works that begin at the same time; an exception of one of them is its result."""
    results: list[Any] = [None] * len(works)
    begin = threading.Barrier(len(works))

    def run(number: int) -> None:
        begin.wait()
        try:
            results[number] = works[number]()
        except Exception as error:
            results[number] = error

    threads = [threading.Thread(target=run, args=(number,)) for number in range(len(works))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


def test_keeps_bytes_across_a_restart(opened: Open, made: Made) -> None:
    store = opened()
    design = made("a", bytes(range(256)), b"parts")
    assert store.designs.add(design) is design
    assert store.designs.get("b") is None
    store.close()
    assert opened().designs.get("a") == design


def test_the_first_under_an_id_stays(store: Store, made: Made) -> None:
    first = store.designs.add(made("a", b"first"))
    assert store.designs.add(made("a", b"second")) == first
    assert store.designs.get("a") == first


def test_owners_see_their_own_and_one_sees_all_once(store: Store, made: Made) -> None:
    store.designs.add(made("a"), "ann")
    store.designs.add(made("b"), "bob")
    store.designs.add(made("a"), "bob")
    assert store.designs.own("b", "ann") == made("b")
    assert store.designs.own("c", "ann") is None
    assert [d.id for d in store.designs.page(9, owner="ann")] == ["b", "a"]
    assert [d.id for d in store.designs.page(9, owner="bob")] == ["a", "b"]
    assert [d.id for d in store.designs.page(9, owner="cyd")] == []
    assert [d.id for d in store.designs.page(9)] == ["b", "a"]
    assert store.designs.get("a", "cyd") is None
    assert store.designs.get("a", "bob") == made("a")


def test_pages_run_from_new_to_old(store: Store, made: Made) -> None:
    for ident in "abcde":
        for owner in ("ann", "bob"):
            store.designs.add(made(ident), owner)
    for owner in (None, "ann", "bob"):
        first = store.designs.page(2, owner=owner)
        second = store.designs.page(2, before=first[-1].seq, owner=owner)
        assert [d.id for d in first + second] == ["e", "d", "c", "b"]
        assert [d.id for d in store.designs.page(9, before=second[-1].seq, owner=owner)] == ["a"]
        assert store.designs.page(9, before=0, owner=owner) == []


def test_an_owner_lets_go_and_the_last_one_takes_it_along(store: Store, made: Made) -> None:
    store.designs.add(made("a"), "ann")
    store.designs.add(made("a"), "bob")
    assert not store.designs.delete("a", "cyd")
    assert store.designs.delete("a", "ann")
    assert not store.designs.delete("a", "ann")
    assert store.designs.get("a", "ann") is None
    assert store.designs.get("a", "bob") == made("a")
    assert store.designs.delete("a", "bob")
    assert store.designs.get("a") is None
    assert not store.designs.delete("a")
    assert store.designs.page(9) == []


def test_one_who_sees_everything_deletes_for_all(store: Store, made: Made) -> None:
    store.designs.add(made("a"), "ann")
    store.designs.add(made("a"), "bob")
    assert store.designs.delete("a")
    assert store.designs.get("a") is None
    assert store.designs.page(9, owner="ann") == []


def test_posted_again_after_it_was_deleted(store: Store, made: Made, aged: Callable[[Store, float], None]) -> None:
    store.designs.add(made("a", b"same"))
    aged(store, 7200)
    store.designs.delete("a")
    assert list(store.blobs.digests()) == []
    again = made("a", b"same")
    assert store.designs.add(again) is again
    assert store.designs.get("a") == again


def test_a_file_that_two_designs_have_stays_with_the_other(
    store: Store, made: Made, aged: Callable[[Store, float], None]
) -> None:
    store.designs.add(made("a", b"same", b"parts of both"))
    store.designs.add(made("b", b"parts of both", b"same"))
    aged(store, 7200)
    assert store.designs.delete("a")
    assert store.designs.get("b") == made("b", b"parts of both", b"same")


def test_many_threads_at_once(store: Store, made: Made) -> None:
    def work(number: int) -> list[StoredDesign]:
        kept = []
        for k in range(5):
            kept.append(store.designs.add(made(f"shared {k}", str(number).encode())))
            store.designs.add(made(f"own {number} {k}"))
            assert store.designs.get(f"own {number} {k}") is not None
            store.designs.page(3)
        return kept

    kept = list(chain.from_iterable(at_once(*(lambda n=n: work(n) for n in range(8)))))
    assert len(store.designs.page(100)) == 5 + 8 * 5
    for k in range(5):
        assert len({design.answer for design in kept if design.id == f"shared {k}"}) == 1


def test_processes_that_add_the_same_agree_on_one(opened: Open, made: Made) -> None:
    """No error, one is kept, and only who kept it is told that it is new."""
    stores = [opened() for _ in range(4)]
    for k in range(15):
        designs = [made(f"d{k}", f"answer of {n}".encode()) for n in range(4)]
        pairs = list(zip(stores, designs, strict=True))
        results = at_once(*(lambda s=s, d=d: s.designs.add(d, "ann") for s, d in pairs))
        assert len({result.answer for result in results}) == 1, results
        assert sum(result is design for result, design in zip(results, designs, strict=True)) == 1
    assert len(stores[0].designs.page(99, owner="ann")) == 15


def test_who_adds_while_another_deletes_has_it(opened: Open, made: Made) -> None:
    """An acknowledged design is not swept along by a deletion that began before it."""
    one, other = opened(), opened()
    for k in range(25):
        one.designs.add(made(f"d{k}"), "ann")
        added, deleted, owned = at_once(
            lambda k=k: one.designs.add(made(f"d{k}"), "bob"),
            lambda k=k: other.designs.delete(f"d{k}", "ann"),
            lambda k=k: other.designs.own(f"d{k}", "cyd"),
        )
        assert added == made(f"d{k}")
        assert deleted is True
        assert one.designs.get(f"d{k}", "bob") == added
        assert one.designs.get(f"d{k}", "cyd") == owned
    assert one.inspect(thorough=True) == ()


def test_a_failed_write_leaves_the_store_usable(store: Store, made: Made) -> None:
    with pytest.raises(StoreUnavailable):
        store.designs.add(StoredDesign("a", "a", None, "", b"", b""))  # type: ignore[arg-type]
    assert store.designs.get("a") is None
    assert store.designs.add(made("a")).id == "a"


@pytest.mark.parametrize("ident", ["\0", "a\0", "\ud800", "", "x" * 10_000, "'; DROP TABLE designs; --"])
def test_an_id_that_is_none_is_not_there(store: Store, ident: str) -> None:
    assert store.designs.get(ident) is None
    assert store.designs.own(ident, "ann") is None
    assert not store.designs.delete(ident)


def test_any_name_is_kept(store: Store) -> None:
    for number, name in enumerate(("\0", "a\x01\n", "Flügel", "\U0001f6e9", "%s ? :x")):
        store.designs.add(StoredDesign(str(number), name, "", "", b"", b""))
        found = store.designs.get(str(number))
        assert found is not None
        assert found.name == name.replace("\0", "\u2400")


def test_reading_writes_nothing_and_use_is_marked_later(store: Store, made: Made) -> None:
    store.designs.add(made("a"))
    before = time.time() - 1e6
    with store.database.writing() as connection:
        connection.execute(update(designs).values(used_at=before))

    def used_at() -> Any:
        with store.database.reading() as connection:
            return connection.scalar(text("SELECT used_at FROM designs"))

    store.designs.get("a")
    assert used_at() == before
    store.designs.mark_used()
    assert time.time() - used_at() < 60
    store.designs.get("a")
    marked = used_at()
    store.designs.mark_used()
    assert used_at() == marked


def test_posting_again_marks_as_used(store: Store, made: Made) -> None:
    store.designs.add(made("a"))
    with store.database.writing() as connection:
        connection.execute(update(designs).values(used_at=0.0))
    store.designs.add(made("a"))
    with store.database.reading() as connection:
        assert time.time() - connection.scalar(text("SELECT used_at FROM designs")) < 60


def test_lost_parts_do_not_lose_the_design(store: Store, made: Made) -> None:
    store.designs.add(made("a", b"answer", b"parts"))
    (place,) = [store.blobs.place(d) for d in store.blobs.digests() if store.blobs.get(d) == b"parts"]
    place.write_bytes(b"others")
    found = store.designs.get("a")
    assert found is not None
    assert (found.answer, found.parts) == (b"answer", None)
