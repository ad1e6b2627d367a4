"""The ROS 2 example steers a fish, with stand-ins for the message classes of ROS."""

import importlib.util
import sys
import types
from dataclasses import dataclass, field, make_dataclass

import numpy as np
import pytest

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from robofish_agents.deployment import export_onnx
from robofish_agents.policies import PretrainedPolicy, read_policy, shipped
from tests.docs.pages import ROOT

FILE = ROOT / "examples" / "ros2_policy.py"
PHYSICS_HZ, CONTROL_HZ = 100, 10
PHASE = [21, 22]


@dataclass
class Vector:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class Quaternion(Vector):
    w: float = 1.0


def message(**fields):
    """A class with the fields of a message, each with its default."""
    defaults = [(name, object, field(default_factory=make)) for name, make in fields.items()]
    return make_dataclass("Message", defaults)


Pose = message(position=Vector, orientation=Quaternion)
Twist = message(linear=Vector, angular=Vector)
Stamp = message(sec=int, nanosec=int)
Odometry = message(header=message(stamp=Stamp), pose=message(pose=Pose), twist=message(twist=Twist))
Float64MultiArray = message(data=list)


class Clock:
    """Stands still until it is told the time."""

    nanoseconds = 0

    def now(self):
        return self


class Node:
    """What the example uses of rclpy's node; keeps what it is given."""

    parameters: dict[str, object] = {}  # noqa: RUF012

    def __init__(self, name):
        self.name, self.clock, self.published, self.warnings = name, Clock(), [], []
        self.subscribed, self.timers = {}, []

    def declare_parameter(self, name, default):
        return types.SimpleNamespace(value=self.parameters.get(name, default))

    def create_publisher(self, kind, topic, depth):
        assert (kind, topic) == (Float64MultiArray, "targets")
        return types.SimpleNamespace(publish=self.published.append)

    def create_subscription(self, kind, topic, callback, depth):
        self.subscribed[topic] = (kind, callback)

    def create_timer(self, period, callback):
        self.timers.append((period, callback))

    def get_clock(self):
        return self.clock

    def get_logger(self):
        return types.SimpleNamespace(warning=lambda text, **_: self.warnings.append(text))


STAND_INS = {
    "rclpy": {},
    "rclpy.node": {"Node": Node},
    "nav_msgs": {},
    "nav_msgs.msg": {"Odometry": Odometry},
    "std_msgs": {},
    "std_msgs.msg": {"Float64MultiArray": Float64MultiArray},
}


@pytest.fixture
def ros(monkeypatch, tmp_path):
    """The example as a module, and a model that it finds."""
    pytest.importorskip("onnx", reason="the extra `export` is not installed")
    pytest.importorskip("onnxruntime", reason="the extra `dev` is not installed")
    for name, content in STAND_INS.items():
        module = types.ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    model, _ = export_onnx(read_policy(shipped("hold")[0]), tmp_path / "hold.onnx")
    monkeypatch.setattr(Node, "parameters", {"model": str(model)})
    spec = importlib.util.spec_from_file_location("ros2_policy", FILE)
    example = importlib.util.module_from_spec(spec)
    # Its annotations must not be looked up in another module of this name.
    monkeypatch.setitem(sys.modules, "ros2_policy", example)
    spec.loader.exec_module(example)
    return example


def odometry(state, time_s) -> object:
    """What a robot that follows REP 103 reports of a state in NED and FRD."""
    w, x, y, z = (state[f"q{axis}"] for axis in "wxyz")
    # ENU from NED and FRD from FLU are half turns about (1, 1, 0) and (1, 0, 0).
    half = np.sqrt(0.5)
    enu = product((0.0, half, half, 0.0), product((w, x, y, z), (0.0, 1.0, 0.0, 0.0)))
    sent = Odometry()
    sent.header.stamp.sec, part = divmod(round(time_s * 1e9), 10**9)
    sent.header.stamp.nanosec = part
    sent.pose.pose.position = Vector(state["y"], state["x"], -state["z"])
    sent.pose.pose.orientation = Quaternion(*enu[1:], enu[0])
    sent.twist.twist.linear = Vector(state["u"], -state["v"], -state["w"])
    sent.twist.twist.angular = Vector(state["p"], -state["q"], -state["r"])
    return sent


def product(one, other):
    """Hamilton's product of two quaternions (w, x, y, z)."""
    (a, b, c, d), (e, f, g, h) = one, other
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


class Swim:
    """A fish whose every physics step is seen by the node; the node steers it."""

    def __init__(self, example, seed=3, change=lambda message: message):
        self.env = RoboticFish3DEnv(control_hz=PHYSICS_HZ, physics_hz=PHYSICS_HZ)
        self.change, self.steps = change, 0
        goal = {"depth": 0.55, "heading": 0.8, "cruise_speed": 0.1}
        start = {"tail_phase": 0.0}
        self.seen, self.info = self.env.reset(seed=seed, options={"goal": goal, "state": start})
        self.node = example.PolicyNode()
        self.goal = Float64MultiArray([0.55, 0.8, 0.1])
        self.node.subscribed["goal"][1](self.goal)
        self.report()

    def report(self):
        kind, callback = self.node.subscribed["odometry"]
        assert kind is Odometry
        self.node.clock.nanoseconds = round(1e9 * self.steps / PHYSICS_HZ)
        callback(self.change(odometry(self.env.state, self.steps / PHYSICS_HZ)))

    def control(self):
        """One control step: the node is asked once, the fish swims ten physics steps."""
        (period, step), *_ = self.node.timers
        assert period == pytest.approx(1 / CONTROL_HZ)
        step()
        config = self.env.options.config
        targets = np.array(self.node.published[-1].data)
        share = (targets - config.low) / (config.high - config.low)
        for _ in range(PHYSICS_HZ // CONTROL_HZ):
            self.seen, _, ended, _, self.info = self.env.step((2 * share - 1).astype(np.float32))
            self.steps += 1
            self.report()
            if ended:
                break
        return ended


def test_the_node_sees_what_the_environment_shows_and_acts_as_the_policy(ros):
    swim, acted = Swim(ros), []
    act = swim.node.policy.act
    swim.node.policy.act = lambda seen: acted.append((seen, act(seen))) or acted[-1][1]
    agent = PretrainedPolicy(read_policy(shipped("hold")[0]))
    agent.reset(1)
    for _ in range(100):
        shown = swim.seen
        assert not swim.control()
        seen, action = acted[-1]
        # Within a physics step of the environment the frequency stands still, so phases differ.
        np.testing.assert_allclose(seen[PHASE], shown[PHASE], atol=0.02)
        np.testing.assert_allclose(np.delete(seen, PHASE), np.delete(shown, PHASE), atol=1e-3)
        np.testing.assert_allclose(action, agent.act(seen[None])[0], atol=1e-6)


def test_the_node_holds_depth_and_heading(ros):
    swim = Swim(ros)
    for _ in range(400):
        assert not swim.control()
    assert swim.info["is_success"] == 1.0
    assert swim.node.warnings == []


@pytest.mark.parametrize("broken", ["depth", "yaw rate", "heading"])
def test_a_mistake_in_the_frames_is_noticed(ros, broken):
    def change(sent):
        if broken == "depth":
            sent.pose.pose.position.z *= -1
        elif broken == "yaw rate":
            sent.twist.twist.angular.z *= -1
        else:
            q = sent.pose.pose.orientation
            sent.pose.pose.orientation = Quaternion(q.x, q.y, -q.z, q.w)
        return sent

    swim = Swim(ros, change=change)
    assert any(swim.control() for _ in range(400)) or swim.info["is_success"] == 0.0


def test_the_tail_stops_without_goal_or_odometry_and_outside_the_limits(ros):
    swim = Swim(ros)
    swim.control()
    assert any(swim.node.published[-1].data)
    swim.node.clock.nanoseconds += 10**9
    swim.node.timers[0][1]()
    assert not any(swim.node.published[-1].data)
    assert swim.node.warnings[-1] == "stopped: no odometry"
    for wrong, says in ((-0.01, "depth 0.01 m"), (np.nan, "nan")):
        swim = Swim(ros)
        sent = odometry(swim.env.state, 0.0)
        sent.pose.pose.position.z = wrong
        swim.node.subscribed["odometry"][1](sent)
        swim.node.timers[0][1]()
        assert not any(swim.node.published[-1].data)
        assert says in swim.node.warnings[-1]
    node = ros.PolicyNode()
    node.subscribed["odometry"][1](odometry(swim.env.state, 0.0))
    node.timers[0][1]()
    assert not any(node.published[-1].data)
    assert node.warnings == ["stopped: no goal yet"]


def test_a_goal_that_is_none_is_refused(ros):
    swim = Swim(ros)
    for wrong in ([0.5], [0.5, np.nan, 0.1]):
        swim.node.subscribed["goal"][1](Float64MultiArray(wrong))
    assert len(swim.node.warnings) == 2
    swim.control()
    assert any(swim.node.published[-1].data)
