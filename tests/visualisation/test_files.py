"""Files of figures are there whole or not at all."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from missions.comparison.rows import write_csv
from missions.files import drafted
from visualisation.output import DrawingError, write_folder

PICTURE = b"x" * 70_000


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """No file may grow beyond so many bytes, as on a disk that gets full."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_leaves_no_cut_file_and_keeps_what_was_there(tmp_path: Path) -> None:
    (tmp_path / "roles.txt").write_text("older", encoding="utf-8")
    with room_for(65_536), pytest.raises(DrawingError, match=r"roles\.png: cannot be written: File too large"):
        write_folder(tmp_path, [("roles.txt", b"newer"), ("roles.png", PICTURE)])
    assert {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == {"roles.txt": "older"}


def test_a_full_disk_leaves_no_cut_table(tmp_path: Path) -> None:
    with room_for(100), pytest.raises(OSError, match=r"too large: '.*rows\.csv'"):
        write_csv([], tmp_path / "rows.csv")
    with room_for(100), pytest.raises(OSError, match="too large"), drafted(tmp_path / "other") as draft:
        draft.write_bytes(PICTURE)
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("precious", encoding="utf-8")
    with pytest.raises(DrawingError, match="file: cannot be written: File exists"):
        write_folder(tmp_path / "file", [("roles.png", PICTURE)])
    assert (tmp_path / "file").read_text(encoding="utf-8") == "precious"
