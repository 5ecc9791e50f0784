"""The parts of races: turns, the judge, intervals, predictions and pages, with racers whose pictures have a known error."""

import array
import math
import pathlib
import random
import re
import sys

import pytest
from local_farm import ROOT, bin_dir

sys.path.insert(0, str(ROOT / "python" / "src"))
from lightshaft_command.programs import Problem, Usage  # noqa: E402
from lightshaft_command.race import pages, summary  # noqa: E402
from lightshaft_command.race.forecasts import predictions_of  # noqa: E402
from lightshaft_command.race.judge import check_that_it_judges_itself, judge  # noqa: E402
from lightshaft_command.race.lanes import Made, Turn, next_turn, run_lanes  # noqa: E402
from lightshaft_command.race.model import Conditions, Failure, Lane, Point, Race, Results  # noqa: E402
from lightshaft_command.race.numbers import figure, given, sample_count  # noqa: E402
from lightshaft_command.race.scenes import names_of, references_in  # noqa: E402
from lightshaft_command.race.tool import open_tool  # noqa: E402


@pytest.fixture(scope="module")
def tool():
    with open_tool(bin_dir() / "lightshaft") as tool:
        yield tool


# ---- turns ----


def play(lengths, lap=0):
    """Who runs, in order, in a race of racers with turns of these lengths until each has used 10 s."""
    turns, order = [Turn(False, 0, length) for length in lengths], []
    while (at := next_turn(turns, lap)) is not None:
        used = turns[at].used + lengths[at]
        turns[at] = Turn(used >= 10, used, lengths[at])
        order.append(at)
        lap += 1
    return order


def test_short_turns_alternate():
    order = play([1, 1])

    assert len(order) == 20
    assert all(order[i] != order[i + 1] for i in range(0, 20, 2))


def test_nobody_is_ever_ahead_by_more_than_one_turn():
    lengths, used = [.5, 2, 1], [0, 0, 0]
    for who in play(lengths):
        used[who] += lengths[who]
        assert used[who] - min(used) <= 2 + .5


def test_the_turn_whose_middle_is_earliest_comes_first():
    assert next_turn([Turn(False, 0, 4), Turn(False, 1, 1)], 0) == 1  # 2 and 1.5


def test_each_seed_begins_with_another_and_turns_end_when_all_are_done():
    assert [play([1, 1, 1], lap)[0] for lap in (0, 1, 2)] == [0, 1, 2]
    assert next_turn([Turn(True, 1, 0), Turn(True, 2, 0)], 5) is None and next_turn([], 0) is None


# ---- lanes and their judge ----

SIZE, GREY = (64, 48), .5


class Noise:
    """Its pictures are grey, with normal noise of variance 1 / (speed x seconds) in every value, and the means of their halves.

    Each turn takes a second.
    """

    def __init__(self, speed, time, stem, seed, fails="", order=None, entrant=0):
        self.speed, self.time, self.stem, self.fails, self.used, self.made, self.closed = speed, time, stem, fails, 0, [], False
        self.random, self.order, self.entrant = random.Random(seed), order if order is not None else [], entrant

    def next(self):
        return Turn(self.used >= self.time, self.used, 1)

    def take_turn(self):
        self.order.append(self.entrant)
        if self.fails and self.used >= 2:
            raise Problem(self.fails)
        self.used += 1
        error = 1 / (self.speed * self.used)
        halves = [array.array("f", (self.random.gauss(GREY, math.sqrt(2 * error)) for _ in range(3 * SIZE[0] * SIZE[1]))) for _ in "ab"]
        picture = array.array("f", ((a + b) / 2 for a, b in zip(*halves)))
        for name, pixels in (("a", halves[0]), ("b", halves[1]), (self.used, picture)):
            pathlib.Path(f"{self.stem}.{name}").write_bytes(pixels.tobytes())
        self.made.append(Made(self.used, self.used, 2 * self.used, self.used >= self.time, (error, error, error), f"{self.stem}.{self.used}"))

    def end(self):
        return self.made, [f"{self.stem}.a", f"{self.stem}.b"], ["a note"] if self.entrant == 0 else []

    def close(self):
        self.closed = True


def ran(folder, speeds, seeds, time, second_fails=""):
    """A race of entrants with these speeds, `time` turns each: the race, its lanes, and the entrant of each turn."""
    race = Race("fog", Conditions(time, "wall", 1, None, SIZE), [f"speed {speed}" for speed in speeds])
    order, racers = [], []

    def make(entrant, seed):
        fails = second_fails if (entrant, seed) == (1, 1) else ""
        racers.append(Noise(speeds[entrant], time, folder / f"{entrant}-{seed}", 100 * entrant + seed, fails, order, entrant))
        return racers[-1]

    lanes = run_lanes(len(speeds), seeds, make, lambda seed: None, race.failures)
    assert all(racer.closed for racer in racers), "a process was left behind"
    return race, lanes, order


def test_a_race_goes_seed_by_seed_in_turns(tmp_path):
    _, lanes, order = ran(tmp_path, [1, 1], 2, 3)

    assert order == [0, 1, 0, 1, 0, 1, 1, 0, 1, 0, 1, 0]
    assert len(lanes) == 4 and len(lanes[0].pictures) == 3


def near(value, expected, share):
    return abs(value / expected - 1) <= share


def test_the_true_error_and_ratio_are_found_by_the_other_seeds(tmp_path, tool):
    """A picture has 9216 values with noise of variance v, and the two references have noise of variance vr each.

    If vr <= v, the standard error of the measured mean square is below v sqrt(2 / 9216) (1 + vr / v) < .04 v. Five of them are allowed.
    """
    race, lanes, _ = ran(tmp_path, [1000, 250], 4, 4)

    judge(race, lanes, [True, True], 4, tool)

    assert len(race.lanes) == 8
    for lane in race.lanes:
        v = 1 / (4 * [1000, 250][lane.entrant])
        assert near(lane.points[-1].mse, v, .2) and near(lane.points[-1].relmse, v / (GREY**2 + .01), .2)
    assert "speed 1000" in race.reference and race.reference_noise > 0
    assert race.notes == [f"speed 1000, seed {seed}: a note" for seed in range(4)]
    first, second = summary.rows_of(race)
    assert first.ratio is None
    assert near(second.ratio.value, 4, .1)  # the mean over four seeds, each within about 6 %
    assert second.ratio.lo < 4.4 and second.ratio.hi > 3.6


def test_a_race_goes_on_without_the_one_that_fails(tmp_path, tool):
    race, lanes, _ = ran(tmp_path, [1000, 500, 250], 3, 3, "out of paint")

    assert race.failures == [Failure(1, "out of paint")]
    assert len(lanes) == 6
    judge(race, lanes, [True] * 3, 3, tool)
    assert [row.entrant for row in summary.rows_of(race)] == [0, 2]


def test_a_race_needs_a_reference_or_two_seeds_of_something_that_sees_all_of_the_scene(tmp_path, tool):
    for whole, seeds in (([True], 1), ([False], 2), ([], 2)):
        with pytest.raises(Usage, match="without --reference"):
            check_that_it_judges_itself(whole, seeds)
    race, lanes, _ = ran(tmp_path, [1000], 2, 2)
    with pytest.raises(Usage, match="without --reference"):
        judge(race, lanes, [False], 2, tool)


def test_a_race_that_is_stopped_leaves_no_racer_behind(tmp_path):
    racers = []

    def make(entrant, seed):
        racers.append(Noise(1, 3, tmp_path / "a", 0))
        return racers[-1]

    def stop(seed):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_lanes(2, 1, make, stop, [])
    assert len(racers) == 2 and all(racer.closed for racer in racers)


def test_scenes_are_called_by_their_files_or_folders(tmp_path):
    assert names_of(["a/fog.xml", "b/fog.xml", "c/scene.xml", "fog.xml"]) == ["fog", "fog-2", "c", "fog-3"]
    for name in ("one.exr", "two.0.exr", "two.1.exr", "half.0.exr"):
        (tmp_path / name).touch()
    assert [[file.name for file in references_in(tmp_path, name)] for name in ("one", "two", "half")] == [["one.exr"], ["two.0.exr", "two.1.exr"], []]


# ---- intervals over seeds, against values computed by hand ----


@pytest.mark.parametrize("freedom, quantile", [(1, 12.7062047362), (2, 4.3026527297), (3, 3.1824463053), (4, 2.7764451052), (9, 2.2621571628), (30, 2.0422724563),
                                               (99, 1.9842169516)])
def test_the_quantiles_of_student_are_those_of_the_tables(freedom, quantile):
    assert summary.student_quantile(.05, freedom) == pytest.approx(quantile, abs=1e-9)  # the tables have ten decimals


def test_the_interval_of_a_mean_is_students():
    m = summary.mean([1, 2, 3, 4, 5])

    half = 2.7764451052 * math.sqrt(2.5 / 5)  # the variance is 2.5; t(.975, 4) by the tables
    assert m == pytest.approx((3, 3 - half, 3 + half), abs=1e-8)


def test_the_geometric_mean_is_that_of_logarithms():
    m = summary.geometric_mean([.01, 1, 100])

    half = 4.3026527297 * math.log(100) / math.sqrt(3)  # the logarithms are -L, 0, L: their standard deviation is L
    assert [math.log(v) for v in m] == pytest.approx([0, -half, half], abs=1e-7)


def test_one_seed_says_nothing_of_its_spread():
    assert summary.geometric_mean([2]) == pytest.approx((2, 0, math.inf))
    assert summary.mean([]) is None and summary.geometric_mean([]) is None


@pytest.mark.parametrize("bad", [0, -1, math.nan, math.inf])
def test_what_has_no_logarithm_has_no_geometric_mean(bad):
    assert summary.geometric_mean([1, bad]) is None
    assert summary.geometric_ratio([1, bad], [1, 1]) is None and summary.geometric_ratio([1, 1], [1, bad]) is None
    assert summary.geometric_ratio([1], [1, 1]) is None


def test_what_both_have_in_common_drops_out_of_a_ratio():
    assert summary.geometric_ratio([2, 6, 2], [1, 3, 1]) == pytest.approx((2, 2, 2))  # the machine was slower for one seed


def test_the_slope_of_a_power_is_its_exponent():
    points = [(t, 3 * t**-1.25) for t in (.5, 1, 2, 8)]

    assert summary.log_slope([*points, (4, -1)]) == pytest.approx(1.25)  # the last is below the reference's noise
    assert summary.log_slope(points[:2]) is None and summary.log_slope([(1, 1), (1, .5), (1, .3)]) is None


# ---- curves, predictions and files ----


def lane(entrant, seed, speed, spp, estimated=True):
    """Errors are 1 / (speed x seconds); the estimate is the true error, with an interval of a fifth to each side."""
    points = []
    for n in spp:
        seconds = n / 100
        error = 1 / (speed * seconds)
        points.append(Point(n, seconds, 2 * seconds, seconds, n == spp[-1], (error, error / 1.2, error * 1.2) if estimated else None, error, error))
    return Lane(entrant, seed, points)


def results(clock="wall", others=.01, first_seed=0, second_speed=5):
    race = Race('fog, "thick"', Conditions(10, clock, 2, None, (64, 48)), ["Lightshaft <b>|volpath", "Other"], reference="two files", reference_noise=.001)
    for seed in range(3):
        race.lanes.append(lane(0, seed, 10 + seed, [2, 4, 8, 16, 32, 64, 128, 192, 200 + 2 * seed]))
        race.lanes.append(lane(1, seed, second_speed, [4, 16, 64], estimated=False))
    return Results("two cores of a machine", others, "build 1", 3, first_seed, [race])


def changed(point, **values):
    return point._replace(**values)


def markdown(results):
    return pages.markdown(results, [])


SPEED = (10 * 11 * 12) ** (1 / 3)  # the geometric mean


def test_curves_join_seeds_at_equal_samples_and_at_their_ends():
    curve = summary.curve_of(results().races[0], 0)

    assert len(curve) == 9
    assert curve[0].seconds == pytest.approx(.02) and curve[0].relmse.value == pytest.approx(1 / (.02 * SPEED))
    assert curve[0].relmse.lo < curve[0].relmse.value
    assert curve[8].spp == pytest.approx((200 * 202 * 204) ** (1 / 3))  # the three ends have different sample counts


def test_curves_leave_out_what_the_reference_cannot_see():
    r = results()
    points = r.races[0].lanes[0].points
    points[3] = changed(points[3], relmse=-1e-6)

    assert len(summary.curve_of(r.races[0], 0)) == 8
    assert "1 picture cannot be measured" in markdown(r)


def test_rows_have_efficiency_slope_and_ratio():
    first, second = summary.rows_of(results().races[0])

    assert first.efficiency.value == pytest.approx(SPEED)  # 1 / (error x seconds)
    assert first.slope.value == pytest.approx(1)
    assert second.ratio.value == pytest.approx(SPEED / 5) and second.spread == pytest.approx(1)


def test_predictions_are_made_only_where_their_outcome_is_seen(tool):
    every = predictions_of(results().races[0], tool)

    assert every
    for p in every:
        assert p.entrant == 0, "the other program estimates nothing"
        assert p.spent + p.hi <= 2 * 2.04 + 1e-9, "its interval ends after the race"
        assert p.within() and p.spp >= 8, "errors fall exactly as 1/N, so every prediction is right"


def test_a_prediction_of_a_target_that_is_not_reached_is_wrong(tool):
    r = results()
    for one in r.races[0].lanes:
        if one.entrant == 0:
            one.points[5:] = [changed(p, estimate=(one.points[4].estimate[0], *p.estimate[1:])) for p in one.points[5:]]  # constant from 32 samples on

    early = [p for p in predictions_of(r.races[0], tool) if p.spp == 32]

    assert early and not any(p.within() for p in early)


def test_pages_say_how_many_samples_there_were_and_not_about():
    r = results()
    for one in r.races[0].lanes:
        one.points[-1] = changed(one.points[-1], spp=1024)
    assert "| 1,024 |" in markdown(r) and "1,020" not in markdown(r)
    r.races[0].lanes[0].points[-1] = changed(r.races[0].lanes[0].points[-1], spp=1030)
    assert "| 1,026 |" in markdown(r), "the geometric mean, 1025.998, of seeds that differ"


def test_tables_keep_their_columns_whatever_names_are(tool):
    files = pages.files_of(results(), tool)

    assert '\n"fog, ""thick""",Lightshaft <b>|volpath,0,2,0.02,0.04,0.02,5,' in files["points.csv"]
    assert ",Other,3,64,0.64,0.3125," in files["summary.csv"]
    assert files["forecasts.csv"].startswith("scene,entrant,seed,spp,spent,target,predicted,lo,hi,actual,within\n")
    later = results(first_seed=101)
    assert "|volpath,101,2,0.02," in pages.points_csv(later) and "The seeds are 101 to 103" in markdown(later), "the seed that makes it again"


def test_pages_escape_what_scenes_and_programs_say(tool):
    r = results()
    r.races[0].failures.append(Failure(1, "<script>alert(1)</script>\x1b[2J"))
    files = pages.files_of(r, tool)

    assert "<script>" not in files["index.html"] and "<b>" not in files["index.html"] and "&lt;script&gt;" in files["index.html"]
    assert "\x1b" not in files["index.html"]
    assert "Lightshaft \\<b\\>\\|volpath" in files["report.md"] and "(fog___thick_.svg)" in files["report.md"]
    assert "<svg" in files["fog___thick_.svg"]


def test_pages_say_when_the_machine_was_busy():
    assert "Nothing else ran" in markdown(results())
    loud = markdown(results(others=.4))
    assert "had 40.0 % of its cores' time" in loud and "Wall seconds on a busy machine say little" in loud
    assert "ratios hold better" in markdown(results(clock="cpu", others=.4))
    assert "is not known" in markdown(results(others=-1))


def test_pages_of_one_seed_claim_no_interval(tool):
    r = results()
    r.races[0].lanes = [one for one in r.races[0].lanes if one.seed == 0]

    for name in ("report.md", "index.html", "summary.csv"):
        assert not re.search(r"\binf\b|nan", pages.files_of(r, tool)[name])


@pytest.mark.parametrize("text, value", [("0.0213", .0213), ("3.20 × 10⁻⁵", 3.2e-5), ("10.0", 9.996), ("0", 0), ("1,230", 1234), ("1.23 × 10⁵", 123456), ("–", math.inf)])
def test_figures_have_three_digits(text, value):
    assert figure(value) == text


def test_numbers_that_users_chose_and_counts_keep_their_digits():
    assert [given(x) for x in (10, .001, 2e-5, 0)] == ["10", "0.001", "2.00 × 10⁻⁵", "0"]
    assert [sample_count(x) for x in (2, 5.66, 100, 1024)] == ["2", "5.7", "100", "1,024"]


def test_the_tool_says_what_is_wrong_and_goes_on(tool, tmp_path):
    (tmp_path / "no.exr").write_text("this is no picture")
    for file in ("no.exr", "none.exr"):
        with pytest.raises(Usage, match=file):
            tool.reference([tmp_path / file], (4, 3))
    assert tool.forecast([], 1e-3) is None


def test_a_tool_that_has_ended_is_named_by_what_it_does():
    with open_tool("/bin/true") as ended, pytest.raises(Problem, match="the program that measures images has ended; run it again"):
        ended.forecast([], 1e-3)
