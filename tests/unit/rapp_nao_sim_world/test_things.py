"""Things are made of parts, and move as a whole."""

import math

import pytest

from rapp_nao_sim.world import room
from rapp_nao_sim.world.errors import Invalid
from rapp_nao_sim.world.things import things

TEXT = room.FILE.read_text()


def test_shapes_of_one_name_are_one_thing() -> None:
    table = things(room.load())["table"]
    assert (table.kind, len(table.parts), table.home) == ("box", 5, (-1.02, 1.30, 0.465, 0.0))


def test_parts_keep_their_arrangement_when_the_thing_is_moved_and_turned() -> None:
    table = things(room.load())["table"]
    assert table.at(table.home) == [pytest.approx(part.place) for part in table.parts]
    top, leg, *_ = table.at((2.0, 3.0, 0.5, math.pi / 2))
    assert top == pytest.approx((2.0, 3.0, 0.5, math.pi / 2))
    assert leg == pytest.approx((2.0 + 0.21, 3.0 - 0.35, 0.5 - 0.24, math.pi / 2))


def test_what_is_not_placed_is_known_all_the_same() -> None:
    known = things(room.load())
    assert (known["carton"].placed, known["table"].placed) == (False, True)


def test_a_person_has_a_voice_a_face_and_their_height() -> None:
    plan = room.load()
    [anna] = [person for person in plan.people if person.name == "Anna"]
    thing = things(plan)["Anna"]
    assert (thing.kind, thing.voice) == ("person", "en-us+f3")
    solid = [part.shape for part in thing.parts if isinstance(part.shape, room.Cylinder)]
    assert max(shape.centre[2] + shape.height / 2 for shape in solid) == pytest.approx(anna.height)
    [face] = [part.shape for part in thing.parts if isinstance(part.shape, room.Picture)]
    assert face.facing == anna.facing
    assert face.bend > max(shape.radius for shape in solid if shape.centre[2] > face.centre[2] - 0.1)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "Tom"', 'name = "Anna"', "'Anna' is the name of a person and of another"),
        ('name = "Tom"', 'name = "cup"', "'cup' is the name of a person and of another"),
        ('name = "cup"', 'name = ""', "a name is empty"),
        ("height = 1.2", "height = 0.0", "a size of 'Tom' must be greater than 0"),
    ],
)
def test_wrong_people_are_refused(old: str, new: str, said: str) -> None:
    assert old in TEXT
    with pytest.raises(Invalid) as caught:
        room.parse(TEXT.replace(old, new, 1))
    assert said in str(caught.value)
