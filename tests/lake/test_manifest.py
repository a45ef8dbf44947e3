"""The manifest itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from plancurate.tasks.lake.manifest import (
    MANIFEST,
    Entry,
    append,
    entry_of,
    folder_damage,
    forget,
    list_files,
    locked,
    read_manifest,
)

from ..processes import processes


def test_an_entry_is_read_back_and_the_latest_of_a_name_counts(tmp_path: Path) -> None:
    one, other = Entry("a", 1, "aa", 3), Entry("a", 2, "bb")
    for entry in (one, Entry("b", 5, "cc"), other):
        append(tmp_path, entry)
    manifest = read_manifest(tmp_path)
    assert manifest.entries == {"a": other, "b": Entry("b", 5, "cc")}
    assert manifest.damaged_lines == ()


def test_a_line_that_a_killed_writer_left_is_ignored_and_cut_off(tmp_path: Path) -> None:
    append(tmp_path, Entry("a", 1, "aa"))
    with (tmp_path / MANIFEST).open("ab") as file:
        file.write(b'{"file": "torn", "by')
    assert list(read_manifest(tmp_path).entries) == ["a"]
    append(tmp_path, Entry("b", 1, "aa"))
    assert list(read_manifest(tmp_path).entries) == ["a", "b"]
    assert read_manifest(tmp_path).damaged_lines == ()


@pytest.mark.parametrize(
    "line", ["{", "[]", "null", '{"file": "b"}', '{"file": 1, "bytes": 1, "sha256": "a"}']
)
def test_a_line_that_is_no_entry_is_numbered(tmp_path: Path, line: str) -> None:
    append(tmp_path, Entry("a", 1, "aa"))
    with (tmp_path / MANIFEST).open("a") as file:
        file.write(f"{line}\n")
    append(tmp_path, Entry("c", 1, "aa"))
    assert read_manifest(tmp_path).damaged_lines == (2,)
    assert list(read_manifest(tmp_path).entries) == ["a", "c"]
    forget(tmp_path, ["a"])
    assert read_manifest(tmp_path).damaged_lines == ()
    assert list(read_manifest(tmp_path).entries) == ["c"]


def test_a_field_that_a_later_release_adds_does_not_matter(tmp_path: Path) -> None:
    (tmp_path / MANIFEST).write_text(
        '{"file": "a", "bytes": 1, "sha256": "aa", "rows": 2, "colour": "red"}\n'
    )
    assert read_manifest(tmp_path).entries == {"a": Entry("a", 1, "aa", 2)}


def test_a_folder_names_its_missing_and_changed_files(tmp_path: Path) -> None:
    for name in "abc":
        (tmp_path / name).write_text(name)
    list_files(tmp_path, "abc")
    assert folder_damage(tmp_path) == []
    (tmp_path / "a").unlink()
    (tmp_path / "b").write_text("x")
    assert folder_damage(tmp_path) == [
        f"{tmp_path}/a: missing, although manifest.jsonl names it",
        f"{tmp_path}/b: changed since it was written, its SHA-256 is not the one in manifest.jsonl",
    ]
    (tmp_path / MANIFEST).unlink()
    assert folder_damage(tmp_path)[0].startswith(f"{tmp_path}/manifest.jsonl: no such file")


def append_many(folder: Path, writer: str) -> None:
    for number in range(200):
        with locked(folder):
            append(folder, Entry(f"{writer}-{number}", number, "aa"))
            if number % 50 == 49:
                forget(folder, [f"{writer}-{number - 1}"])


@pytest.mark.slow
def test_many_writers_at_once_lose_no_entry(tmp_path: Path) -> None:
    at_work = [processes.Process(target=append_many, args=(tmp_path, writer)) for writer in "abc"]
    for process in at_work:
        process.start()
    for process in at_work:
        process.join(60)
    assert [process.exitcode for process in at_work] == [0, 0, 0]
    assert len(read_manifest(tmp_path).entries) == 3 * (200 - 4)


def test_an_entry_describes_the_file_under_its_future_name(tmp_path: Path) -> None:
    (tmp_path / "tmp").write_bytes(b"abc")
    sha256 = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert entry_of(tmp_path / "tmp", "part", 7) == Entry("part", 3, sha256, 7)
