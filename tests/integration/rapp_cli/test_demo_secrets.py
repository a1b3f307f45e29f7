"""The processes of `./rapp demo`: each secret of the user's environment reaches only the one that it is for."""

import argparse
import asyncio
import os
from pathlib import Path

import pytest

from fakes.processes import descendants, environment, words
from rapp_cli.demo.config import add_options, read
from rapp_cli.demo.system import running_system

SECRETS = {"RAPP_CLOUD_PASSPHRASE": "of the keys of the store", "RAPP_SMTP_PASSWORD": "of the mail account"}


async def told(folder: Path) -> dict[str, set[str]]:
    """For each secret the modules of the processes that have it in their environment."""
    parser = argparse.ArgumentParser()
    add_options(parser)
    config = read(parser.parse_args(["show-around", "--silent", "--folder", str(folder)]), {})
    async with running_system(config, rapps=()):
        found = {pid: environment(pid) for pid in descendants(os.getpid())}
        return {name: {words(pid)[2] for pid, env in found.items() if secret.encode() in env} for name, secret in SECRETS.items()}


def test_the_passphrase_reaches_the_platform_alone_and_the_mail_password_the_link(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, secret in SECRETS.items():
        monkeypatch.setenv(name, secret)
    found = asyncio.run(told(tmp_path))
    assert found["RAPP_CLOUD_PASSPHRASE"] == {"rapp_cloud"}
    assert found["RAPP_SMTP_PASSWORD"] <= {"rapp_link", "rapp_core.robot_processes"}
    assert "rapp_link" in found["RAPP_SMTP_PASSWORD"]
