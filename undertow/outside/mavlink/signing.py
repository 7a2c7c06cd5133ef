"""Signing of MAVLink 2: the key from a file, and what pymavlink needs beside its own signing.

Source: mavlink.io/en/guide/message_signing.html. A signature is the first 48 bits of SHA-256 of key and message, which
holds a time that only grows: an old message is refused.
"""

import hashlib
import stat
import time
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from undertow.core.errors import BadInput

_KEY = 32  # bytes
_LARGEST = 4096  # bytes of a file
_PER_SECOND = 100_000  # units of the time of a signature, which is 10 us
_EPOCH = 1_420_070_400  # 2015-01-01, s of Unix time
_AHEAD = (
    _PER_SECOND  # by which datagrams that are signed in advance are dated ahead: more is never sent before new ones
)


def read_key(path: str | Path) -> bytes:
    """The key of 32 bytes in a file: the bytes themselves, or SHA-256 of a passphrase, as ground stations make it.

    Args:
        path: of a file that only its owner may read: 32 bytes that are no text, or one line of text.

    Raises:
        BadInput: it cannot be read, others may read it, or it holds neither.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            mode = path.stat().st_mode
            contents = file.read(_LARGEST + 1)
    except OSError as error:
        raise BadInput("--signing-key", "be a file that can be read", f"{path}: {error.strerror}") from None
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        must = "be a file that only its owner may read"
        hint = f"Run: chmod 600 {path}"
        raise BadInput("--signing-key", must, f"{path} with mode {stat.S_IMODE(mode):o}", hint=hint)
    passphrase = contents.rstrip(b"\r\n")
    if passphrase and len(contents) <= _LARGEST and _is_line(passphrase):
        return hashlib.sha256(passphrase).digest()
    if len(contents) == _KEY:
        return contents
    must = f"hold {_KEY} bytes, or a passphrase in one line"
    raise BadInput("--signing-key", must, f"{path} with {min(len(contents), _LARGEST)} bytes or more")


def _is_line(passphrase: bytes) -> bool:
    try:
        return passphrase.decode().isprintable()
    except UnicodeDecodeError:
        return False


def signing_of(key: bytes) -> Any:
    """State of pymavlink for a key, with which messages are signed; its time is that of the machine."""
    state: Any = mavlink.MAVLinkSigning()
    state.secret_key, state.sign_outgoing = key, True
    state.timestamp = timestamp_now()
    return state


def timestamp_now() -> int:
    """Time of a signature that is made now."""
    return int((max(time.time(), _EPOCH) - _EPOCH) * _PER_SECOND)


def ahead_of(state: Any, times: int = 1) -> int:
    """Time of signatures of messages that may be sent later, in place of others that were sent meanwhile.

    What is dated ahead twice is newer than they.
    """
    return max(state.timestamp, timestamp_now()) + times * _AHEAD


class SignedParser(mavlink.MAVLink):
    """Accepts signed messages only.

    pymavlink takes the time of a message with a wrong signature for that of its sender: one from anybody, dated ahead,
    would shut the sender out. Here it leaves no trace.

    Args:
        state: of `signing_of`, shared by all parsers of a link.
    """

    def __init__(self, state: Any):
        super().__init__(None)
        self.signing = state

    def check_signature(self, msgbuf: bytearray, srcSystem: int, srcComponent: int) -> bool:
        """Whether a message is signed with the key, and newer than the last one of its sender."""
        times = self.signing.stream_timestamps
        sender = (msgbuf[-13], srcSystem, srcComponent)
        before = times.get(sender)
        if super().check_signature(msgbuf, srcSystem, srcComponent):
            return True
        if before is None:
            times.pop(sender, None)
        else:
            times[sender] = before
        return False
