"""Bytes of datagrams from MAVLink messages, and messages from bytes, with or without signatures."""

from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from undertow.outside.mavlink.signing import SignedParser, ahead_of, signing_of, timestamp_now

_UNSIGNED = "Invalid signature"  # pymavlink's words for a message without a signature or with a wrong one


class MessageCodec:
    """Packs our messages, and parses those of others.

    Args:
        system, component: our ids.
        key: 32 bytes with which messages are signed, and must be; None for no signatures.

    Attributes:
        counts: messages that were refused, by reason.
    """

    def __init__(self, system: int, component: int, key: bytes | None = None):
        self._packer: Any = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self._signing = None if key is None else signing_of(key)
        if self._signing is not None:
            self._packer.signing = self._signing
        self.counts = {"unsigned": 0, "wrongly signed": 0}

    def packed(self, messages: list[Any]) -> list[bytes]:
        """Messages as datagrams, numbered on."""
        datagrams = []
        if self._signing is not None:
            self._signing.timestamp = max(self._signing.timestamp, timestamp_now())
        for message in messages:
            datagrams.append(message.pack(self._packer))
            self._packer.seq = (self._packer.seq + 1) % 256
        return datagrams

    def packed_ahead(self, messages: list[Any]) -> list[bytes]:
        """As `packed`, for datagrams that a watchdog sends later, instead of what is sent meanwhile."""
        if self._signing is None:
            return self.packed(messages)
        before = self._signing.timestamp
        self._signing.timestamp = ahead_of(self._signing)
        datagrams = self.packed(messages)
        self._signing.timestamp = before
        return datagrams

    def overtake(self) -> None:
        """A watchdog may have sent what was packed ahead: what comes now is newer."""
        if self._signing is not None:
            self._signing.timestamp = ahead_of(self._signing, times=2)

    def parsed(self, data: bytes) -> list[Any]:
        """Messages in the bytes of a datagram; what is none is left out, and what is refused is counted."""
        if self._signing is None:
            return parsed(data)
        wrong = self._signing.badsig_count
        messages = _parse(SignedParser(self._signing), data)
        refused = sum(
            isinstance(message, mavlink.MAVLink_bad_data) and message.reason == _UNSIGNED for message in messages
        )
        wrong = self._signing.badsig_count - wrong
        self.counts["wrongly signed"] += wrong
        self.counts["unsigned"] += refused - wrong
        return _known(messages)


def parsed(data: bytes) -> list[Any]:
    """Messages in the bytes of a datagram; what is none is left out, and so are those of an unknown kind.

    Without knowing the kind, pymavlink cannot check the sum of a message: random bytes pass as one.
    """
    return _known(_parse(mavlink.MAVLink(None), data))


def _parse(parser: Any, data: bytes) -> list[Any]:
    parser.robust_parsing = True
    return parser.parse_buffer(data) or []


def _known(messages: list[Any]) -> list[Any]:
    return [
        message for message in messages if not isinstance(message, mavlink.MAVLink_bad_data | mavlink.MAVLink_unknown)
    ]
