"""Every driver of the port Voice says, hushes, and refuses languages by name."""

import pytest

from rapp_core.errors import Refused


def test_says(driver):
    driver.robot.voice.say("good morning", "en")
    driver.robot.voice.say("dzień dobry", "pl")


@pytest.mark.parametrize("language", ["tlh", "", "english please"])
def test_refuses_a_language_by_its_name(driver, language):
    with pytest.raises(Refused, match=repr(language)):
        driver.robot.voice.say("nuqneH", language)


def test_hushing_a_quiet_robot_is_no_error(driver):
    driver.robot.voice.hush()
    driver.robot.voice.say("still able to speak", "en")
