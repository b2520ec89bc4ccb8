"""How far a command has come, as a bar on standard error; only where that is a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

#: Told how many pieces are done, and of how many.
Reached = Callable[[int, int], None]


@contextmanager
def bar(words: str) -> Iterator[Reached]:
    """A bar that shows what it is told."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as shown:
        task = shown.add_task(words, total=None)

        def reached(done: int, total: int) -> None:
            shown.update(task, completed=done, total=total)

        yield reached
