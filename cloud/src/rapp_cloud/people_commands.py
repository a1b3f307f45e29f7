"""`rapp_cloud person …`: the persons of a home, their contacts, and whom each robot serves."""

import argparse
from collections.abc import Callable
from dataclasses import replace

from rapp_cloud.memory import Memory
from rapp_cloud.people import LANGUAGE, Person
from rapp_cloud.profiles import Contact, Profile, parse_profile
from rapp_hop.errors import Refused

Words = argparse.Namespace
Do = Callable[[Memory, Words], str]
"""Returns what to print."""


def add_actions(parser: argparse.ArgumentParser) -> None:
    """Add what can be done; the parsed options have it as `do`, and as `deed` and `subject` for the audit log."""
    actions = parser.add_subparsers(required=True, metavar="ACTION")

    def action(name: str, about: str, do: Do, *words: str) -> argparse.ArgumentParser:
        found: argparse.ArgumentParser = actions.add_parser(name, help=about, description=about)
        for word in words:
            found.add_argument(word, metavar=word.upper())
        found.set_defaults(do=do, deed=f"person {name}")
        return found

    add = action("add", "Take a person in, with an account (a-z, 0-9, _).", _add, "person")
    add.add_argument("--name", required=True, help="what they are called")
    add.add_argument("--language", default=LANGUAGE, help="what they speak, in two letters (%(default)s)")
    add.add_argument("--robot", action="append", default=[], help="that serves them; may be repeated")
    edit = action("edit", "Change name or language.", _edit, "person")
    edit.add_argument("--name", help="what they are called")
    edit.add_argument("--language", help="what they speak, in two letters")
    show = action("show", "Show everybody, or one person with contacts.", _show)
    show.add_argument("person", nargs="?", metavar="PERSON")
    action("remove", "Forget a person, with account and tokens.", _remove, "person")
    action("contact", "Let a person write to somebody, or change the address.", _contact, "person", "contact", "address")
    action("forget", "Take a contact away.", _forget, "person", "contact")
    serve = action("serve", "Say whom a robot serves, the one it takes to be present first.", _serve, "robot")
    serve.add_argument("persons", nargs="*", metavar="PERSON")


def _add(memory: Memory, words: Words) -> str:
    profile = parse_profile({"name": words.name, "language": words.language})
    memory.people.add(words.person, profile, words.robot)
    return f"{words.person} is here"


def _edit(memory: Memory, words: Words) -> str:
    given = {name: value for name in ("name", "language") if (value := getattr(words, name)) is not None}
    return _line(words.person, memory.people.edit(words.person, lambda profile: replace(profile, **given)))


def _show(memory: Memory, words: Words) -> str:
    known: list[tuple[Person, list[str]]] = memory.people.list()
    if not known:
        return "nobody is here yet: person add takes somebody in"
    if words.person is None:
        return "\n".join(f"{_line(one.person, one.profile):<50} {' '.join(robots)}".rstrip() for one, robots in known)
    for one, robots in known:
        if one.person == words.person:
            contacts = [f"  {contact.name:<24} {contact.address}" for contact in one.profile.contacts]
            return "\n".join([_line(one.person, one.profile), f"  served by {', '.join(robots) or 'no robot'}", *contacts])
    raise Refused(f"cannot find the person {words.person[:70]!r}: add them first")


def _remove(memory: Memory, words: Words) -> str:
    if not memory.people.remove(words.person):
        raise Refused(f"cannot find the person {words.person[:70]!r}: nothing to remove")
    return f"{words.person} is forgotten"


def _contact(memory: Memory, words: Words) -> str:
    def change(profile: Profile) -> Profile:
        new, known = Contact(words.contact, words.address), [one.name for one in profile.contacts]
        if words.contact not in known:
            return replace(profile, contacts=(*profile.contacts, new))
        return replace(profile, contacts=tuple(new if one.name == new.name else one for one in profile.contacts))

    memory.people.edit(words.person, change)
    return f"{words.person} may write to {words.contact}"


def _forget(memory: Memory, words: Words) -> str:
    def change(profile: Profile) -> Profile:
        left = tuple(one for one in profile.contacts if one.name != words.contact)
        if left == profile.contacts:
            raise Refused(f"cannot find the contact {words.contact[:70]!r} of {words.person}: person show lists them")
        return replace(profile, contacts=left)

    memory.people.edit(words.person, change)
    return f"{words.person} writes to {words.contact} no more"


def _serve(memory: Memory, words: Words) -> str:
    persons = list(dict.fromkeys(words.persons))
    memory.people.serve(words.robot, persons)
    return f"{words.robot} serves {', '.join(persons) or 'nobody'}"


def _line(person: str, profile: Profile) -> str:
    return f"{person:<24} {profile.name:<16} {profile.language}"
