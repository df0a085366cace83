"""How things stand when a run ends, so that another can go on from there: what `state.json` holds."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np
import pinocchio as pin

from scenarios.goal import check_goal, parse_goal
from scenarios.scenario import Scenario


@dataclass(frozen=True)
class RunState:
    """q (7,) in rad, opening of the hand in m, the body held (None for none) and the force in N of each finger, poses
    of bodies and of regions as position and quaternion xyzw in W; bodies that aren't there are left out. goal: what was
    wanted at the end; late: bodies that were still to come."""

    q: tuple[float, ...]
    opening: float
    held: str | None
    grip_n: float
    poses: Mapping[str, tuple[float, ...]]
    regions: Mapping[str, tuple[float, ...]]
    goal: str
    late: tuple[str, ...]

    def to_json(self) -> str:
        """The state as indented JSON text."""
        return json.dumps(asdict(self), indent=1, ensure_ascii=False) + "\n"

    @staticmethod
    def from_json(text: str) -> "RunState":
        """Read what `to_json` wrote. Raises ValueError for anything else."""
        try:
            data = json.loads(text)
            data |= {key: tuple(data[key]) for key in ("q", "late")}
            return RunState(**data)
        except (TypeError, KeyError, AttributeError) as error:
            raise ValueError(f"not a run's state: {error}") from None

    def gone(self, scenario: Scenario) -> tuple[str, ...]:
        """Bodies of the scenario that should be there and are not; its late ones need not be."""
        return tuple(name for name in scenario.bodies if name not in self.poses and name not in scenario.late)

    def applied(self, scenario: Scenario) -> Scenario:
        """The scenario as it stands in this state. Raises ValueError if it is of another scene."""
        strangers = {*self.poses, *self.late} - scenario.bodies.keys() | self.regions.keys() - scenario.regions.keys()
        if strangers:
            raise ValueError(f"state of another scene: it knows no {', '.join(sorted(strangers))}")
        check_goal(parse_goal(self.goal), scenario.bodies, scenario.regions)
        bodies = dict(scenario.bodies)
        for name, pose in self.poses.items():
            bodies[name] = replace(bodies[name], X_WO=pin.XYZQUATToSE3(np.array(pose)))
        regions = dict(scenario.regions)
        for name, pose in self.regions.items():
            regions[name] = replace(regions[name], X_WR=pin.XYZQUATToSE3(np.array(pose)))
        robot = replace(scenario.robot, q0=np.array(self.q))
        now = replace(scenario, robot=robot, bodies=bodies, regions=regions, goal=self.goal)
        return replace(now, late=frozenset(self.late), disturbances=())
