"""A channel whose ends never wait for each other."""

from __future__ import annotations

import pytest

from airground.link.channel import Receiver, Sender


@pytest.fixture
def receiver() -> Receiver:
    return Receiver()


def test_it_listens_to_this_machine_only(receiver: Receiver) -> None:
    assert receiver.address.startswith("tcp://127.0.0.1:")
    receiver.close()


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
