"""Stopping a long command from outside."""

import signal


def stop_on_signals() -> None:
    """From now on Ctrl-C and SIGTERM alike raise KeyboardInterrupt, also in a shell's background job."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
