"""Processes that make frames end with an error, and leave others alone."""

import multiprocessing
import time

import pytest

from sim.recording.frame_pool import FrameWorkers


def _fail_with_a_worker() -> None:
    with FrameWorkers(1):
        assert len(multiprocessing.active_children()) == 2
        raise ValueError("wrong")


def test_an_error_ends_the_processes_that_make_frames_and_no_others() -> None:
    other = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(600,))
    other.start()
    try:
        with pytest.raises(ValueError, match="wrong"):
            _fail_with_a_worker()
        assert multiprocessing.active_children() == [other]
    finally:
        other.kill()
        other.join()
