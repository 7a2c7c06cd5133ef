"""Databases of bags of ROS 2 whose recording was killed within a commit: SQLite's rollback file stands beside them.

Nothing in the bag is changed: SQLite takes back in a copy what was not committed.
"""

import contextlib
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def consistent_database(path: Path, notes: list[str]) -> Iterator[Path]:
    """A .db3 file that can be read: itself, or a copy without what was not committed.

    Args:
        path: of the file.
        notes: gets a sentence if it ends early.
    """
    rollback = path.with_name(f"{path.name}-journal")
    if not rollback.exists():
        yield path
        return
    notes.append(f"{path.name} ends early, as after `kill -9`")
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        shutil.copyfile(path, copy)
        shutil.copyfile(rollback, copy.with_name(rollback.name))
        with contextlib.closing(sqlite3.connect(copy)) as connection:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        yield copy
