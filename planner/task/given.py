"""Hand-written PDDL in the place of the catalogue's: read, made to fit the primitives, held against the scene."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from planner.task.facts import OBSERVED, Optimism, facts, objects_of, observed_facts, stated_in
from planner.task.pddl import Domain, Problem
from planner.task.pddl_reader import read_domain, read_problem, read_text
from planner.task.primitives import AWAY, GRASPABLE, STUCK, adapted, with_away
from planner.task.sexpr import PddlError
from planner.task.situation import is_displaced, whereabouts
from planner.task.symbols import Fact
from scenarios.names import known
from sim.scene import SceneState


@dataclass(frozen=True)
class Given:
    """A hand-written problem and the scene that it was written for."""

    problem: Problem
    start: SceneState

    def facts(self, domain: Domain, scene: SceneState, learned: Optimism) -> frozenset[Fact]:
        """What holds now: what the scene decides is taken from it, everything else from the file.

        What the file doesn't call graspable stays so until it lies elsewhere.
        """
        names = {**domain.constants, **self.problem.objects}
        known_now = stated_in(domain, names, facts(scene, learned))
        init = self.problem.init
        stiff = {
            fact
            for fact in known_now - init
            if fact.predicate == GRASPABLE
            and not is_displaced(whereabouts(self.start, fact.args[0]), whereabouts(scene, fact.args[0]))
        }
        own = {fact for fact in init if fact.predicate not in OBSERVED | {AWAY, GRASPABLE, STUCK}}
        return (known_now - stiff) | own


def read_given(
    domain_file: Path, problem_file: Path, primitives: Mapping[str, int], scene: SceneState
) -> tuple[Domain, Given]:
    """Read hand-written files for a scene; `primitives` gives the number of own arguments by primitive.

    Raises PddlError for what can't be read or doesn't fit the primitives or the scene.
    """
    domain = adapted(read_domain(read_text(domain_file), str(domain_file)), primitives, str(domain_file))
    problem = read_problem(read_text(problem_file), domain, str(problem_file))
    _check_names(domain.constants, domain.places, str(domain_file), scene)
    _check_names(problem.objects, problem.places, str(problem_file), scene)
    _check_init(problem, str(problem_file), scene)
    return with_away(domain), Given(problem, scene)


def _check_names(names: Mapping[str, str], places: Mapping, file: str, scene: SceneState) -> None:
    there = objects_of(scene)
    for name in names:
        if name not in there:
            raise PddlError(f"object {name!r} isn't in the scene, {known(name, there)}", file, places.get(name))


def _check_init(problem: Problem, file: str, scene: SceneState) -> None:
    true = observed_facts(scene)
    for fact in sorted(problem.init):
        if fact.predicate in OBSERVED and fact not in true:
            same = sorted(f.pddl for f in true if f.predicate == fact.predicate and f.args[:1] == fact.args[:1])
            expected = f"expected {' or '.join(same)}" if same else "expected it left out"
            raise PddlError(f"{fact.pddl} doesn't hold in the scene, {expected}", file, problem.places.get(fact))
