"""Files as other programs write them, made byte by byte from the description of their formats.

ArduPilot: libraries/AP_Logger/LogStructure.h (FMT, FMTU, and the messages). PX4: docs.px4.io/main/en/dev_log/
ulog_file_format. ROS 1 and 2: rosbags, a package of others. MAVLink: frames by pymavlink, and before each its time.
"""

import json
import struct

import numpy as np

_STRUCT = {"Q": "Q", "f": "f", "c": "h", "C": "H", "H": "H", "B": "B", "b": "b", "d": "d", "I": "I", "N": "16s"}


def ardupilot_bin(tables):
    """Bytes of a .bin file. `tables`: (name, format, columns, unit ids, rows) of each kind of message, rows in order."""
    kinds = {"FMT": (0x80, "BBnNZ", "Type,Length,Name,Format,Columns", "")}
    kinds["FMTU"] = (0x81, "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "")
    for number, (name, form, columns, units, _) in enumerate(tables, start=0x82):
        kinds[name] = (number, form, columns, units)
    out = b""
    for number, form, columns, _ in kinds.values():
        name = next(key for key, one in kinds.items() if one[0] == number)
        size = 3 + sum({"n": 4, "N": 16, "Z": 64}.get(c) or struct.calcsize("<" + _STRUCT[c]) for c in form)
        body = struct.pack("<BB4s16s64s", number, size, name.encode(), form.encode(), columns.encode())
        out += b"\xa3\x95\x80" + body
    for number, _, _, units in kinds.values():
        if units:
            out += b"\xa3\x95\x81" + struct.pack("<QB16s16s", 0, number, units.encode(), b"-" * len(units))
    messages = []
    for name, form, _, _, rows in tables:
        for row in rows:
            packed = struct.pack("<" + "".join(_STRUCT[c] for c in form), *row)
            messages.append((row[0], b"\xa3\x95" + bytes([kinds[name][0]]) + packed))
    return out + b"".join(message for _, message in sorted(messages, key=lambda one: one[0]))


def px4_ulg(topics):
    """Bytes of a .ulg file. `topics`: (name, instance, format fields, rows); a row begins with the timestamp in us."""
    codes = {"uint64_t": "Q", "float": "f", "uint8_t": "B", "bool": "?"}

    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    out = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 0)
    out += message("B", bytes(40))
    for name in dict.fromkeys(topic[0] for topic in topics):
        fields = next(topic[2] for topic in topics if topic[0] == name)
        out += message("F", f"{name}:{fields}".encode())
    data = []
    for number, (name, instance, fields, rows) in enumerate(topics):
        out += message("A", struct.pack("<BH", instance, number) + name.encode())
        form = ""
        for field in filter(None, fields.split(";")):
            kind = field.split(" ")[0]
            base, _, several = kind.partition("[")
            form += codes[base] * (int(several[:-1]) if several else 1)
        for row in rows:
            data.append((row[0], message("D", struct.pack("<H", number) + struct.pack("<" + form, *row))))
    return out + b"".join(body for _, body in sorted(data, key=lambda one: one[0]))


def _ros_message(store, kind, ns, given):
    """An Odometry or Float64MultiArray message of ROS 1 or 2, whose headers differ."""
    make = lambda name, *parts: store.types[name](*parts)
    vector = lambda values: make("geometry_msgs/msg/Vector3", *map(float, values))
    if kind == "nav_msgs/msg/Odometry":
        stamp = make("builtin_interfaces/msg/Time", ns // 10**9, ns % 10**9)
        count = [7] if "seq" in store.types["std_msgs/msg/Header"].__dataclass_fields__ else []
        point = make("geometry_msgs/msg/Point", *map(float, given["position"]))
        w, x, y, z = map(float, given["quaternion"])
        pose = make("geometry_msgs/msg/Pose", point, make("geometry_msgs/msg/Quaternion", x, y, z, w))
        twist = make("geometry_msgs/msg/Twist", vector(given["linear"]), vector(given["angular"]))
        zero = np.zeros(36)
        return make(
            kind,
            make("std_msgs/msg/Header", *count, stamp, "odom"),
            "base_link",
            make("geometry_msgs/msg/PoseWithCovariance", pose, zero),
            make("geometry_msgs/msg/TwistWithCovariance", twist, zero),
        )
    layout = make("std_msgs/msg/MultiArrayLayout", [], 0)
    return make(kind, layout, np.asarray(given["data"], dtype=float))


def ros2_bag(folder, storage, messages):
    """A bag of Odometry and Float64MultiArray messages: (topic, type, ns, {...}) each."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    plugin = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}[storage]
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        connections = {}
        for topic, kind, ns, given in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], ns, store.serialize_cdr(_ros_message(store, kind, ns, given), kind))


def ros1_bag(path, messages, compression="none", chunk_size=2**20, definitions=()):
    """A bag of ROS 1: (topic, type, ns, {...}) each, or bytes in place of {...}. `definitions`: text by type."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    for name, text in dict(definitions).items():
        store.register(get_types_from_msg(text, name))
    writer = Writer(path)
    if compression != "none":
        writer.set_compression(Writer.CompressionFormat[compression.upper()])
    writer.chunk_threshold = chunk_size
    with writer:
        connections = {}
        for topic, kind, ns, given in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            is_bytes = isinstance(given, bytes)
            data = given if is_bytes else store.serialize_ros1(_ros_message(store, kind, ns, given), kind)
            writer.write(connections[topic], ns, data)
    return path


def json_mcap(path, channels, encoding="json"):
    """An MCAP file of JSON messages: topic -> [(ns, message), ...]."""
    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("Sample", "jsonschema", b'{"type": "object"}')
        for topic, messages in channels.items():
            channel = writer.register_channel(topic, encoding, schema)
            for ns, message in messages:
                writer.add_message(channel, ns, json.dumps(message).encode(), ns)
        writer.finish()


def mavlink_tlog(messages, version=2):
    """Bytes of a .tlog file. `messages`: (us, (system, component), name, fields) each, in this order."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    out, senders = b"", {}
    for microseconds, sender, name, fields in messages:
        link = senders.setdefault(sender, dialect.MAVLink(None, *sender))
        kind = next(one for one in dialect.mavlink_map.values() if one.msgname == name)
        values = {field: fields.get(field, 0) for field in kind.fieldnames}
        values |= {"param_id": fields["param_id"]} if "param_id" in fields else {}
        packed = kind(**values).pack(link, force_mavlink1=version == 1)
        out += struct.pack(">Q", microseconds) + bytes(packed)
    return out
