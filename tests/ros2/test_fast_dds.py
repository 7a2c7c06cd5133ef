"""Fast DDS of Debian as the other side: messages arrive with their values, none is lost, and garbage harms nobody.

Run them with `pytest -m dds`; they need fastddsgen, libfastrtps-dev and g++.
"""

import fast_dds
import numpy as np
import pytest
from peer import ControllerNode, Peer, Running, Said, until

from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.compiled_controller import CompiledController
from undertow.outside.ros2.controller_link import ControllerSettings
from undertow.outside.ros2.link import Link
from undertow.outside.ros2.node import Reporter

pytestmark = pytest.mark.dds

SCENARIO = """
plant: {vehicle: odin, thruster: {kind: paper_table3, fidelity: shaft, supply: 24}}
controller: {kind: pid, frequency: 1.0}
reference: {kind: setpoint, position: [1, 0.5, 0.3, 0, 0, 0.4], settling: 2}
loop: {duration: 1, dt: 0.05, record: 0.05}
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    return fast_dds.build(tmp_path_factory.mktemp("fast_dds"))


def test_round_trips_keep_every_number(program, domain):
    """Each odometry is answered with what Fast DDS read in it."""
    chance, found = np.random.default_rng(8), []
    with fast_dds.running(program, domain, "echo"), Link(domain, True) as link:
        out, back = link.publisher("/odom", ros.Odometry), link.subscriber("/thrusters", ros.Float64MultiArray)
        until(lambda: out.subscribers() and back.publishers(), 30)
        for count in range(500):
            numbers = chance.normal(size=7)
            pose = ros.PoseMessage(ros.Point(*numbers[:3].tolist()), ros.Quaternion(*numbers[3:].tolist()))
            header = ros.Header(ros.Time(count, 250_000_000), "odom")
            out.publish(ros.Odometry(header, "base_link", ros.PoseWithCovariance(pose)))
            link.wait(5.0)
            found = back.take()
            assert len(found) == 1
            np.testing.assert_array_equal(found[0].data, [*numbers, count + 0.25])


def test_garbage_under_the_name_of_a_type_harms_nobody(program, domain, tmp_path):
    """200 messages of random bytes reach the controller's participant; the node goes on with the next odometry."""
    (tmp_path / "odin.yaml").write_text(SCENARIO)
    controller = CompiledController(tmp_path / "odin.yaml")
    with fast_dds.running(program, domain, "garbage") as process, Link(domain, True) as link:
        node = ControllerNode(controller, link, ControllerSettings(use_sim_time=True), Reporter(Said()))
        probe = link.subscriber("/odom", ros.Odometry)
        until(probe.publishers, 30)
        process.stdin.write("go\n")
        answered = Running(process.stdout.readline)
        until(lambda: node.spin(0.02) or answered.result, 30)
        assert answered.result == "arrived\n"
        assert (node.counts["odometry"], node.counts["commands"]) == (0, 0)
        peer = Peer(domain)
        until(peer.odometry.subscribers)
        peer.send(1.0)
        until(lambda: node.spin(0.02) or node.counts["commands"] == 1)
        peer.link.close()
