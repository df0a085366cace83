"""The behaviour tree of everything that tows."""

from collections.abc import Callable

from py_trees.behaviour import Behaviour

from planner.motion.motion_planner import MotionPlanner
from sim.scene import SceneState
from skills.conditions import Achieved
from skills.context import ActionRun, SkillContext
from skills.motions import Follow, FollowIfAny, Open, Touch, guarded, sequence
from skills.refine import PathFree, Refine
from skills.taken_along import KeepPressing, Predict, TakenAlong, Tow


def towing_tree(
    motion: MotionPlanner,
    run: ActionRun,
    context: SkillContext,
    predict: Predict,
    is_there: Callable[[SceneState], bool],
) -> Behaviour:
    """Reach, touch, tow and let go. `predict` is the skill's; `is_there` tells whether the object is where it was to
    be, or near enough."""
    reach = sequence(
        "to the object",
        FollowIfAny("draw back", run, context),
        Open("close", run, context),
        Follow("pre-drag", run, context),
        Follow("approach", run, context),
    )
    towing = Tow("drag", run, context, predict)
    contact = sequence(
        "in contact",
        Touch("descend", run, context),
        guarded("pull", TakenAlong(towing, run, context), towing),
    )
    return sequence(
        str(run.action),
        guarded("reach", Refine(run, context, motion), reach),
        guarded("watched", PathFree(run, context, motion), contact),
        Follow("retract", run, context),
        Achieved(is_there, run, context),
        KeepPressing(towing, run),
    )
