"""The controller as a node: what it answers, and what it does when a message, the clock or the link is wrong."""

import socket
import time

import numpy as np
import pytest
from cyclonedds._clayer import ddspy_write
from cyclonedds.core import Policy
from peer import STILL, ControllerNode, Peer, Said, until
from random_messages import random_message

import undertow as ut
from undertow.core.errors import BadInput
from undertow.logs.frames import quaternions
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.compiled_controller import CompiledController
from undertow.outside.ros2.controller_link import ControllerSettings
from undertow.outside.ros2.from_messages import Frames, PoseAndVelocity
from undertow.outside.ros2.link import DIFFERENT_NETWORKS, Link, why_nothing
from undertow.outside.ros2.node import Reporter, Topics
from undertow.outside.ros2.to_messages import odometry_of, target_message
from undertow.scenario.link_scenario import read_for_link

pytestmark = pytest.mark.interop

SCENARIO = """
plant: {vehicle: odin, thruster: {kind: paper_table3, fidelity: shaft, supply: 24}}
controller: {kind: pid, frequency: 1.0}
reference: {kind: setpoint, position: [1, 0.5, 0.3, 0, 0, 0.4], settling: 2}
loop: {duration: 1, dt: 0.05, record: 0.05}
"""
AWAY = PoseAndVelocity(np.array([0.2, -0.1, 0.3]), quaternions([0.02, 0.03, 0.1]), np.array([0.1, 0, 0, 0, 0, 0.05]))


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    path = tmp_path_factory.mktemp("node") / "odin.yaml"
    path.write_text(SCENARIO)
    return path


@pytest.fixture(scope="module")
def compiled(scenario):
    return CompiledController(scenario)


@pytest.fixture(scope="module")
def autopilot(scenario):
    return ut.Autopilot(scenario, attitude="quaternion")


@pytest.fixture
def setup(compiled, domain):
    """A function of settings that gives node, peer and what the node says."""
    links = []

    def made(controller=compiled, **settings):
        said, link = Said(), Link(domain, True)
        topic, kind = ("/wrench", ros.WrenchStamped) if controller.output == "wrench" else ("/thrusters", None)
        peer = Peer(domain, topic, kind or ros.Float64MultiArray)
        node = ControllerNode(controller, link, ControllerSettings(**settings), Reporter(said))
        links.extend((link, peer.link))
        until(lambda: peer.odometry.subscribers() and peer.commands.publishers() and peer.target.subscribers())
        if settings.get("use_sim_time"):
            until(peer.clock.subscribers)
        return node, peer, said

    yield made
    for link in links:
        link.close()


def answers(node, peer, count=1):
    """Spin until so many commands have come."""
    found = []

    def enough():
        node.spin(0.01)
        found.extend(peer.commands.take())
        return len(found) >= count

    until(enough)
    return [np.array(one.data) for one in found]


def nothing(node, peer):
    """Spin a while; no command may come."""
    for _ in range(10):
        node.spin(0.02)
    assert not peer.commands.take()


def test_answers_are_those_of_an_autopilot(setup, autopilot):
    node, peer, said = setup(use_sim_time=True)
    peer.send(5.0, AWAY)
    first = answers(node, peer)[0]
    np.testing.assert_allclose(
        first, autopilot.start(AWAY.position, AWAY.velocity, AWAY.quaternion), rtol=1e-9, atol=1e-9
    )
    for stamp, dt in ((5.05, None), (5.17, 0.12)):
        peer.send(stamp, STILL)
        expected = autopilot.step(STILL.position, STILL.velocity, STILL.quaternion, dt=dt, applied=first)
        first = answers(node, peer)[0]
        np.testing.assert_allclose(first, expected, rtol=1e-9, atol=1e-9)
    assert not said.warnings and "odometry 3" in node.status() and "late 1" in node.status()


def test_two_vehicles_on_one_topic_are_named(setup, domain):
    """Their messages are mixed, which nothing else would say."""
    node, peer, _ = setup(use_sim_time=True)
    peer.send(5.0, AWAY)
    answers(node, peer)
    other = Link(domain, True)
    other.publisher("/odom", ros.Odometry)

    def named():
        node.spin(0.02)
        return "/odom has 2 publishers, whose messages are mixed. End all but one" in node.status()

    until(named)
    other.close()


def test_a_target_is_reached_for(setup, autopilot):
    node, peer, _ = setup(use_sim_time=True)
    target = np.array([0.5, -1.0, 0.2, 0, 0, -0.3])
    peer.target.publish(target_message(target, ros.Time(), Frames()))
    until(lambda: node.spin(0.01) or node.counts["targets"] == 1)
    peer.send(0.0)
    expected = autopilot.start(STILL.position, STILL.velocity, STILL.quaternion, target=target)
    np.testing.assert_allclose(answers(node, peer)[0], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"frames": Frames(("world_ned",))}, "`/odom header.frame_id` must be odom or map, but is 'world_ned'"),
        ({"frames": Frames(body="imu_link")}, "`/odom child_frame_id` must be base_link, but is 'imu_link'"),
        ({"motion": STILL._replace(quaternion=np.zeros(4))}, "`/odom orientation` must be of unit length"),
        (
            {"motion": STILL._replace(position=np.full(3, 2e4))},
            "`/odom position` must be at most 10000 m, but is 2e+04 m",
        ),
    ],
)
def test_messages_that_cannot_be_used_are_ignored_and_said_once(setup, wrong, said):
    node, peer, lines = setup(use_sim_time=True)
    for stamp in (1.0, 1.1, 1.2):
        peer.send(stamp, **wrong)
        nothing(node, peer)
    assert len(lines.warnings) == 1 and said in lines.warnings[0], lines.lines
    assert sum(number for name, number in node.counts.items() if name.startswith("ignored")) == 3
    peer.send(1.3)
    assert np.isfinite(answers(node, peer)[0]).all()


def test_it_does_not_start_without_a_position(setup):
    node, peer, _ = setup(use_sim_time=True)
    peer.send(1.0, STILL._replace(position=np.array([0, np.nan, 0])))
    nothing(node, peer)
    assert node.loop.session.state() == "no valid measurement: position not measured"
    peer.send(1.1)
    assert np.isfinite(answers(node, peer)[0]).all()


def test_what_is_not_finite_later_was_not_measured(setup, autopilot):
    node, peer, said = setup(use_sim_time=True)
    peer.send(1.0)
    before = answers(node, peer)[0]
    hole = STILL._replace(position=np.array([0.1, np.nan, 0.0]), quaternion=np.full(4, np.nan))
    peer.send(1.05, hole)
    autopilot.start(STILL.position, STILL.velocity, STILL.quaternion)
    expected = autopilot.step(hole.position, hole.velocity, hole.quaternion, applied=before)
    np.testing.assert_allclose(answers(node, peer)[0], expected, rtol=1e-9, atol=1e-9)
    assert not said.warnings


def test_a_target_that_cannot_be_used_is_ignored(setup):
    node, peer, said = setup(use_sim_time=True)
    peer.target.publish(target_message(np.zeros(6), ros.Time(), Frames(("base_link",))))
    until(lambda: node.spin(0.01) or said.warnings)
    assert "`/target_pose header.frame_id` must be odom or map, but is 'base_link'" in said.warnings[0]


def test_odometry_out_of_order_is_ignored(setup):
    node, peer, said = setup(use_sim_time=True)
    peer.send(1.0)
    answers(node, peer)
    for stamp in (1.0, 0.95):
        peer.send(stamp)
        nothing(node, peer)
    assert said.warnings == ["Warning: /odom has stamps that do not increase. Those are ignored"]


def test_a_clock_that_goes_back_begins_the_controller_again(setup, scenario):
    """From the command that is applied, as fast as its supervisor allows."""
    text = read_for_link(scenario, allow_code=False, unsupervised=False)
    autopilot = ut.Autopilot(text, attitude="quaternion")
    node, peer, said = setup(use_sim_time=True)
    peer.tell_time(10.0)
    peer.send(10.0, AWAY)
    answers(node, peer)
    peer.tell_time(10.05)
    peer.send(10.05, STILL)
    applied = answers(node, peer)[0]
    peer.tell_time(2.0)
    until(lambda: node.spin(0.01) or said.warnings)
    peer.send(2.0, AWAY)
    expected = autopilot.start(AWAY.position, AWAY.velocity, AWAY.quaternion, applied=applied)
    np.testing.assert_allclose(answers(node, peer)[0], expected, rtol=1e-9, atol=1e-9)
    assert len(said.warnings) == 1 and "/clock went back by 8.05 s: the controller begins again" in said.warnings[0]


def test_stamps_of_another_time_begin_the_controller_again(setup):
    """Not one of them alone: they have to go on for half a second, while there is zero thrust."""
    node, peer, said = setup(use_sim_time=True)
    peer.send(10.0, AWAY)
    assert answers(node, peer)[0].any()
    began, stamp, commands = time.monotonic(), 2.0, []
    while not (commands and commands[-1].any()):
        assert time.monotonic() < began + 10
        peer.send(stamp := stamp + 0.05, AWAY)
        time.sleep(0.05)
        node.spin(0.01)
        commands += [np.array(one.data) for one in peer.commands.take()]
    assert time.monotonic() - began > 0.5 and not commands[0].any()
    ignored, restarted = (next(one for one in said.warnings if what in one) for what in ("another time", "was set"))
    assert "/odom has stamps of another time" in ignored and "the controller begins again" in restarted


def test_zero_thrust_after_the_clock_went_back_and_odometry_stopped(setup):
    """In simulated time; and a clock before zero is ignored."""
    node, peer, said = setup(use_sim_time=True)
    peer.tell_time(10.0)
    peer.send(10.0, AWAY)
    assert answers(node, peer)[0].any()
    peer.clock.publish(ros.Clock(ros.Time(-5, 0)))
    peer.tell_time(2.0)
    nothing(node, peer)
    peer.tell_time(2.6)
    assert not answers(node, peer)[0].any()
    assert [("/clock is at -5 s" in one, "back by 8 s" in one, "zero thrust" in one) for one in said.warnings] == [
        (True, False, False),
        (False, True, False),
        (False, False, True),
    ]


def test_numbers_of_any_size_harm_nobody(setup):
    """Random fields in the right frames; commands stay finite."""
    node, peer, _ = setup(use_sim_time=True)
    chance, sent = np.random.default_rng(9), 0
    peer.send(0.0)
    commands = answers(node, peer)
    for _ in range(300):
        message = random_message(ros.Odometry, chance)
        message.header.frame_id, message.child_frame_id = "odom", "base_link"
        sent += 1
        peer.tell_time(0.05 * sent)
        if chance.random() < 0.9:
            message.header.stamp = ros.Time(*divmod(sent * 50_000_000, 10**9))
            quaternion = chance.normal(size=4)
            message.pose.pose.orientation = ros.Quaternion(*(quaternion / np.linalg.norm(quaternion)).tolist())
        if chance.random() < 0.9:  # of a vehicle
            message.pose.pose.position = ros.Point(*chance.uniform(-1e4, 1e4, 3).tolist())
            for part in ("linear", "angular"):
                setattr(message.twist.twist, part, ros.Vector3(*chance.uniform(-20, 20, 3).tolist()))
        peer.odometry.publish(message)
        target = random_message(ros.PoseStamped, chance)
        target.header.frame_id = "map"
        peer.target.publish(target)
        node.spin(0.01)
        commands += [np.array(one.data) for one in peer.commands.take()]
    assert len(commands) > 60 and np.isfinite(commands).all()


def test_datagrams_that_are_no_rtps_harm_nobody(setup, domain):
    """Random bytes, with and without the header of the protocol, to the ports of the first participants (RTPS 9.6.1)."""
    node, peer, _ = setup(use_sim_time=True)
    chance = np.random.default_rng(10)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for _ in range(1000):
            head = b"RTPS\x02\x03" * bool(chance.random() < 0.7)
            port = 7400 + 250 * domain + 10 + int(chance.integers(0, 8))
            out.sendto(head + chance.bytes(chance.integers(0, 400)), ("127.0.0.1", port))
    peer.send(1.0)
    assert np.isfinite(answers(node, peer)[0]).all()


def test_a_publisher_announces_the_hash_of_its_type(setup):
    """As `ros2 topic info --verbose` shows it."""
    _, peer, _ = setup(use_sim_time=True)
    announced = {one.topic_name: one.qos[Policy.Userdata].data for one in peer.link._announced.read(100) if one.qos}
    assert announced["rt/thrusters"] == f"typehash={ros.type_hash(ros.Float64MultiArray)};".encode()
    assert announced["rt/odom"] == f"typehash={ros.type_hash(ros.Odometry)};".encode()


def test_zero_thrust_while_there_is_no_odometry(setup):
    node, peer, said = setup(max_age=0.3)
    peer.send(time.time(), AWAY)
    assert answers(node, peer)[0].any()
    began = time.monotonic()
    stop = answers(node, peer)[0]
    assert not stop.any() and 0.25 < time.monotonic() - began < 5
    assert "no valid measurement from /odom: zero thrust" in said.warnings[0]
    peer.send(time.time(), AWAY)
    until(lambda: any(one.any() for one in answers(node, peer)))  # it goes on
    node.stop()
    assert not answers(node, peer)[-1].any()


def test_old_stamps_are_ignored_and_simulated_ones_recognised(setup):
    node, peer, said = setup()
    peer.send(12.0)
    nothing(node, peer)
    assert "`/odom header.stamp` must be at most 0.5 s old" in said.warnings[0]
    assert "Use --use-sim-time" in said.warnings[0]
    node, peer, said = setup()
    peer.send(time.time() - 2)
    nothing(node, peer)
    assert "Set the clocks, or give a larger --max-age" in said.warnings[0]


def test_faster_odometry_is_taken_once_per_step(setup):
    node, peer, _ = setup(use_sim_time=True)
    found = 0
    for k in range(21):
        peer.send(1 + k * 0.0125)
        until(lambda k=k: node.spin(0.01) or node.counts["odometry"] == k + 1)
        found += len(peer.commands.take())
    assert found == 6  # at 1, 1.05, ... 1.25


def test_missing_odometry_is_explained(setup, monkeypatch):
    """Once, and again where the reason changes."""
    monkeypatch.setattr("undertow.outside.ros2.controller_link._ABSENT", 0.05)
    node, peer, said = setup()
    nothing(node, peer)
    assert said.warnings == ["Warning: /odom has a publisher that sends nothing"]
    peer.link.close()
    nothing_more = f"Warning: nobody publishes /odom (nav_msgs/msg/Odometry). {DIFFERENT_NETWORKS}"
    until(lambda: node.spin(0.02) or said.warnings[1:] == [nothing_more])


def test_a_text_that_is_none_costs_one_message(setup):
    """CycloneDDS checks lengths before it gives a message to anybody, but not that a text is UTF-8."""
    node, peer, _ = setup(use_sim_time=True)
    data = odometry_of(AWAY, ros.Time(), Frames()).serialize()
    assert ddspy_write(peer.odometry._writer._ref, data.replace(b"odom\0", b"\xff\xfe\xfd\xfc\0")) == 0
    peer.send(1.0)
    assert np.isfinite(answers(node, peer)[0]).all()
    assert node.counts["malformed"] == 1


def test_a_wrench_in_ros_axes(scenario, setup):
    """As an Autopilot gives it, with y and z the other way round."""
    node, peer, _ = setup(CompiledController(scenario, "wrench"), use_sim_time=True)
    peer.send(0.0, AWAY)
    found = []
    until(lambda: node.spin(0.01) or found.extend(peer.commands.take()) or found)
    wrench = found[0].wrench
    given = [*(getattr(wrench.force, axis) for axis in "xyz"), *(getattr(wrench.torque, axis) for axis in "xyz")]
    autopilot = ut.Autopilot(scenario, attitude="quaternion", output="wrench")
    expected = autopilot.start(AWAY.position, AWAY.velocity, AWAY.quaternion) * [1, -1, -1, 1, -1, -1]
    np.testing.assert_allclose(given, expected, rtol=1e-9, atol=1e-9)
    assert found[0].header.frame_id == "base_link"


@pytest.mark.parametrize("output, label", [("newtons", "thrusters [N]"), ("pulses", "thrusters [us]")])
def test_other_outputs_are_those_of_an_autopilot(scenario, autopilot, output, label):
    """Of the limited input: 24 V give the thrust that 100 V give."""
    controller = CompiledController(scenario, output)
    assert controller.label == label
    other = ut.Autopilot(scenario, attitude="quaternion", output=output)
    at = AWAY.position, AWAY.velocity, AWAY.quaternion
    _, values = controller.limited(autopilot.start(*at))
    np.testing.assert_allclose(values, other.start(*at), rtol=1e-12)
    np.testing.assert_array_equal(controller.limited(np.full(8, 100.0))[0], np.full(8, 24.0))
    np.testing.assert_array_equal(controller.limited(np.full(8, 100.0))[1], controller.limited(np.full(8, 24.0))[1])
    stop = controller.limited(np.zeros(8))[1]
    np.testing.assert_array_equal(stop, np.full(8, 1500.0 if output == "pulses" else 0.0))


def test_a_clock_of_any_quality_of_service_is_taken(setup, domain):
    node, _, _ = setup(use_sim_time=True)
    with Link(domain, True, "best-effort") as other:
        clock = other.publisher("/clock", ros.Clock)
        until(clock.subscribers)
        clock.publish(ros.Clock(ros.Time(7, 0)))
        until(lambda: node.spin(0.01) or node.topics._now() == 7_000_000_000)


def test_why_nothing_arrives(empty_domain):
    domain = empty_domain
    with Link(domain, True) as one, Link(domain, True, "best-effort") as other:
        inlet = one.subscriber("/odom", ros.Odometry)
        why = lambda: why_nothing(one, inlet, ros.Odometry)
        assert "nobody publishes /odom (nav_msgs/msg/Odometry). Is the domain right, and --localhost" in why()
        other.publisher("/vehicle/odom", ros.Odometry)
        until(lambda: "is published on /vehicle/odom: use --remap" in why())
        other.publisher("/odom", ros.Odometry)
        until(lambda: "Use --reliability best-effort" in why())
    with Link(domain, True) as one, Link(domain, True) as other:
        inlet = one.subscriber("/odom", ros.Odometry)
        other.publisher("/odom", ros.PoseStamped)
        said = "/odom is published as geometry_msgs/msg/PoseStamped, but nav_msgs/msg/Odometry is expected"
        until(lambda: said in why_nothing(one, inlet, ros.Odometry))


def test_what_a_node_cannot_be_made_of(scenario, tmp_path, domain):
    pendulum = tmp_path / "pendulum.yaml"
    pendulum.write_text("plant: inverted_pendulum\nreference: {kind: setpoint, position: [0]}\n")
    speeds = tmp_path / "speeds.yaml"
    speeds.write_text(SCENARIO + "model: {speed_sensor: true}\n")
    cases = [
        (lambda: CompiledController(pendulum), "`plant` must be a vehicle with thrusters"),
        (lambda: CompiledController(speeds), r"`model.speed_sensor` must be false: .* \(speeds.yaml, line 6\)"),
        (lambda: CompiledController(scenario, rate=0.0), "`rate` must be positive"),
        (lambda: CompiledController(scenario, "pwm"), "`output` must be one of input, newtons, pulses, wrench"),
        (lambda: Link(233, True), "`domain` must be 0 to 232"),
        (lambda: Link(domain, True, "always"), "`reliability` must be one of reliable, best-effort"),
        (lambda: Link(domain, True).publisher("odom", ros.Odometry), "`topic` must be a name of ROS 2"),
        (lambda: Topics().remapped(["odom=/x"]), "`--remap` must be of the form odom:=/vehicle/odometry"),
        (lambda: Topics().remapped(["odometry:=/x"]), "`--remap` must name a topic of a node"),
    ]
    for make, said in cases:
        with pytest.raises(BadInput, match=said):
            make()
    assert Topics().remapped(["odom:=v/odom", "/clock:=/c"])[::5] == ("/v/odom", "/c")
