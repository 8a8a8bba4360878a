"""Rows of results, and the operations on them within one transaction."""

from collections.abc import Collection, Iterator
from typing import Any

from sqlalchemy import Connection, bindparam, delete, func, insert, select, update
from sqlalchemy.dialects import postgresql, sqlite

from robosc_server.store.eviction import choose_evicted
from robosc_server.store.records import blocks_of
from robosc_server.store.schema import BLOCKS, JOBS, RESULTS
from robosc_server.tasks.task import Result, TaskKind

# Built once: building a statement takes longer than executing it.
_INSERT = {
    "postgresql": postgresql.insert(RESULTS).on_conflict_do_nothing().returning(RESULTS.c.key),
    "sqlite": sqlite.insert(RESULTS).on_conflict_do_nothing().returning(RESULTS.c.key),
}
_INSERT_BLOCK = insert(BLOCKS)
_KIND = select(RESULTS.c.kind).where(RESULTS.c.key == bindparam("of"))
_BLOCK = select(BLOCKS.c.content).where(BLOCKS.c.key == bindparam("of"), BLOCKS.c.number == bindparam("at"))
_ALL_BLOCKS = select(BLOCKS.c.content).where(BLOCKS.c.key == bindparam("of")).order_by(BLOCKS.c.number)


def insert_result(connection: Connection, key: str, kind: TaskKind, result: Result, owner: str, now_us: int) -> None:
    """Store a result that was made for an owner, unless there is one with this key."""
    size = sum(map(len, result.messages))
    new = {"key": key, "kind": kind, "size": size, "used_us": now_us, "owner": owner}
    # The number of inserted rows would not tell: a driver may not know it, and say -1.
    if connection.scalar(_INSERT[connection.dialect.name], new) is not None:
        for number, block in enumerate(blocks_of(result.messages)):
            connection.execute(_INSERT_BLOCK, {"key": key, "number": number, "content": block})


def count_blocks(connection: Connection, key: str) -> int | None:
    """Return the number of blocks that a result has; None: there is no such result."""
    if connection.scalar(_KIND, {"of": key}) is None:
        return None
    return connection.scalar(select(func.count()).select_from(BLOCKS).where(BLOCKS.c.key == key))


def read_block(connection: Connection, key: str, number: int) -> bytes | None:
    """Return one block of a result; None: there is no such block."""
    content = connection.scalar(_BLOCK, {"of": key, "at": number})
    return None if content is None else bytes(content)


def read_blocks(connection: Connection, key: str) -> tuple[TaskKind, list[bytes]] | None:
    """Return the kind of task of a result, and all its blocks; None: there is no such result."""
    kind = connection.scalar(_KIND, {"of": key})
    if kind is None:
        return None
    return TaskKind(kind), [bytes(content) for content in connection.scalars(_ALL_BLOCKS, {"of": key})]


def touch(connection: Connection, keys: Collection[str], now_us: int) -> None:
    """Record that some results were requested now."""
    names = sorted(keys)  # The same order in each server prevents deadlocks.
    for place in range(0, len(names), 500):
        part = names[place : place + 500]
        connection.execute(update(RESULTS).where(RESULTS.c.key.in_(part)).values(used_us=now_us))


def sizes_by_owner(connection: Connection) -> dict[str, int]:
    """Return the bytes of all results, by the owner for whom each was made first."""
    query = select(RESULTS.c.owner, func.sum(RESULTS.c.size).label("total")).group_by(RESULTS.c.owner)
    return {row.owner: int(row.total) for row in connection.execute(query)}


def trim(connection: Connection, held: dict[str, int], excess: int, limit: int) -> tuple[int, dict[str, int]]:
    """Delete results that no job refers to: each time the least recently used one of the owner with the most bytes.

    Args:
        connection: Connection, in a transaction.
        held: Bytes that each owner holds.
        excess: Number of bytes that are too many.
        limit: Largest number of results.

    Returns:
        Number of deleted results, and the bytes that each owner holds then.
    """

    def oldest(owner: str) -> Iterator[tuple[str, int]]:
        query = select(RESULTS.c.key, RESULTS.c.size).where(RESULTS.c.owner == owner, ~_is_needed())
        query = query.order_by(RESULTS.c.used_us, RESULTS.c.key).limit(limit)
        # One that a job is about to refer to is left alone.
        for row in connection.execute(query.with_for_update(skip_locked=True, of=RESULTS)):
            yield row.key, row.size

    chosen, left = choose_evicted(held, oldest, excess, limit)
    if chosen:
        connection.execute(delete(RESULTS).where(RESULTS.c.key.in_(chosen)))
    return len(chosen), left


def _is_needed() -> Any:
    return select(JOBS.c.id).where(JOBS.c.result_key == RESULTS.c.key).exists()
