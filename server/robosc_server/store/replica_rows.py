"""Rows of servers that share a database.

A server counts up its own beats. Another one that finds the same number for as long as a lease, by its own clock, takes
it for dead; so no two clocks are compared (as in leases with a fencing number: C. Gray and D. Cheriton, "Leases", SOSP
1989, pages 202-210). A server that was taken for dead finds no row of its own any more, and its jobs are another's.
"""

from collections.abc import Mapping

from sqlalchemy import Connection, delete, insert, select, update

from robosc_server.store.schema import REPLICAS


def enter(connection: Connection, replica: str) -> None:
    """Tell that a server is there; it may have been told."""
    if connection.scalar(select(REPLICAS.c.id).where(REPLICAS.c.id == replica)) is None:
        connection.execute(insert(REPLICAS).values(id=replica, beats=0))


def leave(connection: Connection, replica: str) -> None:
    """Tell that a server is gone, and has left its jobs to others."""
    connection.execute(delete(REPLICAS).where(REPLICAS.c.id == replica))


def beat(connection: Connection, replica: str) -> bool:
    """Count up; False: the server was taken for dead."""
    counted = connection.execute(update(REPLICAS).where(REPLICAS.c.id == replica).values(beats=REPLICAS.c.beats + 1))
    return bool(counted.rowcount)


def beats_of_others(connection: Connection, replica: str) -> dict[str, int]:
    """Return the number of beats that each other server has counted."""
    rows = connection.execute(select(REPLICAS).where(REPLICAS.c.id != replica))
    return {row.id: row.beats for row in rows}


def remove_dead(connection: Connection, dead: Mapping[str, int]) -> None:
    """Tell that servers are gone that have not counted on from the numbers given; their jobs are nobody's then."""
    for name, beats in dead.items():
        connection.execute(delete(REPLICAS).where(REPLICAS.c.id == name, REPLICAS.c.beats == beats))


def remove_others(connection: Connection, ours: str) -> None:
    """Tell that there is no other server; all jobs but ours are nobody's then."""
    connection.execute(delete(REPLICAS).where(REPLICAS.c.id != ours))
