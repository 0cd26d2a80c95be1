"""A one-way channel over a socket of this user alone, whose sender never blocks.

The receiver acknowledges each processed message. The sender can so drop messages instead of
filling the memory. If one side dies, the other one only receives nothing more."""

from __future__ import annotations

import contextlib
from pathlib import Path

import zmq

from airground.core.scratch_folder import ScratchFolder

SOCKET = "link"
"""File name of the socket."""
LINGER_MS = 5000
"""Longest time that the last messages may take to leave a closing channel [ms]."""


class Sender:
    """The end that sends, with at most `capacity` messages under way at a time.

    Attributes:
        under_way: Messages sent and not yet acknowledged.
        most_under_way: Largest value of `under_way` so far.
    """

    def __init__(self, address: str, capacity: int) -> None:
        self._socket: zmq.Socket[bytes] = zmq.Context.instance().socket(zmq.DEALER)
        # The bound is `capacity`: the last message of all must get through beyond it.
        self._socket.set_hwm(0)
        self._socket.setsockopt(zmq.LINGER, LINGER_MS)
        self._socket.connect(address)
        self._capacity = capacity
        self.under_way = self.most_under_way = 0

    def has_room(self) -> bool:
        """Whether one more message may be sent."""
        while self._socket.poll(0, zmq.POLLIN):
            self._socket.recv(zmq.NOBLOCK)
            self.under_way -= 1
        return self.under_way < self._capacity

    def send(self, parts: list[bytes]) -> None:
        """Hand a message over to be sent; returns at once."""
        self._socket.send_multipart(parts, zmq.NOBLOCK)
        self.under_way += 1
        self.most_under_way = max(self.most_under_way, self.under_way)

    def close(self) -> None:
        """Close the socket; messages already sent still leave."""
        self._socket.close()


class Receiver:
    """The end that receives; bound to a socket in a folder that only this user may enter.

    Attributes:
        address: Address for the sender.
    """

    def __init__(self) -> None:
        self._socket: zmq.Socket[bytes] = zmq.Context.instance().socket(zmq.DEALER)
        self._socket.set_hwm(0)
        self._socket.setsockopt(zmq.LINGER, 0)
        self._folder = _private_folder()
        self.address = f"ipc://{self._folder.path}/{SOCKET}"
        self._socket.bind(self.address)

    def wait(self, timeout_s: float) -> bool:
        """Wait until a message is there; False where none came in time."""
        return bool(self._socket.poll(max(0, round(timeout_s * 1e3)), zmq.POLLIN))

    def receive(self) -> list[bytes] | None:
        """The next message, None while there is none."""
        if not self.wait(0):
            return None
        return self._socket.recv_multipart(zmq.NOBLOCK)

    def acknowledge(self) -> None:
        """Report one more message as processed."""
        with contextlib.suppress(zmq.Again):  # the sender is gone
            self._socket.send(b"", zmq.NOBLOCK)

    def close(self) -> None:
        """Close the socket and remove its folder."""
        self._socket.close()
        self._folder.close()


def _private_folder() -> ScratchFolder:
    """A new folder of mode 0700, whose name is short enough for the name of a socket."""
    folder = ScratchFolder()
    if len(f"{folder.path}/{SOCKET}".encode()) <= zmq.IPC_PATH_MAX_LEN:
        return folder
    folder.close()
    return ScratchFolder(Path("/tmp"))
