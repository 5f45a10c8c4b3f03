"""What was done, in SQLite: a row for each file, with hashes, figures and message."""

from __future__ import annotations

import json
import sqlite3
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from .child import Record
from .plan import BatchError, BatchPlan, FileTask, hash_of

DONE = "done"
FAILED = "failed"
# Has ended workers of a cluster more than once, and is not tried again by itself.
ASIDE = "set aside"
RUNNING = "running"
WAITING = "waiting"
# Of the layout of the tables.
EDITION = 1
# What a user can do about errors of SQLite, by the last byte of their codes.
REMEDIES = {
    sqlite3.SQLITE_FULL: "Make room on the disk",
    sqlite3.SQLITE_IOERR: "Look for space, quota and rights on its disk",
    sqlite3.SQLITE_READONLY: "Allow writing it and its folder",
    sqlite3.SQLITE_CANTOPEN: "Allow writing into its folder, and let nothing else have its name",
    sqlite3.SQLITE_PERM: "Allow writing it and its folder",
    sqlite3.SQLITE_BUSY: "Close what has it open",
    sqlite3.SQLITE_LOCKED: "Close what has it open",
    sqlite3.SQLITE_NOTADB: "Move it away: files are done anew then",
    sqlite3.SQLITE_CORRUPT: "Move it away: files are done anew then",
}
BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
COLUMNS = {
    "name": "TEXT PRIMARY KEY",
    "path": "TEXT",
    "size": "INTEGER",
    "changed": "INTEGER",
    "input_hash": "TEXT",
    "key": "TEXT",
    "version": "TEXT",
    "state": "TEXT",
    "status": "INTEGER",
    "seconds": "REAL",
    "processor": "REAL",
    "memory": "INTEGER",
    "tries": "INTEGER DEFAULT 0",
    "ended": "REAL",
    "host": "TEXT",
    "message": "TEXT",
    "warnings": "TEXT",
    "words": "TEXT",
    "report": "TEXT",
    "outputs": "TEXT",
    "preview": "TEXT",
}


def _primary(error: sqlite3.Error) -> int:
    """The code of an error without what SQLite adds to it; 0 where the error is not SQLite's own."""
    return getattr(error, "sqlite_errorcode", 0) & 0xFF


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Turn errors of SQLite into one that names the file, the cause, and what to do."""
    try:
        yield
    except sqlite3.Error as error:
        if not _primary(error):
            # A closed manifest, or words that are no SQL: nothing that a user can mend.
            raise
        remedy = REMEDIES.get(_primary(error), "Look after this file")
        raise BatchError(
            f"{path}: cannot be used ({error}). {remedy}, and start the same command again: it goes on."
        ) from error


class Manifest:
    """The manifest of a batch, in a file beside its results; a BatchError says why it cannot be read or written."""

    def __init__(self, path: Path) -> None:
        """Open it, or make one.

        Raises
        ------
        BatchError : the file is no manifest, of another edition, or cannot be written
        """
        self.path = path
        with _named(path):
            self._base = sqlite3.connect(path, timeout=60.0, isolation_level=None)
        try:
            self._base.row_factory = sqlite3.Row
            ((edition,),) = self._ask("PRAGMA user_version")
            if edition not in (0, EDITION):
                raise BatchError(f"{path}: a manifest of edition {edition}, and this program knows {EDITION}")
            columns = ", ".join(f"{name} {kind}" for name, kind in COLUMNS.items())
            self._ask(f"CREATE TABLE IF NOT EXISTS runs ({columns})")
            self._ask("CREATE TABLE IF NOT EXISTS batch (name TEXT PRIMARY KEY, value TEXT)")
            self._ask(f"PRAGMA user_version = {EDITION}")
        except BatchError:
            self.close()
            raise

    def _ask(self, words: str, values: Sequence = ()) -> list[sqlite3.Row]:
        """All rows that answer a line of SQL."""
        with _named(self.path):
            return self._base.execute(words, values).fetchall()

    def close(self) -> None:
        self._base.close()

    def __enter__(self) -> Manifest:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def describe(self, plan: BatchPlan) -> None:
        """Keep what is asked of the files."""
        pairs = {"command": plan.command, "options": json.dumps(plan.options), "output": str(plan.output.resolve()),
                 "version": plan.version}  # fmt: skip
        with _named(self.path):
            self._base.executemany("INSERT OR REPLACE INTO batch VALUES (?, ?)", list(pairs.items()))

    def description(self) -> dict[str, str]:
        return {row["name"]: row["value"] for row in self._ask("SELECT * FROM batch")}

    def due(self, plan: BatchPlan, tasks: Sequence[FileTask], retry: bool) -> list[FileTask]:
        """Those of the tasks that are to be run, in order: new, changed, never ended, or failed and to be retried.

        Rows of files that are no longer there are removed; those of other parts of a batch stand in other manifests.
        """
        rows = {row["name"]: row for row in self._ask("SELECT * FROM runs")}
        key, due, waiting = plan.key(), [], []
        for task in tasks:
            row = rows.pop(task.name, None)
            fresh = row is not None and row["key"] == key and self._same_input(row, task)
            if row is not None and fresh and _is_over(row, retry):
                continue
            due.append(task)
            waiting.append((task.name, str(task.path), task.size, WAITING))
        # All or nothing, also of what is stopped by hand, or by a full disk.
        with _named(self.path), self._base:
            self._base.execute("BEGIN IMMEDIATE")
            self._base.executemany("DELETE FROM runs WHERE name = ?", [(name,) for name in rows])
            self._base.executemany(
                "INSERT INTO runs (name, path, size, state) VALUES (?, ?, ?, ?) ON CONFLICT (name) "
                "DO UPDATE SET path = excluded.path, size = excluded.size, state = excluded.state",
                waiting,
            )
        return due

    def _same_input(self, row: sqlite3.Row, task: FileTask) -> bool:
        """Whether the file is that of the row, by size and time of change, and if the time is another, by its hash."""
        if row["size"] != task.size:
            return False
        if row["changed"] == task.changed:
            return True
        same = row["input_hash"] == hash_of(task.path)
        if same:
            self._ask("UPDATE runs SET changed = ? WHERE name = ?", (task.changed, task.name))
        return same

    def begin(self, task: FileTask) -> None:
        """Say that a run has begun; what is running when a batch begins was in flight when another was killed."""
        self._ask("UPDATE runs SET state = ?, tries = tries + 1 WHERE name = ?", (RUNNING, task.name))

    def end(self, plan: BatchPlan, task: FileTask, record: Record) -> None:
        """Keep how a run has ended."""
        state = DONE if record.status == 0 else ASIDE if record.aside else FAILED
        values = {
            "path": str(task.path), "size": task.size, "changed": task.changed, "input_hash": record.input_hash,
            "key": plan.key(), "version": plan.version, "state": state, "status": record.status,
            "seconds": record.seconds, "processor": record.processor, "memory": record.memory, "ended": time.time(),
            "host": record.host, "message": record.message, "warnings": json.dumps(record.warnings),
            "words": json.dumps(record.words), "report": record.report, "outputs": json.dumps(record.outputs),
            "preview": record.preview,
        }  # fmt: skip
        names = ", ".join(f"{name} = ?" for name in values)
        self._ask(f"UPDATE runs SET {names} WHERE name = ?", (*values.values(), task.name))

    def rows(self) -> list[dict]:
        """All rows as dicts, in the order of names."""
        return [dict(row) for row in self._ask("SELECT * FROM runs ORDER BY name")]

    def counts(self) -> dict[str, int]:
        """How many files are in each state."""
        return dict(map(tuple, self._ask("SELECT state, COUNT(*) FROM runs GROUP BY state")))


def _is_over(row: sqlite3.Row, retry: bool) -> bool:
    """Whether a run of this very file with these options has ended, and its results are still there."""
    if row["state"] in (FAILED, ASIDE):
        return not retry
    outputs = json.loads(row["outputs"] or "{}")
    return row["state"] == DONE and all(_has_size(Path(path), size) for path, (_, size) in outputs.items())


def _has_size(path: Path, size: int) -> bool:
    try:
        return path.stat().st_size == size
    except OSError:
        return False


def rows_of(paths: Iterable[Path]) -> list[dict]:
    """Rows of several manifests, of the parts of one batch, in the order of names.

    Raises
    ------
    BatchError : there is no such file, or it is no manifest
    """
    rows = []
    for path in paths:
        if not path.is_file():
            raise BatchError(f"{path}: there is no such manifest. Name the folder of the results of a batch.")
        with Manifest(path) as manifest:
            rows += manifest.rows()
    return sorted(rows, key=lambda row: row["name"])


def found_beside(output: Path) -> list[Path]:
    """The manifests of a batch, one for each part of it that ran apart.

    Raises
    ------
    BatchError : there is none
    """
    from .plan import MANIFEST, beside

    whole = beside(output, MANIFEST)
    parts = sorted(whole.parent.glob(f"{_literal(whole.name.removesuffix(MANIFEST))}.part*{MANIFEST}"))
    found = [path for path in (whole, *parts) if path.is_file()]
    if not found:
        raise BatchError(f"{whole}: there is no such manifest. Name the folder of the results of a batch.")
    return found


def _literal(name: str) -> str:
    """A name as a pattern that it alone fits."""
    from glob import escape

    return escape(name)


@contextmanager
def only_one(path: Path) -> Iterator[None]:
    """Let no second batch work on a manifest; the system ends this with the process, however that ends.

    Raises
    ------
    BatchError : another batch is at work, or its lock cannot be made
    """
    name = path.with_suffix(".lock")
    with _named(name):
        lock = sqlite3.connect(name, timeout=0.0, isolation_level=None)
    try:
        with _named(name):
            try:
                lock.execute("PRAGMA journal_mode = OFF")
                lock.execute("BEGIN EXCLUSIVE")
            except sqlite3.OperationalError as error:
                if _primary(error) in BUSY:
                    raise BatchError(f"{path}: another batch is at work on it. Wait for its end.") from error
                raise
        yield
    finally:
        with suppress(sqlite3.Error):
            lock.close()
