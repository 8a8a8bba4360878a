"""Rows of servers that share a database.

A server increments its own heartbeat. Another server that finds the same number for the length of a lease, by its own
clock, takes it for dead; so clocks of different machines are never compared (as in leases with a fencing number: C.
Gray and D. Cheriton, "Leases", SOSP 1989, pages 202-210). A server that was taken for dead finds that its row is gone;
its jobs belong to another server then.
"""

from collections.abc import Mapping

from sqlalchemy import Connection, delete, insert, select, update

from robosc_server.store.schema import REPLICAS


def enter(connection: Connection, replica: str) -> None:
    """Add the row of a server, unless it exists."""
    if connection.scalar(select(REPLICAS.c.id).where(REPLICAS.c.id == replica)) is None:
        connection.execute(insert(REPLICAS).values(id=replica, beats=0))


def leave(connection: Connection, replica: str) -> None:
    """Delete the row of a server; its jobs belong to no server then."""
    connection.execute(delete(REPLICAS).where(REPLICAS.c.id == replica))


def beat(connection: Connection, replica: str) -> bool:
    """Increment the heartbeat of a server; False: the server was taken for dead."""
    counted = connection.execute(update(REPLICAS).where(REPLICAS.c.id == replica).values(beats=REPLICAS.c.beats + 1))
    return bool(counted.rowcount)


def beats_of_others(connection: Connection, replica: str) -> dict[str, int]:
    """Return the number of beats that each other server has counted."""
    rows = connection.execute(select(REPLICAS).where(REPLICAS.c.id != replica))
    return {row.id: row.beats for row in rows}


def remove_dead(connection: Connection, dead: Mapping[str, int]) -> None:
    """Delete the rows of servers whose heartbeats are still the given ones; their jobs belong to no server then."""
    for name, beats in dead.items():
        connection.execute(delete(REPLICAS).where(REPLICAS.c.id == name, REPLICAS.c.beats == beats))


def remove_others(connection: Connection, ours: str) -> None:
    """Delete the rows of all other servers; their jobs belong to no server then."""
    connection.execute(delete(REPLICAS).where(REPLICAS.c.id != ours))
