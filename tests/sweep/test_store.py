from __future__ import annotations

import json
import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

import pytest

from lenscl.status import RayStatus
from lenscl.sweep.cleaning import clear_folder
from lenscl.sweep.errors import ForeignTableError, SweepError
from lenscl.sweep.lock import folder_lock
from lenscl.sweep.schema import SCHEMA_VERSION, STORE_NAME
from lenscl.sweep.store import Planned, Stamp, Store

ABOUT = {"title": "a title", "axes": ["lens.R", "lens.r"], "program": "lenscl 0"}
COUNTS = {status: 10 + status for status in RayStatus}


def planned(*numbers: int, key: str = "k") -> list[Planned]:
    return [
        Planned(f"{n}-cat.png", position, n, {"lens.R": 1.0, "lens.r": n / 4}, "cat.jpg", f"{key}{n}")
        for position, n in enumerate(numbers)
    ]


def carry_out(folder: Path, runs: Iterable[Planned]) -> None:
    with Store.writing(folder) as store:
        store.plan(list(runs), ABOUT)
        for row in list(store.rows()):
            if row.state == "pending":
                (folder / row.output).write_bytes(row.output.encode())
                stamp = Stamp.of(folder / row.output)
                store.finish(row.output, counts=COUNTS, seconds=(1.0, 2.0, 4.0), stamp=stamp, device="d", kernel="k")


def states(folder: Path, runs: Iterable[Planned]) -> list[str]:
    with Store.writing(folder) as store:
        store.plan(list(runs), ABOUT)
        return [row.state for row in store.rows()]


def test_every_run_is_pending_before_the_first_starts(tmp_path: Path) -> None:
    assert states(tmp_path, planned(0, 1, 2)) == ["pending"] * 3


def test_a_finished_row_comes_back_as_it_was_noted(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(3))
    with Store.reading(tmp_path) as store:
        (row,) = store.rows()
        assert store.about("axes") == ABOUT["axes"]
    assert (row.output, row.index, row.picture, row.state) == ("3-cat.png", 3, "cat.jpg", "done")
    assert dict(row.values) == {"lens.R": 1.0, "lens.r": 0.75}  # R and r side by side
    assert row.counts == COUNTS
    assert row.seconds == 7.0


def test_planning_again_keeps_what_is_done_and_retries_what_failed(tmp_path: Path) -> None:
    runs = planned(0, 1, 2)
    carry_out(tmp_path, runs[:2])
    with Store.writing(tmp_path) as store:
        store.plan(runs, ABOUT)
        store.fail("2-cat.png", "no such thing")
        assert [row.state for row in store.rows()] == ["done", "done", "failed"]
        assert store.row("2-cat.png").error == "no such thing"
    assert states(tmp_path, runs) == ["done", "done", "pending"]


def test_what_checks_found_is_kept_and_may_be_missing(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0, 1))
    found = {"rays": 3, "worst": {"snell": 0.1}}
    with Store.writing(tmp_path) as store:
        stamp = Stamp.of(tmp_path / "1-cat.png")
        store.finish("1-cat.png", counts=COUNTS, seconds=(1.0, 2.0, 4.0), stamp=stamp, device="d", kernel="k",
                     checks=found)  # fmt: skip
        assert [row.checks for row in store.rows()] == [None, found]
        store.plan([*planned(0), planned(0, 1, key="other")[1]], ABOUT)
        assert [row.checks for row in store.rows()] == [None, None]


def test_another_key_makes_a_run_pending_and_forgets_its_results(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0, 1))
    with Store.writing(tmp_path) as store:
        store.plan([planned(0)[0], planned(0, 1, key="other")[1]], ABOUT)
        kept, changed = store.rows()
    assert (kept.state, kept.counts) == ("done", COUNTS)
    assert (changed.state, changed.counts, changed.seconds) == ("pending", None, None)


@pytest.mark.parametrize(
    ("harm", "expected"),
    [
        (lambda path: None, "done"),
        (lambda path: path.unlink(), "pending"),
        (lambda path: path.write_bytes(b"another size"), "pending"),
        (lambda path: (path.write_bytes(path.read_bytes()[::-1]), os.utime(path, (1, 1))), "pending"),
        (lambda path: os.utime(path, (1, 1)), "done"),  # a copied file: its content tells
    ],
    ids=["untouched", "vanished", "resized", "rewritten", "only its time changed"],
)
def test_an_output_that_is_not_what_was_written_is_made_again(tmp_path: Path, harm, expected: str) -> None:
    carry_out(tmp_path, planned(0, 1))
    harm(tmp_path / "1-cat.png")
    assert states(tmp_path, planned(0, 1)) == ["done", expected]


def test_a_copied_folder_needs_nothing_made_again(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    carry_out(tmp_path / "a", planned(0, 1))
    shutil.copytree(tmp_path / "a", tmp_path / "b", copy_function=shutil.copyfile)
    assert states(tmp_path / "b", planned(0, 1)) == ["done", "done"]


def test_rows_of_an_earlier_form_of_the_study_are_set_aside_and_taken_up_again(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0, 1, 2))
    with Store.writing(tmp_path) as store:
        store.plan(planned(2), ABOUT)
        assert [row.output for row in store.rows()] == ["2-cat.png"]
        assert store.left_over() == 2
    assert states(tmp_path, planned(2, 1, 0)) == ["done"] * 3


def test_a_plan_that_breaks_off_leaves_the_table_as_it_was(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0, 1))

    def breaks_off():
        yield planned(0, key="other")[0]
        raise RuntimeError("in the midst of it")

    with Store.writing(tmp_path) as store:
        with pytest.raises(RuntimeError, match="in the midst"):
            store.plan(breaks_off(), ABOUT)
        assert [row.state for row in store.rows()] == ["done", "done"]


def test_the_table_can_be_read_while_it_is_written_and_after_its_writer_died(tmp_path: Path) -> None:
    with Store.writing(tmp_path) as writer:
        writer.plan(planned(0, 1), ABOUT)
        with Store.reading(tmp_path) as reader:
            assert len(list(reader.rows())) == 2
        for name in (STORE_NAME, f"{STORE_NAME}-wal"):  # what a killed process leaves
            shutil.copyfile(tmp_path / name, tmp_path / f"killed-{name}")
    dead = tmp_path / "dead"
    dead.mkdir()
    for name in (STORE_NAME, f"{STORE_NAME}-wal"):
        (tmp_path / f"killed-{name}").rename(dead / name)
    with Store.reading(dead) as reader:
        assert len(list(reader.rows())) == 2


def test_a_file_that_is_no_table_is_refused_with_what_to_do(tmp_path: Path) -> None:
    (tmp_path / STORE_NAME).write_text("these are my notes, " * 100)
    with (
        pytest.raises(SweepError, match=r"sweep\.sqlite: is not the table of a sweep; `--fresh`"),
        Store.writing(tmp_path),
    ):
        pass


def test_another_programs_table_is_refused_and_never_removed(tmp_path: Path) -> None:
    foreign = sqlite3.connect(tmp_path / STORE_NAME)
    foreign.execute("CREATE TABLE mine (x)")
    foreign.close()
    before = (tmp_path / STORE_NAME).read_bytes()
    with pytest.raises(ForeignTableError, match="another program's"), Store.writing(tmp_path):
        pass
    with pytest.raises(ForeignTableError):
        clear_folder(tmp_path)
    assert (tmp_path / STORE_NAME).read_bytes() == before


def test_a_table_of_another_schema_is_refused_with_both_numbers(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0))
    table = sqlite3.connect(tmp_path / STORE_NAME)
    table.execute(f"PRAGMA user_version = {SCHEMA_VERSION + 6}")
    table.close()
    pattern = f"schema {SCHEMA_VERSION + 6}, .* schema {SCHEMA_VERSION}; `--fresh`"
    with pytest.raises(SweepError, match=pattern), Store.writing(tmp_path):
        pass


# Tables as earlier programs made them: schema 1, schema 2 as it was first, and schema 2
FIRST = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE run (
    output TEXT PRIMARY KEY, position INTEGER UNIQUE, point INTEGER NOT NULL, parameters TEXT NOT NULL,
    picture TEXT NOT NULL, key TEXT NOT NULL, state TEXT NOT NULL CHECK (state IN ('pending', 'done', 'failed')),
    counts TEXT, trace_seconds REAL, paint_seconds REAL, write_seconds REAL,
    size INTEGER, changed_ns INTEGER, digest TEXT, device TEXT, kernel TEXT, error TEXT{further}
);
CREATE INDEX run_of_point ON run (point, position);
PRAGMA application_id = 1818586739;
PRAGMA user_version = {version};
"""
EARLIER = {
    "1": FIRST.format(further="", version=1),
    "2 without achieved": FIRST.format(further=", checks TEXT", version=2),
    "2": FIRST.format(further=", checks TEXT, achieved TEXT", version=2),
}


def earlier_table(folder: Path, schema: str, runs: list[Planned]) -> None:
    """Make a table as an earlier program left it: all runs done but the last, which failed."""
    with closing(sqlite3.connect(folder / STORE_NAME)) as table:
        table.executescript(EARLIER[schema])
        for run in runs:
            path = folder / run.output
            path.write_bytes(run.output.encode())
            stamp, counts = Stamp.of(path), {status.name.lower(): n for status, n in COUNTS.items()}
            state, error = ("failed", "no such thing") if run is runs[-1] else ("done", None)
            table.execute(
                "INSERT INTO run (output, position, point, parameters, picture, key, state, counts, trace_seconds, "
                "paint_seconds, write_seconds, size, changed_ns, digest, device, kernel, error) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?, 1.0, 2.0, 4.0, ?, ?, ?, 'd', 'k', ?)",
                (run.output, run.position, run.point, json.dumps(run.values), run.picture, run.key, state,
                 json.dumps(counts), stamp.size, stamp.changed_ns, stamp.digest, error),
            )  # fmt: skip
        table.execute("""INSERT INTO about VALUES ('axes', '["lens.R","lens.r"]')""")
        table.commit()


def version_of(folder: Path) -> int:
    with closing(sqlite3.connect(folder / STORE_NAME)) as table:
        return int(table.execute("PRAGMA user_version").fetchone()[0])


@pytest.mark.parametrize("schema", EARLIER)
def test_a_study_begun_with_an_earlier_schema_goes_on(tmp_path: Path, schema: str) -> None:
    runs = planned(0, 1, 2)
    earlier_table(tmp_path, schema, runs)
    assert states(tmp_path, runs) == ["done", "done", "pending"]
    assert version_of(tmp_path) == SCHEMA_VERSION
    with Store.writing(tmp_path) as store:
        (tmp_path / "2-cat.png").write_bytes(b"made")
        stamp = Stamp.of(tmp_path / "2-cat.png")
        store.finish("2-cat.png", counts=COUNTS, seconds=(1.0, 2.0, 4.0), stamp=stamp, device="d", kernel="k",
                     checks={"rays": 3}, achieved={"error": 0.5}, spans={"trace": 1.5})  # fmt: skip
        rows = list(store.rows())
    assert [row.counts for row in rows] == [COUNTS] * 3
    assert [row.seconds for row in rows] == [7.0] * 3
    assert [row.spans for row in rows] == [None, None, {"trace": 1.5}]
    assert [row.checks for row in rows] == [None, None, {"rays": 3}]
    assert [row.achieved for row in rows] == [None, None, {"error": 0.5}]
    fresh = tmp_path / "fresh"
    fresh.mkdir()
    carry_out(fresh, runs)
    assert columns_of(tmp_path) == columns_of(fresh)


def columns_of(folder: Path) -> set[str]:
    with closing(sqlite3.connect(folder / STORE_NAME)) as table:
        return {name for _, name, *_ in table.execute("PRAGMA table_info(run)")}


@pytest.mark.parametrize("schema", EARLIER)
def test_a_table_of_an_earlier_schema_is_read_as_it_is(tmp_path: Path, schema: str) -> None:
    earlier_table(tmp_path, schema, planned(0, 1))
    before = (tmp_path / STORE_NAME).read_bytes()
    with Store.reading(tmp_path) as store:
        rows = list(store.rows())
        assert store.row("1-cat.png") == rows[1]
    assert [(row.state, row.error) for row in rows] == [("done", None), ("failed", "no such thing")]
    assert [(row.checks, row.achieved, row.spans) for row in rows] == [(None, None, None)] * 2
    assert (tmp_path / STORE_NAME).read_bytes() == before


def test_a_process_killed_while_it_brings_a_table_up_leaves_the_old_one(tmp_path: Path) -> None:
    earlier_table(tmp_path, "1", planned(0, 1))
    text = (
        "import os, sqlite3, sys; from pathlib import Path; from lenscl.sweep import Store; real = sqlite3.connect\n"
        "class Dies(sqlite3.Connection):\n"
        "    def executescript(self, script):\n"
        "        for one in script.split(';')[:3]: self.execute(one)\n"
        "        os._exit(9)\n"
        "sqlite3.connect = lambda *a, **k: real(*a, factory=Dies, **k)\n"
        "with Store.writing(Path(sys.argv[1])): pass\n"
    )
    done = subprocess.run([sys.executable, "-c", text, tmp_path], capture_output=True, text=True)
    assert done.returncode == 9, done.stderr
    assert version_of(tmp_path) == 1
    assert columns_of(tmp_path).isdisjoint({"checks", "achieved", "spans"})
    assert states(tmp_path, planned(0, 1)) == ["done", "pending"]
    assert version_of(tmp_path) == SCHEMA_VERSION


def test_a_table_that_is_gone_or_replaced_is_known_by_its_file(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0))
    with Store.writing(tmp_path) as store:
        store.check_in_place()
        (tmp_path / STORE_NAME).rename(tmp_path / "elsewhere")
        with pytest.raises(SweepError, match="is gone, or was replaced"):
            store.check_in_place()
        shutil.copyfile(tmp_path / "elsewhere", tmp_path / STORE_NAME)
        with pytest.raises(SweepError, match="is gone, or was replaced"):
            store.check_in_place()


def test_a_full_disk_is_named_and_what_was_noted_before_stays(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0))
    with Store.writing(tmp_path) as store:
        # SQLite's own limit raises the very error of a full disk
        pages = store.connection.execute("PRAGMA page_count").fetchone()[0]
        store.connection.execute(f"PRAGMA max_page_count = {pages}")
        with pytest.raises(SweepError, match="the disk is full; free some space and run the same command again"):
            store.plan(planned(*range(1000)), ABOUT)
        assert [row.state for row in store.rows()] == ["done"]


def test_a_folder_that_is_a_file_or_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SweepError, match="file: cannot be made"), folder_lock(tmp_path / "file"):
        pass
    if os.geteuid() == 0:
        pytest.skip("the superuser may write everywhere: the read-only folder was not tried")
    (tmp_path / "sealed").mkdir(mode=0o555)
    with pytest.raises(SweepError, match="make the folder readable and writable"), folder_lock(tmp_path / "sealed"):
        pass


def test_a_folder_without_a_table_is_named(tmp_path: Path) -> None:
    with pytest.raises(SweepError, match="no such file; expected the folder of a sweep"), Store.reading(tmp_path):
        pass


def test_only_one_may_hold_a_folder(tmp_path: Path) -> None:
    refused = pytest.raises(SweepError, match="another sweep is writing here")
    with folder_lock(tmp_path), refused, folder_lock(tmp_path):
        pass
    with folder_lock(tmp_path):
        pass


def test_starting_over_removes_what_the_table_lists_and_nothing_else(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0, 1))
    (tmp_path / "notes.txt").write_text("mine")
    outside = tmp_path.parent / f"{tmp_path.name}-outside.png"
    outside.write_text("not ours")
    table = sqlite3.connect(tmp_path / STORE_NAME)
    table.execute("UPDATE run SET output = ? WHERE point = 1", (f"../{outside.name}",))
    table.commit()
    table.close()
    clear_folder(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1-cat.png", "notes.txt"]
    assert outside.exists()


def test_at_rest_a_folder_holds_one_file_of_the_table_also_after_reading(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0))
    with Store.reading(tmp_path) as store:
        assert len(list(store.rows())) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0-cat.png", STORE_NAME]


def test_a_reader_hinders_no_writer_from_ending(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0))
    with Store.writing(tmp_path) as writer:
        writer.plan(planned(0, 1), ABOUT)
        reading = Store.reading(tmp_path)
        reader = reading.__enter__()
        rows = reader.rows()
        next(rows)
    assert len(list(rows)) == 1
    reading.__exit__(None, None, None)
    assert states(tmp_path, planned(0, 1)) == ["done", "pending"]


def test_starting_over_leaves_a_folder_that_has_an_outputs_name(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0, 1))
    (tmp_path / "0-cat.png").unlink()
    (tmp_path / "0-cat.png").mkdir()
    clear_folder(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["0-cat.png"]


def test_a_table_that_may_not_be_looked_for_is_a_sweep_error(tmp_path: Path) -> None:
    with pytest.raises(SweepError, match="no such file"), Store.reading(tmp_path / ("x" * 300)):
        pass
