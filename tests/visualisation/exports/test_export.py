"""Properties common to all export formats: existing files, full disks, missing libraries and data."""

import subprocess
import sys
from pathlib import Path

import pytest
from synthetic_runs import Fiction
from test_other_figures import room_for

import visualisation.exports
from missions.errors import OutputError
from missions.figure import Place
from missions.runs.results import Results
from visualisation import ExportError
from visualisation.exports import FORMATS, export, export_path

OF_COURSES = [name for name, format in FORMATS.items() if not format.of_knowledge]
"""Knowledge is exported by the tests of knowledge, of runs that took place."""
WITH_DATUM = [name for name in OF_COURSES if FORMATS[name].needs_datum]
WITHOUT = [name for name in OF_COURSES if name not in WITH_DATUM]


def files_of(path: Path) -> dict[str, bytes]:
    """Contents of a file, or of the files of a folder, by their names."""
    return {one.name: one.read_bytes() for one in (path.iterdir() if path.is_dir() else [path])}


@pytest.mark.parametrize("format", OF_COURSES)
def test_the_same_run_gives_the_same_bytes(
    run: Results, places: tuple[Place, ...], format: str, tmp_path: Path
) -> None:
    """In one process, and so with counters of the libraries that have moved on."""
    first = export(run, format, export_path(tmp_path / "first", format), places=places)
    again = export(run, format, export_path(tmp_path / "again", format), places=places)
    assert first.counts == again.counts
    if format != "netcdf":  # HDF5 writes the time of writing into the file
        assert files_of(first.path) == files_of(again.path)
    assert not [path for path in first.path.parent.iterdir() if path != first.path]


@pytest.mark.parametrize("format", WITH_DATUM)
def test_export_without_datum_is_refused_with_the_missing_key(older: Results, format: str, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"world\.origin_deg.*or take mcap or csv"):
        export(older, format, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("format", WITHOUT)
def test_run_of_an_older_version_with_special_names_is_exported(older: Results, format: str, tmp_path: Path) -> None:
    """Its folder has no packets, no depths, no id: 61 points of each of 4 vehicles (see ``Fiction``)."""
    made = export(older, format, tmp_path / "out")
    of_motion = {"mcap": made.counts.get("/tf"), "csv": made.counts.get("trajectories", 0) / 4}
    assert of_motion[format] == 61


@pytest.mark.parametrize("format", OF_COURSES)
def test_empty_run_is_exported(tmp_path: Path, format: str) -> None:
    results = Fiction(end_s=0.0, recorded=False, completed=False).write(tmp_path / "run")
    results.manifest["scenario"] += "\n[world]\norigin_deg = [43.35, 3.75]\n"
    made = export(results, format, tmp_path / "out")
    assert made.path.exists()
    assert {made.counts.get(name, 0) for name in ("/tf", "trajectories", "points", "track")} == {0}


@pytest.mark.parametrize("format", OF_COURSES)
def test_existing_file_is_replaced_only_with_force(run: Results, format: str, tmp_path: Path) -> None:
    out = export_path(tmp_path, format)
    export(run, format, out)
    before = files_of(out)
    with pytest.raises(ExportError, match="exists; name another with --out or add --force"):
        export(run, format, out)
    assert files_of(out) == before
    (next(out.iterdir()) if out.is_dir() else out).write_bytes(b"")
    export(run, format, out, force=True)
    after = files_of(out)
    assert [(name, len(after[name])) for name in before] == [(name, len(before[name])) for name in after]


def test_a_folder_with_other_files_is_never_replaced(run: Results, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("words")
    with pytest.raises(ExportError, match=r"holds other files, such as thesis\.tex"):
        export(run, "csv", tmp_path, force=True)
    with pytest.raises(ExportError, match=r"is a folder; name a file, such as .*run\.mcap"):
        export(run, "mcap", tmp_path, force=True)
    with pytest.raises(OutputError, match="names a file; allowed: a folder"):
        export(run, "csv", tmp_path / "thesis.tex", force=True)
    assert (tmp_path / "thesis.tex").read_text() == "words"


def test_missing_library_is_named_in_the_error(run: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("visualisation.exports.find_spec", lambda name: None)
    with pytest.raises(ExportError, match=r"needs mcap and rosbags, which .* install mcap rosbags"):
        export(run, "mcap", tmp_path / "out")
    assert export(run, "csv", tmp_path / "csv").counts["trajectories"] > 0


@pytest.mark.parametrize("format", OF_COURSES)
def test_a_full_disk_leaves_nothing(run: Results, format: str, tmp_path: Path) -> None:
    """Files are limited to 2000 bytes, less than any export; the error is that of a full disk."""
    with room_for(2000), pytest.raises(ExportError, match="cannot be written: File too large"):
        export(run, format, export_path(tmp_path, format))
    assert list(tmp_path.iterdir()) == []


def test_importing_the_package_loads_no_library() -> None:
    code = (
        "import visualisation.exports, sys\n"
        "sys.exit(bool({'mcap', 'rosbags', 'netCDF4', 'matplotlib', 'pyarrow'} & {*sys.modules}))"
    )
    root = Path(visualisation.exports.__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", code], check=False, cwd=root).returncode == 0
