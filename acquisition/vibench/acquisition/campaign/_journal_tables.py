"""The tables of a campaign's journal, as SQL; docs/campaigns.md describes them for a stranger."""

VERSION = 1

SCHEMA = """
CREATE TABLE campaign (
    key TEXT PRIMARY KEY,
    value TEXT NOT NULL
);
CREATE TABLE benches (
    since_utc TEXT NOT NULL,
    identity_json TEXT NOT NULL
);
CREATE TABLE points (
    name TEXT PRIMARY KEY COLLATE NOCASE,
    place INTEGER NOT NULL,
    measurement_json TEXT NOT NULL,
    chain TEXT NOT NULL,
    added_after TEXT NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'done', 'failed', 'interrupted')),
    why TEXT NOT NULL,
    reason TEXT NOT NULL,
    file TEXT NOT NULL,
    is_followed_up INTEGER NOT NULL
);
CREATE TABLE attempts (
    name TEXT NOT NULL REFERENCES points (name),
    number INTEGER NOT NULL,
    file TEXT NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('running', 'done', 'failed', 'interrupted')),
    why TEXT NOT NULL,
    reason TEXT NOT NULL,
    begun_utc TEXT NOT NULL,
    ended_utc TEXT NOT NULL,
    PRIMARY KEY (name, number)
);
"""

POINTS = """
SELECT points.*, (SELECT COUNT(*) FROM attempts WHERE attempts.name = points.name) AS attempts,
    COALESCE((SELECT begun_utc FROM attempts WHERE attempts.name = points.name
        ORDER BY number DESC LIMIT 1), '') AS begun_utc,
    COALESCE((SELECT ended_utc FROM attempts WHERE attempts.name = points.name
        ORDER BY number DESC LIMIT 1), '') AS ended_utc
FROM points ORDER BY place
"""
