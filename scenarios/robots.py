"""What a scene file may assume of a robot, by model name. `sim` owns the robot; a test holds the two together."""

from dataclasses import dataclass


@dataclass(frozen=True)
class RobotFacts:
    """`crumb_extent`: the gripper's smallest graspable extent in metres: what is smaller in every direction is a crumb.

    `q_max_deg` (7,): each joint turns between minus and plus this angle. `links`: names of its parts, taken for
    objects' names since contacts are reported by name; `base` is the one that stands on the floor.
    """

    crumb_extent: float
    q_max_deg: tuple[float, ...]
    links: frozenset[str]
    base: str


ROBOTS = {
    "iiwa14_wsg50": RobotFacts(
        crumb_extent=0.03,
        q_max_deg=(170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0),
        links=frozenset({*(f"link_{i}" for i in range(8)), "hand", "finger_left", "finger_right"}),
        base="link_0",
    )
}
