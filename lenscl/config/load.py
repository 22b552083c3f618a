"""From a file or a text to a document: everything that can be wrong before the first key is looked at."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from lenscl.config.problems import file_text, study_error
from lenscl.config.toml_faults import toml_problem

MOST_BYTES = 10_000_000  # a study is written by hand, but for the places of an array
# tomllib's time grows with the square of a dotted key's parts, in a header or an inline table too; a study's longest
# key, an axis whose quotes were forgotten, has six
_MOST_PARTS = 16
# Comments and strings of all four kinds, the unclosed ones to where tomllib gives up: no text is gone over twice
_OPAQUE = re.compile(
    "|".join(
        (
            r"#[^\n]*+",
            r'"""(?:[^"\\]++|\\.|"(?!""))*"{0,5}',
            r"'''(?:[^']++|'(?!''))*'{0,5}",
            r'"(?:[^"\\\n]++|\\[^\n])*"?',
            r"'[^'\n]*+'?",
        )
    ),
    re.DOTALL,
)
_LONG_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{_MOST_PARTS}}}")


def read_text(path: Path) -> str:
    """Return the text of a study file.

    Raises
    ------
    StudyError
        If it is missing, no plain file, not readable, too large or not UTF-8.
    """
    where = file_text(path)
    try:
        # Never open a pipe or a device: reading it may not end
        mode = os.stat(path).st_mode
        if stat.S_ISDIR(mode):
            raise study_error([f"{where}: is a folder; name a study file in it"])
        if not stat.S_ISREG(mode):
            raise study_error([f"{where}: is not a plain file; name a study file"])
        with open(path, "rb") as file:
            data = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise study_error([f"{where}: there is no such file"]) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise study_error([f"{where}: cannot be read: {reason}"]) from None
    if len(data) > MOST_BYTES:
        raise study_error([f"{where}: is larger than {MOST_BYTES} bytes; a study file is not"])
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise study_error([f"{where}: is not UTF-8 text (byte {error.start}); a study file is"]) from None


def parse_text(text: str, where: str = "study") -> dict[str, Any]:
    """Return the document of a TOML text.

    Raises
    ------
    StudyError
        If it is too large or not TOML; the message leads with `where`.
    """
    if len(text) > MOST_BYTES:
        raise study_error([f"{where}: is larger than {MOST_BYTES} characters; a study is not"])
    try:
        text.encode()
    except UnicodeEncodeError as error:  # half of a pair of surrogates, which no file holds
        raise study_error([f"{where}: is not Unicode text (character {error.start + 1})"]) from None
    # A quoted part may hold anything, dots and spaces too, so each counts as one letter
    if _LONG_KEY.search(_OPAQUE.sub("q", text)):
        raise study_error([f"{where}: has a key of more than {_MOST_PARTS} parts; a study's keys are shorter"])
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise study_error([f"{where}: is nested too deeply"]) from None
    except ValueError as error:  # TOMLDecodeError, and whole numbers with too many digits
        raise study_error([toml_problem(text, error, where)]) from None
