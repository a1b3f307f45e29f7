"""Settings of the link."""

import pytest

from rapp_hop.errors import Invalid
from rapp_link.config import Config, read


def test_the_quota_is_that_of_the_option_then_of_the_environment_then_a_gibibyte() -> None:
    assert read(["--quota", "5"], {"RAPP_QUOTA": "6"}).quota == 5
    assert read([], {"RAPP_QUOTA": "6"}).quota == 6
    assert read(["--quota", "0"], {}).quota == 0
    assert read([], {}).quota == Config.quota == 2**30


@pytest.mark.parametrize("text", ["-1", "1.5", "much", "1GB"])
def test_a_quota_that_is_no_number_of_bytes_is_refused(text: str) -> None:
    with pytest.raises(Invalid, match="give a number of bytes"):
        read([f"--quota={text}"], {})
