"""Decodes messages of ROS by the definitions of a bag, type by type: one that cannot be read costs no other."""

from typing import Any, NamedTuple

from undertow.logs.extra import reason_of

_SEPARATOR = "=" * 80 + "\n"  # between the files of an IDL definition

# Fields of a type and of all types of a bag, those within them and the members of fixed arrays of messages and strings
# included: rosbags writes and compiles some lines of code for each, which takes 0.3 ms.
_MOST_FIELDS, _MOST_IN_ALL = 2**12, 2**15


class Definition(NamedTuple):
    """Definition of a type.

    Attributes:
        form: `ros1` (whose messages are encoded in another way), `msg`, `idl`, or "" for none.
        text: of the definition, with those of the types within it.
    """

    form: str = ""
    text: str = ""


class Decoder:
    """Decodes messages; types that a bag does not define are those of the newest ROS of its kind that rosbags knows."""

    def __init__(self):
        self._stores: dict[tuple[str, Definition], Any] = {}
        self._fields = 0  # of all types

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
            return (store.deserialize_ros1 if definition.form == "ros1" else store.deserialize_cdr)(data, kind)
        except Exception as error:  # whatever bytes may cause
            raise ValueError(f"messages of type {kind} cannot be decoded ({reason_of(error)})") from None

    def _store(self, kind: str, definition: Definition) -> Any:
        """The types by which messages of a type are decoded; the reason, where there are none."""
        from rosbags.typesys import Stores, get_typestore

        reason = f"its type {kind} is unknown"
        if definition.form:
            store = get_typestore(Stores.EMPTY)
            try:
                types = _types(kind, definition)
                self._fields += _fields_of(types, definition.form)
                if self._fields > _MOST_IN_ALL:
                    raise ValueError(f"the types of the bag have more than {_MOST_IN_ALL} fields")
                store.register(types)
            except Exception as error:  # whatever a text may cause
                reason = f"the definition of its type {kind} cannot be read ({reason_of(error)})"
            else:
                return store
        common = get_typestore(Stores.ROS1_NOETIC if definition.form == "ros1" else Stores.LATEST)
        return common if kind in common.fielddefs else reason


def _types(kind: str, definition: Definition) -> Any:
    """Types of a definition."""
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    if definition.form in ("msg", "ros1"):
        return get_types_from_msg(definition.text, kind)
    if not definition.text.startswith(f"{_SEPARATOR}IDL: "):
        return get_types_from_idl(definition.text)
    types = {}
    for part in definition.text.split(_SEPARATOR)[1:]:
        types |= get_types_from_idl(part.partition("\n")[2])  # after the line with the name of the file
    return types


def _fields_of(types: Any, form: str) -> int:
    """Number of the fields of some types, by which rosbags can decode messages in a time in proportion to their bytes.

    Raises:
        ValueError: they are too many; or they take no bytes, so that a message may have any number of them.
    """
    from rosbags.interfaces import Nodetype

    empty = {kind for kind, (_, fields) in types.items() if all(_is_empty_array(field) for _, field in fields)}
    number = 0
    for _, fields in types.values():
        for name, field in fields:
            element, length = field[1] if field[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) else (field, 1)
            is_message = element[0] == Nodetype.NAME
            is_unrolled = field[0] == Nodetype.ARRAY and (is_message or element[1][0] == "string")
            number += max(1, length) if is_unrolled else 1
            if form == "ros1" and is_message and element[1] in empty:
                raise ValueError(f"its {name} has a type without fields")
    if number > _MOST_FIELDS:
        raise ValueError(f"it has {number} fields, more than the {_MOST_FIELDS} that are read")
    return number


def _is_empty_array(field: Any) -> bool:
    from rosbags.interfaces import Nodetype

    return field[0] == Nodetype.ARRAY and field[1][1] <= 0
