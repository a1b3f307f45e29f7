"""Every driver of the port Ears hears the words of its vocabulary, and nothing before or after being subscribed."""

import pytest

from rapp_core.errors import CoreError
from rapp_core.ports import Word

THRESHOLD = 0.4  # a less probable word counts as unrecognised (paper section V.A.2)


def words(items):
    return [item.text for item in items if isinstance(item, Word) and item.probability >= THRESHOLD]


def hear(driver, heard, text):
    """Say it and give the ears their time; they tell from a thread of their own."""
    driver.person_says(text)
    for _ in range(50):
        if text in words(heard):
            break
        driver.wait(0.02)


def test_hears_a_word_of_the_vocabulary_with_its_probability(driver):
    heard = []
    driver.robot.ears.set_vocabulary(["e-mail", "clock"])
    driver.robot.ears.subscribe(heard.append)
    hear(driver, heard, "e-mail")
    driver.robot.ears.unsubscribe()
    assert words(heard) == ["e-mail"]
    assert all(0.0 <= item.probability <= 1.0 for item in heard if isinstance(item, Word))


def test_does_not_hear_a_word_outside_of_the_vocabulary(driver):
    heard = []
    driver.robot.ears.set_vocabulary(["e-mail"])
    driver.robot.ears.subscribe(heard.append)
    hear(driver, heard, "thunderstorm")
    hear(driver, heard, "e-mail")
    driver.robot.ears.unsubscribe()
    assert words(heard) == ["e-mail"]


def test_the_vocabulary_can_change_while_listening(driver):
    heard = []
    driver.robot.ears.set_vocabulary(["e-mail"])
    driver.robot.ears.subscribe(heard.append)
    driver.robot.ears.set_vocabulary(["clock"])
    hear(driver, heard, "clock")
    driver.robot.ears.unsubscribe()
    assert words(heard) == ["clock"]


def test_hears_nothing_when_not_subscribed(driver):
    heard, later = [], []
    driver.robot.ears.set_vocabulary(["e-mail", "clock"])
    driver.robot.ears.subscribe(heard.append)
    driver.robot.ears.unsubscribe()
    hear(driver, heard, "e-mail")
    driver.robot.ears.subscribe(later.append)
    hear(driver, later, "clock")
    driver.robot.ears.unsubscribe()
    assert (words(heard), words(later)) == ([], ["clock"])


def test_unsubscribing_twice_is_no_error(driver):
    driver.robot.ears.unsubscribe()
    driver.robot.ears.unsubscribe()


@pytest.mark.parametrize("vocabulary", [["e-mail", " "]])
def test_a_vocabulary_of_no_use_is_an_error_and_the_next_one_works(driver, vocabulary):
    with pytest.raises(CoreError):
        driver.robot.ears.set_vocabulary(vocabulary)
    test_hears_a_word_of_the_vocabulary_with_its_probability(driver)
