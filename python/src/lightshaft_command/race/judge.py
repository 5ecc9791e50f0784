"""Measures the pictures of a race against references from files, or against the pictures of other seeds."""

from collections.abc import Sequence

from lightshaft_command.programs import Usage
from lightshaft_command.race.lanes import Ran
from lightshaft_command.race.model import Lane, Point, Race
from lightshaft_command.race.tool import Tool

NO_JUDGE = (
    "without --reference the pictures are measured against those of the other seeds by an integrator that sees all of the scene: "
    "there must be one, and two seeds at least"
)


class NoJudge(Usage):
    """Nobody can make the reference."""

    def __init__(self) -> None:
        super().__init__(NO_JUDGE)


def check_that_it_judges_itself(whole: Sequence[bool], seeds: int) -> None:
    """`whole`: of each entrant, whether it renders all features of the scene. NoJudge: there is no reference then."""
    if seeds < 2 or not any(whole):
        raise NoJudge


def _best_of(whole: Sequence[bool], lanes: Sequence[Ran], seeds: int) -> int:
    """The entrant whose final pictures have the smallest estimated relMSE, summed over the seeds, of those that render all of the scene."""
    errors = {}
    for entrant, sees_all in enumerate(whole):
        own = [lane.pictures[-1].estimate[0] for lane in lanes if lane.entrant == entrant and lane.pictures]
        if sees_all and len(own) == seeds:
            errors[entrant] = sum(own)
    if not errors:
        raise NoJudge
    return min(errors, key=lambda entrant: errors[entrant])


def judge(race: Race, lanes: Sequence[Ran], whole: Sequence[bool], seeds: int, tool: Tool) -> None:
    """Adds the lanes, measured, to the race. `race.reference` in words: the tool has a reference; without, each seed gets its own.

    It is made from final pictures of one entrant: of those that render all of the scene, the one with the smallest estimated error. Its
    pictures of all other seeds give the two pictures of the reference: the mean of their halves A (even samples), and the mean of their
    halves B (odd samples). These are independent of the pictures of this seed and of each other.
    """
    race.notes += [f"{race.entrants[lane.entrant]}, seed {lane.seed}: {note}" for lane in lanes for note in lane.notes]
    best = None
    if not race.reference:
        check_that_it_judges_itself(whole, seeds)
        best = _best_of(whole, lanes, seeds)
        race.reference = (
            f"the final pictures of all other seeds by {race.entrants[best]}: the means of their halves are two references, independent of each "
            "other and of the picture"
        )
    c = race.conditions
    for seed in range(seeds):
        if best is not None:
            others = [(lane.halves[0], lane.halves[1], lane.pictures[-1].spp) for lane in lanes if lane.entrant == best and lane.seed != seed]
            noise = tool.reference_of_halves(others, c.size)
            if seed == 0:
                race.reference_noise = noise
        for lane in lanes:
            if lane.seed == seed:
                points = [Point(p.spp, p.wall, p.cpu, c.seconds(p.wall, p.cpu), p.last, p.estimate, *tool.errors(p.picture)) for p in lane.pictures]
                race.lanes.append(Lane(lane.entrant, seed, points))
