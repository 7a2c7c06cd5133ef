"""Build and run the peer of Fast DDS. It needs fastddsgen, libfastrtps-dev and g++ (Debian's names)."""

import contextlib
import dataclasses
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import get_type_hints

from cyclonedds.idl import IdlStruct

from undertow.outside.ros2 import messages as ros

SOURCE = Path(__file__).parent / "fast_dds_peer.cpp"
WORDS = {"float64": "double", "int32": "long", "uint32": "unsigned long"}


def idl() -> str:
    """IDL of the messages, made of the classes of CycloneDDS, and of a message of plain bytes."""
    found: dict[type[IdlStruct], str] = {}
    for kind in ros.TOP_LEVEL:
        _describe(kind, found)
    return "\n".join([*found.values(), "@final struct PlainBytes { sequence<octet> numbers; };"])


def _describe(kind: type[IdlStruct], found: dict[type[IdlStruct], str]) -> None:
    if kind in found:
        return
    hints = get_type_hints(kind, include_extras=True)
    members = []
    for field in dataclasses.fields(kind):
        hint = hints[field.name]
        metadata = getattr(hint, "__metadata__", (None,))[0]
        size, inner = "", hint
        if metadata is not None and not isinstance(metadata, str):
            inner = metadata.subtype
            size = f"[{metadata.length}]" if getattr(metadata, "length", None) else "sequence"
        word = _word(inner, found)
        members.append(f"sequence<{word}> {field.name};" if size == "sequence" else f"{word} {field.name}{size};")
    *modules, name = kind.__idl_typename__.split("::")
    body = f"@final struct {name} {{ {' '.join(members)} }};"
    for module in reversed(modules):
        body = f"module {module} {{ {body} }};"
    found[kind] = body


def _word(hint, found) -> str:
    if hint is str:
        return "string"
    if isinstance(hint, type) and issubclass(hint, IdlStruct):
        _describe(hint, found)
        return hint.__idl_typename__
    return WORDS[hint.__metadata__[0]]


def build(folder: Path) -> Path:
    """The program; its types are generated, and it is compiled in some ten seconds or more."""
    (folder / "messages.idl").write_text(idl())
    subprocess.run(["fastddsgen", "-cs", "-replace", "messages.idl"], cwd=folder, check=True, capture_output=True)
    sources = [str(SOURCE), "messages.cxx", "messagesPubSubTypes.cxx"]
    libraries = ["-lfastrtps", "-lfastcdr"]
    flags = ["g++", "-std=c++17", "-O1", "-I.", *sources, "-o", "peer", *libraries]
    subprocess.run(flags, cwd=folder, check=True, capture_output=True)
    return folder / "peer"


@contextlib.contextmanager
def running(program: Path, domain: int, mode: str) -> Iterator[subprocess.Popen[str]]:
    """The program, ready; it ends with the context."""
    process = subprocess.Popen(
        [str(program), str(domain), mode], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )
    assert process.stdin is not None and process.stdout is not None
    try:
        assert process.stdout.readline() == "ready\n"
        yield process
    finally:
        process.stdin.close()
        process.wait(20)
        process.stdout.close()
