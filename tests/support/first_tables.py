"""Tables of the server's first version, and what becomes of them."""

import asyncio

import sqlalchemy

from robosc_server.store import JobState, Store
from robosc_server.tasks.task import Result, TaskKind

# As the first version made them.
TABLES = """
CREATE TABLE robosc_schema (version INTEGER NOT NULL);
CREATE TABLE replicas (id TEXT NOT NULL, beats BIGINT NOT NULL, PRIMARY KEY (id));
CREATE TABLE results (
    key TEXT NOT NULL, kind TEXT NOT NULL, size BIGINT NOT NULL, used_us BIGINT NOT NULL, PRIMARY KEY (key)
);
CREATE INDEX results_used ON results (used_us);
CREATE TABLE result_blocks (
    key TEXT NOT NULL, number INTEGER NOT NULL, content BLOB NOT NULL, PRIMARY KEY (key, number),
    FOREIGN KEY (key) REFERENCES results (key) ON DELETE CASCADE
);
CREATE TABLE jobs (
    id TEXT NOT NULL, owner TEXT NOT NULL, kind TEXT NOT NULL, state TEXT NOT NULL, revision BIGINT NOT NULL,
    key TEXT NOT NULL, main_file TEXT NOT NULL, label TEXT NOT NULL, idempotency_key TEXT, retention_us BIGINT NOT NULL,
    created_us BIGINT NOT NULL, started_us BIGINT, ended_us BIGINT, expires_us BIGINT, attempts INTEGER NOT NULL,
    stage TEXT, progress TEXT, reason TEXT, message TEXT, is_from_store BOOLEAN NOT NULL, replica TEXT, result_key TEXT,
    PRIMARY KEY (id), CONSTRAINT jobs_idempotency UNIQUE (owner, idempotency_key),
    FOREIGN KEY (result_key) REFERENCES results (key)
);
CREATE INDEX jobs_all_listed ON jobs (created_us, id);
CREATE INDEX jobs_listed ON jobs (owner, created_us, id);
CREATE INDEX jobs_active ON jobs (state, replica);
CREATE INDEX jobs_expiring ON jobs (expires_us);
CREATE INDEX jobs_results ON jobs (result_key);
CREATE TABLE job_requests (
    job TEXT NOT NULL, content BLOB NOT NULL, PRIMARY KEY (job),
    FOREIGN KEY (job) REFERENCES jobs (id) ON DELETE CASCADE
);
INSERT INTO robosc_schema VALUES (1);
INSERT INTO results VALUES ('k', 'check', 5, 1), ('l', 'check', 3, 2);
INSERT INTO result_blocks VALUES ('k', 0, 'BLOCK');
INSERT INTO jobs VALUES ('done', 'me', 'check', 'succeeded', 7, 'k', 'main', '', NULL, 1000, 1, 2, 3,
    9000000000000000, 1, NULL, NULL, NULL, NULL, false, NULL, 'k');
INSERT INTO jobs VALUES ('waits', 'me', 'check', 'queued', 1, 'm', 'main', '', 'i', 1000, 2, NULL, NULL, NULL, 0, NULL,
    NULL, NULL, NULL, false, 'somebody', NULL);
"""


def check(store: Store) -> None:
    """See that all is there, and that what is new works."""

    async def test() -> None:
        done = await store.find("done")
        assert done is not None and (done.state, done.result_key, done.losses) == (JobState.SUCCEEDED, "k", 0)
        assert await store.find_result("k") == (TaskKind.CHECK, Result((b"",)))
        waits = await store.find_by_key("me", "i")
        assert waits is not None and waits.id == "waits"
        owners = await store._database.read(lambda connection: connection.execute(OWNERS).all())
        assert {row.key: row.owner for row in owners} == {"k": "me", "l": ""}
        await store.keep_results([("new", TaskKind.CHECK, Result((b"x",)), "you")])
        # A server of the first version may go on for a while.
        await store._database.write(lambda connection: connection.execute(OLD_INSERT) and None)
        await store.sweep(6)
        assert await store.find_result("k") is not None

    asyncio.run(test())


OWNERS = sqlalchemy.text("SELECT key, owner FROM results")

OLD_INSERT = sqlalchemy.text("INSERT INTO results (key, kind, size, used_us) VALUES ('old', 'check', 1, 1)")
