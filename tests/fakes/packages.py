"""HZ packages for tests: right ones, and tars with whatever header a test wants."""

import gzip
import io
import json
import tarfile
from pathlib import Path
from typing import Any


def manifest(name: str = "hello", version: str = "1.0.0", **rapp: Any) -> dict[str, Any]:
    return {
        "name": name,
        "version": version,
        "description": "Says hello",
        "rapp": {
            "agent": "dynamic",
            "entry": "agent.py",
            "runtime": "python3",
            "keywords": {"en": [name.replace("_", " ")]},
            "sentences": {"en": [f"say {name} to me"]},
            "permissions": {"core": ["rapp_say"], "cloud": ["profile"]},
            "partner": None,
            "needs": {"robot": ["nao"], "api": ">=1.0"},
            **rapp,
        },
    }


def source_folder(folder: Path, name: str = "hello", version: str = "1.0.0", program: str = "pass\n", **rapp: Any) -> Path:
    place = folder / f"{name}-{version}"
    place.mkdir(parents=True)
    (place / "package.json").write_text(json.dumps(manifest(name, version, **rapp)))
    (place / "agent.py").write_text(program)
    return place


def file_member(name: str, data: bytes = b"x", mode: int = 0o644, **fields: Any) -> tuple[tarfile.TarInfo, bytes]:
    info = tarfile.TarInfo(name)
    info.size, info.mode = len(data), mode
    for field, value in fields.items():
        setattr(info, field, value)
    return info, data


def folder_member(name: str) -> tuple[tarfile.TarInfo, bytes]:
    return file_member(name, b"", 0o755, type=tarfile.DIRTYPE)


def right_members(name: str = "hello") -> list[tuple[tarfile.TarInfo, bytes]]:
    return [
        folder_member(name),
        file_member(f"{name}/package.json", json.dumps(manifest(name)).encode()),
        file_member(f"{name}/agent.py", b"pass\n"),
    ]


def tar_bytes(members: list[tuple[tarfile.TarInfo, bytes]], tar_format: int = tarfile.USTAR_FORMAT) -> bytes:
    """A tar written header by header, so that sizes and types may lie."""
    out = io.BytesIO()
    for info, data in members:
        out.write(info.tobuf(tar_format, "utf-8", "surrogateescape"))
        out.write(data + bytes(-len(data) % 512))
    out.write(bytes(1024))
    return out.getvalue()


def packed(members: list[tuple[tarfile.TarInfo, bytes]], tar_format: int = tarfile.USTAR_FORMAT) -> io.BytesIO:
    return io.BytesIO(gzip.compress(tar_bytes(members, tar_format), mtime=0))
