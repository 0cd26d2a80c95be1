"""A channel whose ends never wait for each other."""

from __future__ import annotations

import stat
import tempfile
from pathlib import Path

import pytest

from airground.link.channel import Receiver, Sender


@pytest.fixture
def receiver() -> Receiver:
    return Receiver()


def test_only_this_user_reaches_it(receiver: Receiver) -> None:
    folder = Path(receiver.address.removeprefix("ipc://")).parent
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    receiver.close()
    assert not folder.exists()


def test_a_long_folder_of_temporary_files_does_no_harm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    long = tmp_path / ("long" * 30)
    long.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(long))
    receiver = Receiver()
    sender = Sender(receiver.address, capacity=1)
    sender.send([b"here"])
    assert receiver.wait(5)
    assert receiver.receive() == [b"here"]
    sender.close()
    receiver.close()
    assert list(long.iterdir()) == []


def test_a_full_channel_has_no_room_until_something_is_acknowledged(receiver: Receiver) -> None:
    sender = Sender(receiver.address, capacity=2)
    for n in range(2):
        assert sender.has_room()
        sender.send([b"%d" % n, b"body"])
    assert not sender.has_room()
    assert receiver.wait(5)
    assert receiver.receive() == [b"0", b"body"]
    receiver.acknowledge()
    assert _soon(sender)
    sender.close()
    assert receiver.wait(5)
    assert receiver.receive() == [b"1", b"body"]
    assert receiver.receive() is None
    receiver.close()


def test_a_receiver_that_is_gone_does_not_block_the_sender(receiver: Receiver) -> None:
    sender = Sender(receiver.address, capacity=3)
    receiver.close()
    sent = 0
    for _ in range(10):
        if sender.has_room():
            sender.send([b"lost"])
            sent += 1
    assert sent == sender.most_under_way == 3
    sender._socket.close(linger=0)


def test_a_sender_that_is_gone_is_silence(receiver: Receiver) -> None:
    sender = Sender(receiver.address, capacity=3)
    sender.send([b"last words"])
    sender.close()
    assert receiver.wait(5)
    assert receiver.receive() == [b"last words"]
    receiver.acknowledge()
    assert not receiver.wait(0.05)
    receiver.close()


def _soon(sender: Sender) -> bool:
    for _ in range(100):
        if sender.has_room():
            return True
        sender._socket.poll(50)
    return False
