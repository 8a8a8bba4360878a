-- Schema version 1 in SQLite, as servers of that version made it, with jobs and results.
-- Never changed: databases like it exist.

CREATE TABLE robosc_schema (
    version INTEGER NOT NULL
);
CREATE TABLE replicas (
    id TEXT NOT NULL,
    beats BIGINT NOT NULL,
    PRIMARY KEY (id)
);
CREATE TABLE results (
    "key" TEXT NOT NULL,
    kind TEXT NOT NULL,
    size BIGINT NOT NULL,
    used_us BIGINT NOT NULL,
    PRIMARY KEY ("key")
);
CREATE INDEX results_used ON results (used_us);
CREATE TABLE result_blocks (
    "key" TEXT NOT NULL,
    number INTEGER NOT NULL,
    content BLOB NOT NULL,
    PRIMARY KEY ("key", number),
    FOREIGN KEY("key") REFERENCES results ("key") ON DELETE CASCADE
);
CREATE TABLE jobs (
    id TEXT NOT NULL,
    owner TEXT NOT NULL,
    kind TEXT NOT NULL,
    state TEXT NOT NULL,
    revision BIGINT NOT NULL,
    "key" TEXT NOT NULL,
    main_file TEXT NOT NULL,
    label TEXT NOT NULL,
    idempotency_key TEXT,
    retention_us BIGINT NOT NULL,
    created_us BIGINT NOT NULL,
    started_us BIGINT,
    ended_us BIGINT,
    expires_us BIGINT,
    attempts INTEGER NOT NULL,
    stage TEXT,
    progress TEXT,
    reason TEXT,
    message TEXT,
    is_from_store BOOLEAN NOT NULL,
    replica TEXT,
    result_key TEXT,
    PRIMARY KEY (id),
    CONSTRAINT jobs_idempotency UNIQUE (owner, idempotency_key),
    FOREIGN KEY(result_key) REFERENCES results ("key")
);
CREATE INDEX jobs_all_listed ON jobs (created_us, id);
CREATE INDEX jobs_listed ON jobs (owner, created_us, id);
CREATE INDEX jobs_active ON jobs (state, replica);
CREATE INDEX jobs_expiring ON jobs (expires_us);
CREATE INDEX jobs_results ON jobs (result_key);
CREATE TABLE job_requests (
    job TEXT NOT NULL,
    content BLOB NOT NULL,
    PRIMARY KEY (job),
    FOREIGN KEY(job) REFERENCES jobs (id) ON DELETE CASCADE
);

INSERT INTO robosc_schema VALUES (1);
INSERT INTO replicas VALUES ('server-1', 41), ('server-2', 9000000000);
INSERT INTO results VALUES
    ('k', 'check', 5, 1),
    ('l', 'check', 3, 2),
    ('large', 'synthesize', 5000000000, 3);
INSERT INTO result_blocks VALUES
    ('k', 0, x'00000000'),
    ('large', 0, x'00000002ff80'),
    ('large', 1, x'000000010a');
INSERT INTO jobs VALUES
    ('done', 'me', 'check', 'succeeded', 7, 'k', 'main', '', NULL, 1000, 1, 2, 3, 9000000000000000, 1, NULL, NULL, NULL,
        NULL, false, NULL, 'k'),
    ('zoe', 'zoe', 'synthesize', 'succeeded', 8, 'large', 'räumer.rscd', 'a label; -- with ''quotes''', 'once', 1000, 1,
        2, 3, 9000000000000000, 2, NULL, NULL, NULL, NULL, true, NULL, 'large'),
    ('ann', 'ann', 'synthesize', 'succeeded', 9, 'large', 'main', '', NULL, 1000, 1, 2, 3, 9000000000000000, 1, NULL,
        NULL, NULL, NULL, true, NULL, 'large'),
    ('failed', 'me', 'verify', 'failed', 5, 'v', 'main', '', NULL, 1000, 1, 2, 4, 9000000000000000, 3, NULL, NULL,
        'WORKER_LOST', 'the worker was lost', false, NULL, NULL),
    ('runs', 'me', 'synthesize', 'running', 4, 'r', 'main', '', NULL, 1000, 3, 4, NULL, NULL, 1, 'synthesis',
        '3 iterations', NULL, NULL, false, 'server-2', NULL),
    ('waits', 'me', 'check', 'queued', 1, 'm', 'main', '', 'i', 1000, 2, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, false,
        'somebody', NULL);
INSERT INTO job_requests VALUES ('runs', x'0a0300ff80'), ('waits', x'');
