"""A stroke as it is carried out: was its crumb taken out of it?"""

from collections.abc import Callable

import numpy as np
from py_trees.common import Status

from planner.refinement import Refinement
from planner.task.facts import place_of
from scenarios.shapes import middle
from sim.scene import SceneState
from skills.contact_guard import ContactGuard
from skills.context import ActionRun, SkillContext
from skills.gathering import Place
from skills.strokes import Stroke, is_lost

JUMP = 0.02
"""Metres from one look to the next (20 ms): what the sponge loses goes by less."""

LOST_FOR = 0.06
"""Seconds for which a crumb must be seen out of the stroke: poses are noisy."""


class CrumbInStroke(ContactGuard):
    """Does the rest of the stroke still take along the crumb that it is for? For motions in contact: how far the stroke
    has come is seen from where the sponge is.

    Only a crumb that someone moved ends the stroke, at once. One that the sponge lost is missed at the end, from which
    it is learned how to press, and what comes along isn't left lying for it.
    """

    def __init__(self, run: ActionRun, context: SkillContext, where: Callable[[SceneState], Place | None]) -> None:
        super().__init__("crumb in stroke?", run, context)
        self._where = where
        self._forget()

    def _forget(self) -> None:
        self._place: Place | None = None
        self._last: np.ndarray | None = None
        self._has_jumped = False
        self._lost_since: float | None = None

    def terminate(self, new_status: Status) -> None:
        if new_status == Status.INVALID:
            self._forget()

    def what_changed(self, refinement: Refinement) -> str | None:
        stroke, speed = refinement.sample.stroke, refinement.sample.pressing.speed
        name, _, pan = self._run.action.args[:3]
        scene, now = self._context.scene, self._context.observation.t
        if name not in scene.poses:
            return f"{name} is gone"
        point = scene.poses[name].translation[:2]
        if self._last is not None and np.linalg.norm(point - self._last) > JUMP:
            self._has_jumped = True
        self._last = point
        if self._place is None:
            self._place = self._where(scene)
        if not self._has_jumped or place_of(scene, name) == pan or not self._is_lost(stroke, speed, point):
            self._lost_since = None
        elif self._lost_since is None:
            self._lost_since = now
        is_certain = self._lost_since is not None and now - self._lost_since >= LOST_FOR
        return f"{name} was moved" if is_certain else None

    def _is_lost(self, stroke: Stroke, speed: float, point: np.ndarray) -> bool:
        context, place = self._context, self._place
        held, name = context.scene.held, self._run.action.args[0]
        if held is None or place is None:
            return False
        sponge = context.scene.poses[held.name].act(middle(context.scene.scenario.bodies[held.name].shape))
        centre = float(stroke.met(sponge[None, :2], place.tool.span / 2)[0][0])
        if not np.isfinite(centre):
            return False
        late = context.observation.t - context.observation.seen_at.get(name, context.observation.t)
        way = max(centre + place.tool.depth / 2 - speed * late, 0.0)
        radius = float(place.crumbs.r[place.crumbs.names.index(name)])
        return is_lost(stroke.after(way), place.tool, place.opening, point, radius)
