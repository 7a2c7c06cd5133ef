"""ROS 2 without a ROS installation: the controller of a scenario, or its simulated vehicle, as a node over CycloneDDS.

A node here is a DDS participant that takes and gives the standard messages, which ROS 2 nodes of any vendor read. World
axes are east, north, up and body axes forward, port, up on this side (REP 103); `frames` converts. docs/how-to/ros2.md
says what is published, what is expected, and what happens when something is wrong.
"""

import importlib.util

if importlib.util.find_spec("rosbags") is None:
    remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[ros2]'"
    raise ModuleNotFoundError(f"rosbags is not installed. {remedy}", name="rosbags")

from undertow.outside.ros2.read_bag import read_rosbag2 as read_rosbag2
