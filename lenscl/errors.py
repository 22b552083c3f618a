"""Errors a user can act on. Every one says what was expected and what to do about it."""

from __future__ import annotations

from collections.abc import Iterable


class LensclError(Exception):
    """Base of every error this program raises on purpose.

    Attributes
    ----------
    exit_code : int
        What the command line returns for it: 1 an error, 2 the request or the study is wrong, 4 no usable device.
    """

    exit_code = 1


class StudyError(LensclError):
    """A study or a request that cannot be carried out as written.

    Parameters
    ----------
    problems : iterable of str
        Every problem found, each led by its TOML key (or file), so that all can be mended at once.
    """

    exit_code = 2

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[type[StudyError], tuple[tuple[str, ...]]]:
        """Copy the problems, not their text, to another process."""
        return type(self), (self.problems,)


class ExpressionError(LensclError):
    """An expression that is refused, with the column where reading it stopped.

    Parameters
    ----------
    message : str
        What is wrong and what is allowed instead.
    text : str
        The expression as given.
    column : int
        Position in `text`, counted from 0.
    """

    exit_code = 2
    _EXCERPT = 60  # characters of a long expression shown on either side of the fault

    def __init__(self, message: str, text: str, column: int) -> None:
        self.message, self.text, self.column = message, text, column
        start = max(0, column - self._EXCERPT)
        excerpt = text[start : column + self._EXCERPT].replace("\n", " ")
        super().__init__(f"column {column + 1}: {message}\n  {excerpt}\n  {' ' * (column - start)}^")

    def __reduce__(self) -> tuple[type[ExpressionError], tuple[str, str, int]]:
        """Copy the parts, not the text made of them, to another process."""
        return type(self), (self.message, self.text, self.column)


class ImageError(LensclError):
    """A picture that cannot be read or written; the message leads with its file."""


class DiskFullError(ImageError):
    """A picture that cannot be written because its disk is full; others on that disk cannot be, either."""


class NoDeviceError(LensclError):
    """No usable OpenCL device; the message says how to get one."""

    exit_code = 4


class BuildError(LensclError):
    """An OpenCL program that its driver refused; the message carries the driver's log."""


class TraceError(LensclError):
    """A trace that cannot be carried out on this device as asked."""
