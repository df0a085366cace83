"""Output that nobody wants: libraries' greetings on stderr, and what is said into a closed pipe."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO


@contextmanager
def quiet_imports() -> Iterator[None]:
    """What is written to the process's stderr inside the block is lost; exceptions are not."""
    sys.stderr.flush()
    try:
        kept = os.dup(2)
    except OSError:
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        sys.stderr.flush()
        os.dup2(kept, 2)
        os.close(nowhere)
        os.close(kept)


@contextmanager
def outliving_a_closed_pipe(stream: TextIO | None = None) -> Iterator[None]:
    """Inside the block a stream (None: stdout) may turn out to be a closed pipe (`| head`): from then on it leads
    nowhere."""
    into = stream or sys.stdout
    try:
        yield
        into.flush()
    except BrokenPipeError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, into.fileno())
        os.close(nowhere)
