"""Every driver of the port Recorder leaves a complete Ogg file, and can start again after anything."""

import pytest

from rapp_core.errors import Refused


def test_records_an_ogg_file(driver):
    path = driver.folder / "recordings" / "one.ogg"
    driver.robot.recorder.start(path)
    driver.wait(0.3)
    driver.robot.recorder.stop()
    assert path.read_bytes()[:4] == b"OggS"


def test_starting_anew_ends_the_recording_before(driver):
    first, second = driver.folder / "first.ogg", driver.folder / "second.ogg"
    driver.robot.recorder.start(first)
    driver.wait(0.2)
    driver.robot.recorder.stop()
    driver.robot.recorder.start(second)
    driver.wait(0.2)
    driver.robot.recorder.stop()
    assert first.read_bytes()[:4] == second.read_bytes()[:4] == b"OggS"


def test_stopping_an_idle_recorder_is_no_error(driver):
    driver.robot.recorder.stop()
    driver.robot.recorder.stop()


def test_a_quiet_room_is_below_the_usual_limit(driver):
    driver.wait(0.3)
    assert 0.0 <= driver.robot.recorder.energy() < 1700.0


def test_what_cannot_be_written_is_told_while_the_time_passes(driver):
    taken = driver.folder / "taken.ogg"
    taken.mkdir()
    driver.robot.recorder.start(taken)
    with pytest.raises(Refused):
        for _ in range(100):
            driver.robot.recorder.check()
            driver.wait(0.05)
    driver.robot.recorder.stop()


def test_what_was_not_looked_at_is_told_at_the_end(driver):
    taken = driver.folder / "also-taken.ogg"
    taken.mkdir()
    driver.robot.recorder.start(taken)
    with pytest.raises(Refused):
        driver.robot.recorder.stop()
    driver.robot.recorder.stop()
