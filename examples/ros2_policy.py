"""A ROS 2 node that steers the fish with an exported policy.

It needs the two files of `robofish export hold --onnx hold.onnx` and, beside ROS 2, only NumPy and
onnxruntime:

    python3 ros2_policy.py --ros-args -p model:=hold.onnx

Subscribed: ``odometry`` (nav_msgs/Odometry, world ENU and body FLU as REP 103 has it) and ``goal``
(std_msgs/Float64MultiArray: depth m, heading rad clockwise from north, speed m/s and, if they
change, the rates of depth and heading). Published: ``targets`` (std_msgs/Float64MultiArray), the
five actuators in the order of the contract, in SI units. The robot's servo beats as
offset + amplitude * sin(phase); the phase is that of the published frequencies, from zero.
"""

from __future__ import annotations

import json
from collections import deque
from pathlib import Path

import numpy as np
import onnxruntime
import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray

NED_FROM_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FRD_FROM_FLU = np.diag([1.0, -1.0, -1.0])
LONGEST_GAP_S = 0.5
"""Without odometry for so long the tail is stopped."""
TURN = 2.0 * np.pi


def rotation(w: float, x: float, y: float, z: float) -> np.ndarray:
    """Rotation matrix (3, 3), body to world, of a unit quaternion."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Policy:
    """The exported model with its memory.

    Args:
        model: the ONNX file; its contract is beside it.
    """

    def __init__(self, model: Path) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        cpu = ["CPUExecutionProvider"]
        self._session = onnxruntime.InferenceSession(str(model), options, providers=cpu)
        self._past = [i.shape[1] for i in self._session.get_inputs() if i.name == "past"]
        self.reset()

    def reset(self) -> None:
        """The next observation is the first of a swim."""
        self._first = True
        self._memory = np.zeros((1, *self._past), np.float32)

    def act(self, observation: np.ndarray) -> np.ndarray:
        """The action (5,) in [-1, 1] for an observation (33,)."""
        feeds = {"observation": observation[None].astype(np.float32)}
        if self._past:
            feeds |= {"past": self._memory, "first": np.array([[self._first]])}
        action, *after = self._session.run(None, feeds)
        self._first = False
        if after:
            self._memory = after[0]
        return action[0]


class Actuators:
    """Where the actuators are: they move to their targets at limited rates.

    Args:
        entries: of the action, from the contract.
    """

    def __init__(self, entries: list[dict]) -> None:
        self.low = np.array([entry["low"] for entry in entries])
        self.high = np.array([entry["high"] for entry in entries])
        rates = [entry["most_per_s"] for entry in entries]
        self._rate = np.array([np.inf if rate is None else rate for rate in rates])
        self._frequency = [entry["name"] for entry in entries].index("tail_frequency")
        self.positions = np.zeros(len(entries))
        self.targets = np.zeros(len(entries))
        self.phase = 0.0

    @property
    def frequency(self) -> float:
        """Tail frequency now (Hz)."""
        return float(self.positions[self._frequency])

    def aim(self, action: np.ndarray) -> None:
        """Sets the targets that an action in [-1, 1] means."""
        share = (np.clip(action, -1.0, 1.0) + 1.0) / 2.0
        self.targets = self.low + share * (self.high - self.low)

    def advance(self, seconds: float) -> None:
        """Moves towards the targets; the tail's phase goes on with its frequency."""
        most = self._rate * seconds
        move = np.clip(self.targets - self.positions, -most, most)
        before, i = self.frequency, self._frequency
        self.positions = self.positions + move
        ramp = min(seconds, abs(move[i]) / self._rate[i])
        beats = (before + self.frequency) / 2 * ramp + self.frequency * (seconds - ramp)
        self.phase = (self.phase + TURN * beats) % TURN


class Motion:
    """The fish's motion from odometry, with means over the last tail beat.

    Args:
        longest_s: longest window of a mean (s).
    """

    def __init__(self, longest_s: float) -> None:
        self._longest = longest_s
        self._integrals: deque[np.ndarray] = deque()
        self._last: np.ndarray | None = None
        self.turn = np.eye(3)
        self.depth = 0.0
        self.velocity = self.rates = np.zeros(3)

    def take(self, message: Odometry) -> None:
        """Takes a message; after a gap the past is forgotten."""
        q, p = message.pose.pose.orientation, message.pose.pose.position
        v, r = message.twist.twist.linear, message.twist.twist.angular
        self.turn = NED_FROM_ENU @ rotation(q.w, q.x, q.y, q.z) @ FRD_FROM_FLU
        self.depth = -p.z
        self.velocity = FRD_FROM_FLU @ np.array([v.x, v.y, v.z])
        self.rates = FRD_FROM_FLU @ np.array([r.x, r.y, r.z])
        level = self.turn[:2, 0] / max(np.hypot(*self.turn[:2, 0]), 1e-9)
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        self._integrate(stamp, np.array([*level, self.velocity[0]]))

    def _integrate(self, now: float, value: np.ndarray) -> None:
        """Integrals over time of the cosine and sine of the heading, and of the surge speed."""
        past = self._integrals
        if not past or not 0.0 <= now - past[-1][0] < LONGEST_GAP_S:
            past.clear()
            # As if heading and speed had been what they are now for a while.
            past.append(np.array([now - self._longest - 1.0, *(-(self._longest + 1.0) * value)]))
            past.append(np.array([now, 0.0, 0.0, 0.0]))
        else:
            area = (now - past[-1][0]) * (value + self._last) / 2.0
            past.append(np.array([now, *(past[-1][1:] + area)]))
        self._last = value
        while len(past) > 2 and past[1][0] < now - self._longest:
            past.popleft()

    def beat_means(self, frequency: float) -> tuple[float, float, float]:
        """Cosine and sine of the mean heading vector over the last beat, and mean surge (m/s)."""
        window = min(1.0 / frequency, self._longest) if frequency > 0.0 else self._longest
        rows = np.array(self._integrals)
        begin = rows[-1, 0] - window
        means = [
            (rows[-1, i] - np.interp(begin, rows[:, 0], rows[:, i])) / window for i in (1, 2, 3)
        ]
        length = max(np.hypot(means[0], means[1]), 1e-9)
        return means[0] / length, means[1] / length, means[2]


def turned(cosine: float, sine: float, heading: float) -> tuple[float, float]:
    """Sine and cosine of the error: a goal heading (rad) minus the heading given by both."""
    error = heading - np.arctan2(sine, cosine)
    return float(np.sin(error)), float(np.cos(error))


class PolicyNode(Node):
    """Turns odometry and a goal into targets of the actuators."""

    def __init__(self) -> None:
        super().__init__("robofish_policy")
        model = Path(self.declare_parameter("model", "policy.onnx").value)
        self.contract = json.loads(Path(f"{model}.json").read_text(encoding="utf-8"))
        self.policy = Policy(model)
        actions = self.contract["action"]["entries"]
        self.actuators = Actuators(actions)
        self.motion = Motion(self.contract["beat"]["longest_s"])
        entries = self.contract["observation"]["entries"]
        self._subtract = np.array([entry["subtract"] for entry in entries])
        self._divide = np.array([entry["divide_by"] for entry in entries])
        self._rest = np.array([action["at_rest"] for action in actions])
        self._action = self._rest
        self._goal: np.ndarray | None = None
        self._seen_s = -np.inf
        self._period = 1.0 / self.contract["rate_hz"]
        self._publisher = self.create_publisher(Float64MultiArray, "targets", 1)
        self.create_subscription(Odometry, "odometry", self.on_odometry, 10)
        self.create_subscription(Float64MultiArray, "goal", self.on_goal, 1)
        self.create_timer(self._period, self.step)

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def on_odometry(self, message: Odometry) -> None:
        """Takes where the fish is and how it moves."""
        self.motion.take(message)
        self._seen_s = self._now()

    def on_goal(self, message: Float64MultiArray) -> None:
        """Takes a goal: depth, heading, speed, rate of depth, rate of heading."""
        if len(message.data) not in (3, 5) or not np.all(np.isfinite(message.data)):
            self.get_logger().warning("goal: give 3 or 5 finite numbers; the last goal stays")
            return
        self._goal = np.array([*message.data, 0.0, 0.0])[:5]

    def observation(self) -> np.ndarray:
        """What the policy sees (33,), in the order of the contract, scaled and clipped."""
        depth, heading, speed, depth_rate, heading_rate = self._goal
        motion, turn = self.motion, self.motion.turn
        cosine, sine, surge = motion.beat_means(self.actuators.frequency)
        level = max(np.hypot(*turn[:2, 0]), 1e-9)
        phase = self.actuators.phase
        physical = [
            depth - motion.depth,
            turn[2] @ motion.velocity,
            depth_rate,
            motion.depth,
            *turned(cosine, sine, heading),
            *turned(turn[0, 0], turn[1, 0], heading),
            heading_rate,
            speed - surge,
            speed,
            *(turn[2, 1] / level, turn[2, 2] / level),  # roll
            *(-turn[2, 0], level),  # pitch
            *motion.velocity,
            *motion.rates,
            *(np.sin(phase), np.cos(phase)),
            *self.actuators.positions,
            *self._action,
        ]
        limit = self.contract["observation"]["limit"]
        return np.clip((np.array(physical) - self._subtract) / self._divide, -limit, limit)

    def trouble(self) -> str:
        """Why the tail must be stopped; empty if it need not."""
        limits = self.contract["limits"]
        if self._goal is None:
            return "no goal yet"
        if self._now() - self._seen_s > LONGEST_GAP_S:
            return "no odometry"
        if not limits["shallowest_m"] <= self.motion.depth <= limits["deepest_m"]:
            return f"depth {self.motion.depth:.2f} m is outside the limits of the policy"
        if self.motion.turn[2, 2] < np.cos(limits["steepest_rad"]):
            return "tilted beyond the limit of the policy"
        return "" if np.all(np.isfinite(self.observation())) else "odometry is not finite"

    def step(self) -> None:
        """One control step: publishes targets, or zeros where the policy must not swim."""
        self.actuators.advance(self._period)
        why = self.trouble()
        if why:
            self.get_logger().warning(f"stopped: {why}", throttle_duration_sec=5.0)
            self.policy.reset()
            self._action = self._rest
            self.actuators.targets = np.zeros_like(self.actuators.targets)
        else:
            self._action = np.clip(self.policy.act(self.observation()), -1.0, 1.0)
            self.actuators.aim(self._action)
        self._publisher.publish(Float64MultiArray(data=self.actuators.targets.tolist()))


def main() -> None:
    """Runs the node until it is stopped."""
    rclpy.init()
    node = PolicyNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
