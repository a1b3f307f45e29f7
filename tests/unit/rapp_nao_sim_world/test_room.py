"""The room file is checked, and what is wrong with one is said."""

from pathlib import Path

import pytest

from rapp_nao_sim.world import room
from rapp_nao_sim.world.errors import Invalid

TEXT = room.FILE.read_text()


def test_our_own_room_has_all_that_is_promised() -> None:
    plan = room.load()
    assert len(plan.walls) >= 4
    assert {"qr", "face"} <= {picture.kind for picture in plan.pictures}
    assert any(item.lamp for item in plan.cylinders)
    assert any(box.name == "table" for box in plan.boxes)
    assert plan.robot.posture == "Stand"


def test_values_arrive_with_their_keys() -> None:
    plan = room.parse(TEXT)
    assert plan.walls[0].start == (-1.60, 1.85)
    assert plan.walls[2].bottom == 1.42
    assert plan.floor.size == (7.0, 7.0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[door]", "[dor]", "unknown part 'dor'"),
        ("angle = -0.62", "angel = -0.62", "[door] has an unknown key 'angel'"),
        ("angle = -0.62", "", "'angle' of [door] is missing"),
        ("angle = -0.62", 'angle = "ajar"', "'angle' of [door] must be made of numbers"),
        ("angle = -0.62", "angle = nan", "'angle' of [door] must be made of numbers"),
        ("hinge = [0.34, 1.80]", "hinge = [0.34]", "'hinge' of [door] must be a list of 2 numbers"),
        ("width = 0.62", "width = -0.62", "a size of [door] must be greater than 0"),
        ("from = [-1.60, 1.85]", "from = [0.34, 1.85]", "[[walls]] number 1 must be greater than 0"),
        ('kind = "face"', 'kind = "ghost"', "unknown picture 'ghost'"),
        ("lamp = 0.9 ", "lamp = 9 ", "'lamp' of [light] must be from 0 to 1"),
        ("lamp = true", "lamp = 1", "must be true or false"),
        ('name = "book"', "name = 7", "must be a text"),
        ("[floor]", "[floor", "cannot read the room"),
        ("field_of_view = 0.76", "field_of_view = 76.0", "field_of_view"),
    ],
)
def test_a_wrong_file_is_refused_with_the_place(old: str, new: str, said: str) -> None:
    assert old in TEXT
    with pytest.raises(Invalid) as caught:
        room.parse(TEXT.replace(old, new, 1))
    assert said in str(caught.value)
    assert str(caught.value).startswith("cannot ")


def test_a_missing_part_is_named() -> None:
    with pytest.raises(Invalid, match=r"\[floor\] is missing"):
        room.parse("")


def test_a_single_table_where_a_list_is_wanted_is_refused() -> None:
    with pytest.raises(Invalid, match=r"\[\[walls\]\]"):
        room.parse(TEXT[: TEXT.index("[[walls]]")] + "[walls]\nheight = 1.0\n")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(Invalid, match=r"nowhere\.toml"):
        room.load(tmp_path / "nowhere.toml")
