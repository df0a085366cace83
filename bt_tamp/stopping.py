"""Stopping a long command from outside."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread

STOPPING = (signal.SIGINT, signal.SIGTERM)


def stop_on_signals() -> None:
    """From now on Ctrl-C and SIGTERM alike raise KeyboardInterrupt, also in a shell's background job."""
    for number in STOPPING:
        signal.signal(number, signal.default_int_handler)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Inside the block Ctrl-C and SIGTERM are without effect: for what is short and must be whole."""
    if current_thread() is not main_thread():  # Neither arrives here.
        yield
        return
    kept = {number: signal.signal(number, signal.SIG_IGN) for number in STOPPING}
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
