"""One DDS participant with the publishers and subscribers of a node, named and typed as those of ROS 2.

A topic `/t` is `rt/t` on the wire, and a writer states the hash of its type in its user data (REP 2016). A subscriber
waits on a WaitSet; polling would cost milliseconds.
"""

import contextlib
import functools
import re
import time
from collections.abc import Callable, Iterator
from typing import Any, Generic

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import DDSException, InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.logs.background_writer import BackgroundWriter
from undertow.outside.ros2.from_messages import SECOND
from undertow.outside.ros2.messages import Message, ros_type, type_hash

RELIABILITIES = ("reliable", "best-effort")

_DEPTH = 10  # messages that are kept for a slow reader; the default of ROS 2
_LARGEST_DOMAIN = 232
_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")

# Participants of this machine find each other by unicast: multicast need not work, and nothing leaves the machine.
LOOPBACK = """<CycloneDDS><Domain Id="any">
<General><Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""


class Outlet(Generic[Message]):
    """A publisher of one topic."""

    def __init__(self, link: "Link", topic: str, writer: DataWriter):
        self.topic, self._link, self._writer = topic, link, writer
        self.sent = 0

    def publish(self, message: Message) -> None:
        """Send a message."""
        self._writer.write(message)
        self._link.record(self.topic, message)
        self.sent += 1

    def subscribers(self) -> int:
        """How many subscribers there are."""
        return len(self._writer.get_matched_subscriptions())


class Inlet(Generic[Message]):
    """A subscriber of one topic.

    Attributes:
        topic: its name in ROS 2.
        received: messages so far.
        malformed: messages so far whose bytes could not be read.
    """

    def __init__(self, link: "Link", topic: str, reader: DataReader):
        self.topic, self._link, self._reader = topic, link, reader
        self.received = self.malformed = 0

    def take(self) -> list[Message]:
        """The messages that have arrived, the oldest first."""
        return list(self._taken())

    def _taken(self) -> Iterator[Message]:
        while True:
            try:
                messages = self._reader.take(1)  # one by one: a message that cannot be read must cost no other
            except DDSException:
                raise
            except Exception:  # of struct, UTF-8, or CycloneDDS's own `Exception`
                self.malformed += 1
                continue
            if not messages:
                return
            if getattr(messages[0], "sample_info", None) is None or not messages[0].sample_info.valid_data:
                continue  # a publisher has left
            self.received += 1
            self._link.record(self.topic, messages[0])
            yield messages[0]

    def publishers(self) -> int:
        """How many publishers there are."""
        return len(self._reader.get_matched_publications())

    def incompatible(self) -> int:
        """How many publishers there were that offer less than this subscriber asks for."""
        return int(self._reader.get_requested_incompatible_qos_status().total_count)


class Link:
    """The participant of a node; a context.

    Args:
        domain: ROS_DOMAIN_ID.
        localhost: whether only this machine is reached, without multicast; otherwise CYCLONEDDS_URI decides.
        reliability: `reliable` or `best-effort`, of publishers and subscribers alike.
        bag: writes everything sent and received; None for none.

    Attributes:
        now: time (ns) that the bag gets; the system's unless set.
        on_trouble: gets an event and a sentence where a message is not recorded.

    Raises:
        BadInput: something given cannot be used, or the participant cannot be made.
    """

    def __init__(
        self,
        domain: int = 0,
        localhost: bool = False,
        reliability: str = "reliable",
        bag: BackgroundWriter | None = None,
    ):
        if not 0 <= domain <= _LARGEST_DOMAIN:
            raise BadInput("domain", f"be 0 to {_LARGEST_DOMAIN}", domain)
        checks.choice("reliability", reliability, RELIABILITIES)
        self.now: Callable[[], int] = time.time_ns
        self.on_trouble: Callable[[str, str], None] = lambda event, sentence: None
        self._bag = bag
        self._qos = _quality(reliability)
        try:
            if localhost:
                _loopback(domain)
            self._participant: Any = DomainParticipant(domain, Qos(Policy.Userdata(b"enclave=/;")))
        except DDSException as error:
            hint = "Is CYCLONEDDS_URI right? To reach this machine only, use --localhost"
            raise BadInput("", "", f"no DDS participant could be made in domain {domain}: {error}", hint=hint) from None
        self._waiting: Any = WaitSet(self._participant)
        self._announced: Any = BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)
        self._dds_entities: list[Any] = []
        self._writers: list[DataWriter] = []

    def __enter__(self) -> "Link":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the domain: the participant ends, with all that was made of it."""
        participant = self._participant
        self._participant = None
        if participant is not None:
            participant.__del__()  # CycloneDDS has no other way; references among its objects keep them alive

    def publisher(self, topic: str, kind: type[Message]) -> Outlet[Message]:
        """A publisher of a topic.

        Raises:
            BadInput: no name of a topic.
        """
        user_data = Policy.Userdata(f"typehash={type_hash(kind)};".encode())
        writer = DataWriter(self._participant, self._topic(topic, kind), Qos(user_data, base=self._qos))
        self._writers.append(writer)
        return Outlet(self, topic, writer)

    def subscriber(self, topic: str, kind: type[Message], reliability: str | None = None) -> Inlet[Message]:
        """A subscriber of a topic, for whose messages `wait` waits.

        Args:
            topic: its name in ROS 2.
            kind: type of its messages.
            reliability: None for that of the link; `best-effort` takes messages of any publisher.

        Raises:
            BadInput: no name of a topic.
        """
        qos = self._qos if reliability is None else _quality(reliability)
        reader = DataReader(self._participant, self._topic(topic, kind), qos)
        condition = ReadCondition(reader, ViewState.Any | SampleState.NotRead | InstanceState.Any)
        self._waiting.attach(condition)
        self._dds_entities += [reader, condition]
        return Inlet(self, topic, reader)

    def wait(self, seconds: float) -> bool:
        """Wait until a message is there, but no longer than this; whether one is."""
        return self._waiting.wait(max(0, round(seconds * SECOND))) > 0

    def flush(self, seconds: float) -> None:
        """Wait until reliable subscribers have everything that was sent, but no longer than this for each publisher."""
        for writer in self._writers:
            # CycloneDDS 11 answers a timeout with an AttributeError of its own code.
            with contextlib.suppress(AttributeError, DDSException):
                writer.wait_for_acks(duration(seconds=seconds))

    def topics(self) -> dict[str, str]:
        """Topics that are published in the domain, and their types in ROS 2."""
        publications: dict[Any, Any] = {}
        for publication in self._announced.read(1000):
            publications[publication.key] = publication  # without names where the publisher has left
        return {
            publication.topic_name[2:]: publication.type_name.replace("::msg::dds_::", "/msg/").removesuffix("_")
            for publication in publications.values()
            if (publication.topic_name or "").startswith("rt/")
        }

    def record(self, topic: str, message: Any) -> None:
        """Let a message be written into the bag, where there is one. What the disk does holds up nobody."""
        bag = self._bag
        if bag is None:
            return
        dropped = bag.dropped
        bag.put((topic, message, self.now()))
        if bag.failure:
            self._bag = None
            self.on_trouble("bag ended", f"the bag cannot be written any more: {bag.failure}")
        elif bag.dropped > dropped:
            self.on_trouble("not recorded", "the disk is too slow: messages are missing in the bag")

    def _topic(self, topic: str, kind: type[Message]) -> Topic:
        if not _NAME.fullmatch(topic):
            must = "be a name of ROS 2, such as /odom: letters, digits, underscores, and a slash before each part"
            raise BadInput("topic", must, repr(topic))
        dds_topic = Topic(self._participant, f"rt{topic}", kind, self._qos)
        self._dds_entities.append(dds_topic)
        return dds_topic


# What makes that two sides see nothing of each other.
DIFFERENT_NETWORKS = "Is the domain right, and --localhost given to both sides or to neither?"


def why_nothing(link: Link, inlet: Inlet, kind: type) -> str:
    """Why nothing arrives at a subscriber, in a sentence."""
    types_by_topic = link.topics()
    expected = ros_type(kind)
    if inlet.topic in types_by_topic and types_by_topic[inlet.topic] != expected:
        return f"{inlet.topic} is published as {types_by_topic[inlet.topic]}, but {expected} is expected"
    if inlet.incompatible():
        return (
            f"{inlet.topic} is published with another quality of service than is asked for. "
            "Use --reliability best-effort"
        )
    if inlet.publishers():
        return f"{inlet.topic} has a publisher that sends nothing"
    same_type = sorted(name for name, message_type in types_by_topic.items() if message_type == expected)
    hint = f"{expected} is published on {', '.join(same_type)}: use --remap" if same_type else DIFFERENT_NETWORKS
    return f"nobody publishes {inlet.topic} ({expected}). {hint}"


def _quality(reliability: str) -> Qos:
    """Quality of service: the default of ROS 2, but for the reliability."""
    reliable = Policy.Reliability.Reliable(duration(milliseconds=100))
    reliability_policy = reliable if reliability == "reliable" else Policy.Reliability.BestEffort
    representation = Policy.DataRepresentation(use_cdrv0_representation=True)
    return Qos(reliability_policy, Policy.Durability.Volatile, Policy.History.KeepLast(_DEPTH), representation)


@functools.cache
def _loopback(domain: int) -> Domain:
    """The domain of this process, which is configured once."""
    return Domain(domain, LOOPBACK)
