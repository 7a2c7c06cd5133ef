"""A watchdog: a process of its own that stops the thrusters where the controller no longer can.

A controller that is killed, runs out of memory, crashes in compiled code or stands still sends no last command. The
watchdog shares its socket and holds the datagrams that stop the vehicle. It sends them when there has been no sign of
life for `timeout`, again and again until there is one, and when the controller is gone without having said that it is
done. No signal that ends a controller ends its watchdog: it is in a session of its own, and ends with its pipe.

Run as a script, this file is that process: it imports the standard library only, and is there within milliseconds.
"""

import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

_AGAIN = 0.1  # s between two times that the datagrams are sent while there is no sign of life
_AT_THE_END = 5  # times that they are sent where the controller is gone: any of them may be lost
_DONE = "done"


class Watchdog:
    """Watches this process from the first `hold` on.

    Args:
        connection: a UDP socket, from which the datagrams are sent.
        timeout: s without a sign of life.
    """

    def __init__(self, connection: socket.socket, timeout: float):
        number = connection.fileno()
        command = [sys.executable, "-I", "-S", __file__, str(number), repr(timeout)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, pass_fds=[number], start_new_session=True)
        assert self._process.stdin is not None
        self._pipe = self._process.stdin.fileno()
        os.set_blocking(self._pipe, False)

    def __enter__(self) -> "Watchdog":
        return self

    def __exit__(self, *error: Any) -> None:
        self.done()

    def hold(self, address: tuple[str, int], datagrams: Sequence[bytes]) -> None:
        """A sign of life, with what stops the vehicle from now on."""
        self._tell([list(address), [datagram.hex() for datagram in datagrams]])

    def alive(self) -> None:
        """A sign of life."""
        self._tell(None)

    def done(self) -> None:
        """The vehicle has its last command; the watchdog ends."""
        if self._process.stdin is None or self._process.stdin.closed:
            return
        self._tell(_DONE)
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)

    def _tell(self, what: Any) -> None:
        line = json.dumps(what).encode() + b"\n"
        with contextlib.suppress(OSError):  # full, or somebody ended the watchdog: control goes on
            os.write(self._pipe, line)


def watch(connection: socket.socket, timeout: float, pipe: int) -> None:
    """What the process does: read lines until there are none any more."""
    address, datagrams, unread = None, [], b""
    while True:
        patience = timeout
        while not select.select([pipe], [], [], patience)[0]:
            _send(connection, address, datagrams)
            patience = _AGAIN
        read = os.read(pipe, 65536)
        if not read:  # the controller is gone
            for _ in range(_AT_THE_END):
                _send(connection, address, datagrams)
                time.sleep(_AGAIN / _AT_THE_END)
            return
        *lines, unread = (unread + read).split(b"\n")
        for line in lines:
            try:
                message = json.loads(line)
            except ValueError:  # cut, as the pipe was full
                continue
            if message == _DONE:
                return
            if message is not None:
                address = tuple(message[0])
                datagrams = [bytes.fromhex(encoded) for encoded in message[1]]


def _send(connection: socket.socket, address: Any, datagrams: Sequence[bytes]) -> None:
    for datagram in datagrams if address else ():
        with contextlib.suppress(OSError):
            connection.sendto(datagram, address)


if __name__ == "__main__":
    for ending in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(ending, signal.SIG_IGN)
    watch(socket.socket(fileno=int(sys.argv[1])), float(sys.argv[2]), sys.stdin.fileno())
