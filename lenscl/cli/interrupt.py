"""Ctrl-C during long work: the first asks to stop, the second ends the process at once.

Python runs its signal handlers between two steps of its main thread, and so not while a driver is busy inside one call.
A thread of our own therefore reads the signals from a socket, which Python writes to from the signal itself.
"""

from __future__ import annotations

import os
import signal
import socket
import threading
from types import FrameType, TracebackType
from typing import Self

import click

_INTERRUPTED = 130


class Interrupt:
    """While entered, Ctrl-C sets a flag; a second one ends the process with exit code 130."""

    def __init__(self) -> None:
        self._asked = threading.Event()

    def is_set(self) -> bool:
        """Whether Ctrl-C was pressed."""
        return self._asked.is_set()

    def __enter__(self) -> Self:
        self._ours, theirs = socket.socketpair()
        theirs.setblocking(False)
        self._theirs = theirs
        self._old_handler = signal.signal(signal.SIGINT, _let_the_thread_do_it)
        self._old_fd = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._watch, name="lenscl-interrupt", daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        signal.set_wakeup_fd(self._old_fd)
        signal.signal(signal.SIGINT, self._old_handler)
        self._theirs.close()  # ends the thread, which then reads nothing

    def _watch(self) -> None:
        with self._ours:
            while arrived := self._ours.recv(1):
                if arrived[0] != signal.SIGINT:
                    continue
                if self._asked.is_set():
                    os._exit(_INTERRUPTED)
                self._asked.set()
                click.echo("Stopping: finishing what is on its way. Ctrl-C again quits at once.", err=True)


def _let_the_thread_do_it(number: int, frame: FrameType | None) -> None:
    """Keep Python from raising KeyboardInterrupt."""
