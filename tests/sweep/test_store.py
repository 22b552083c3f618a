from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Iterable
from pathlib import Path

import pytest

from lenscl.status import RayStatus
from lenscl.sweep.cleaning import clear_folder
from lenscl.sweep.errors import ForeignTableError, SweepError
from lenscl.sweep.lock import folder_lock
from lenscl.sweep.store import SCHEMA_VERSION, STORE_NAME, Planned, Stamp, Store

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


def test_a_full_disk_is_named_and_what_was_noted_before_stays(tmp_path: Path) -> None:
    carry_out(tmp_path, planned(0))
    with Store.writing(tmp_path) as store:
        # SQLite's own limit raises the very error of a full disk
        pages = store._connection.execute("PRAGMA page_count").fetchone()[0]
        store._connection.execute(f"PRAGMA max_page_count = {pages}")
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
