"""Saved runs: one JSON file each in a folder, under the name they were given."""

from __future__ import annotations

import re
from pathlib import Path

import platformdirs
from pydantic import TypeAdapter, ValidationError

from lenscl.accuracy.bench.measurement import Run
from lenscl.errors import LensclError, StudyError
from lenscl.imaging.atomic import whole_file

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,99}")  # a file's name everywhere, never hidden, never a path
_MOST_BYTES = 50_000_000  # a run of all scenes is some hundred thousand
_RUN = TypeAdapter(Run)


def user_folder() -> Path:
    """Return where a user's runs are kept: their data folder, found again from any other."""
    return Path(platformdirs.user_data_dir("lenscl", appauthor=False)) / "bench"


def as_json(run: Run) -> str:
    """Return a run as it is saved."""
    return _RUN.dump_json(run, indent=2).decode() + "\n"


class Store:
    """A folder of saved runs; it is made when the first is saved."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or user_folder()

    def names(self) -> list[str]:
        """Return the names of the saved runs."""
        return sorted(path.stem for path in self.folder.glob("*.json") if _NAME.fullmatch(path.stem))

    def check_free(self, name: str, *, force: bool) -> Path:
        """Return the file of a name under which a run may be saved.

        Raises
        ------
        StudyError
            If it is no name, or one is saved under it and `force` is false.
        """
        path = self._path(name)
        if path.exists() and not force:
            raise StudyError([f"{path}: is there already; --force replaces it, or save under another name"])
        return path

    def save(self, name: str, run: Run, *, force: bool = False) -> Path:
        """Write a run, whole or not at all; the file.

        Raises
        ------
        StudyError
            As `check_free`.
        LensclError
            If it cannot be written.
        """
        path, text = self.check_free(name, force=force), as_json(run).encode()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LensclError(f"{self.folder}: cannot be made: {error.strerror}; choose another by --folder") from error
        with whole_file(path, len(text)) as temporary:
            temporary.write_bytes(text)
        return path

    def load(self, name: str) -> Run:
        """Read a run.

        Raises
        ------
        StudyError
            If none has this name, or the file holds no run of this form.
        """
        path = self._path(name)
        if not path.is_file():
            known = self.names()
            listed = f"known are {', '.join(known)}" if known else "none is saved there yet; --save NAME saves one"
            raise StudyError([f'--compare: no run is saved as "{name}" in {self.folder}; {listed}'])
        if path.stat().st_size > _MOST_BYTES:
            raise StudyError([f"{path}: is larger than {_MOST_BYTES} bytes; a saved run is not"])
        try:
            return _RUN.validate_json(path.read_bytes())
        except ValidationError as error:
            first = error.errors(include_url=False, include_input=False)[0]
            where = ".".join(str(part) for part in first["loc"])
            what = f"{where}: {first['msg']}" if where else first["msg"]
            raise StudyError(
                [f"{path}: is no run as this version saves it ({what}); save one anew with --save NAME"]
            ) from None

    def _path(self, name: str) -> Path:
        if not _NAME.fullmatch(name):
            allowed = 'at most 100 letters, digits, ".", "_" and "-", and neither "." nor "-" first'
            raise StudyError([f'"{name[:100]}": is no name for a run; use {allowed}'])
        return self.folder / f"{name}.json"
