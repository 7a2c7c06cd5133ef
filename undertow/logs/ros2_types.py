"""Decodes messages of ROS 2 by the definitions of a bag, type by type: one that cannot be read costs no other."""

from typing import Any, NamedTuple

from undertow.logs.extra import reason_of

_SEPARATOR = "=" * 80 + "\n"  # between the files of an IDL definition


class Definition(NamedTuple):
    """Definition of a type.

    Attributes:
        form: `msg`, `idl`, or "" for none.
        text: of the definition, with those of the types within it.
    """

    form: str = ""
    text: str = ""


class Decoder:
    """Decodes messages; types that a bag does not define are those of the newest ROS 2 that rosbags knows."""

    def __init__(self):
        from rosbags.typesys import Stores, get_typestore

        self._common = get_typestore(Stores.LATEST)
        self._stores: dict[tuple[str, Definition], Any] = {}

    def decoded(self, data: bytes, kind: str, definition: Definition) -> Any:
        """The message in some bytes.

        Raises:
            ValueError: its type is unknown, or the bytes are none of it.
        """
        key = kind, definition
        if key not in self._stores:
            self._stores[key] = self._store(kind, definition)
        store = self._stores[key]
        if isinstance(store, str):
            raise ValueError(store)
        try:
            return store.deserialize_cdr(data, kind)
        except Exception as error:  # whatever bytes may cause
            raise ValueError(f"messages of type {kind} cannot be decoded ({reason_of(error)})") from None

    def _store(self, kind: str, definition: Definition) -> Any:
        """The types by which messages of a type are decoded; the reason, where there are none."""
        from rosbags.typesys import Stores, get_typestore

        reason = f"its type {kind} is unknown"
        if definition.form:
            store = get_typestore(Stores.EMPTY)
            try:
                store.register(_types(kind, definition))
            except Exception as error:  # whatever a text may cause
                reason = f"the definition of its type {kind} cannot be read ({reason_of(error)})"
            else:
                return store
        return self._common if kind in self._common.fielddefs else reason


def _types(kind: str, definition: Definition) -> Any:
    """Types of a definition."""
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    if definition.form == "msg":
        return get_types_from_msg(definition.text, kind)
    if not definition.text.startswith(f"{_SEPARATOR}IDL: "):
        return get_types_from_idl(definition.text)
    types = {}
    for part in definition.text.split(_SEPARATOR)[1:]:
        types |= get_types_from_idl(part.partition("\n")[2])  # after the line with the name of the file
    return types
