# pyright: reportMissingImports=false
import hashlib
import importlib
import sys
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from dynslam_cli.bench.suites import (
    AMONG_PEOPLE,
    FAULTS,
    PEOPLE,
    SENSORS,
    change,
    drive,
    faults,
    flipping,
    logs,
    paper,
    sensors,
    worlds,
    worse,
)
from dynslam_cli.bench.user_suite import read_suite
from dynslam_cli.trials.scoring import LogScorer, TruthScorer, scorer, stem
from dynslam_cli.trials.sources import LogFile, SimulatedDrive

from dynslam_env import (
    LASERS,
    WORLDS,
    Corridor,
    Doors,
    DoorWorldEnv,
    Gap,
    Lag,
    Laser,
    MixedPixels,
    Odometry,
    OdometryScale,
    Slip,
    Surfaces,
    Uniform,
)
from dynslam_env.simulation.registry import NAMED_LAWS, NAMED_WORLDS
from slam.benchmark.results import read
from slam.benchmark.run import build, run
from slam.episode import Episode
from slam.errors import InputError
from slam.io.carmen.writer import write_carmen
from slam.io.episode_file import save_episode
from slam.io.tum import write_tum
from slam.trajectory import Trajectory


def test_the_paper_has_every_seed_under_both_door_laws_and_every_variant():
    trials = paper().trials(["static-ml", "odometry"], range(5000, 5030), 60.0)
    assert len({trial.name for trial in trials}) == len(trials) == 30 * 2 * 2
    assert sum(trial.pictured for trial in trials) == 2 * 2  # the first seed of each
    assert {t.condition["doors"] for t in trials} == {"static", "moving"}


def test_trials_of_one_episode_follow_one_another():
    trials = paper().trials(["static-ml", "odometry", "dynamic-ml"], range(2), 60.0)
    keys = [trial.source.key for trial in trials]
    assert all(len(set(keys[k : k + 3])) == 1 for k in range(0, len(keys), 3))


def test_all_worlds_are_in_worlds():
    assert [case.condition["world"] for case in worlds().cases] == list(WORLDS)


@pytest.mark.parametrize("world", list(WORLDS))
def test_what_is_recorded_is_what_the_source_says(world):
    source = drive(world, 5000, max_episode_steps=20)
    assert source.make().meta["config"] == source.plain()["config"]


def test_the_planes_of_change_are_full_and_name_two_factors_each():
    planes = {}
    for case in change().cases:
        assert len(case.condition) == 3
        names = tuple(n for n in case.condition if n != "plane")
        planes.setdefault((case.condition["plane"], names), []).append(case)
        case.source(0).plain()  # the environment takes its parameters
    assert [len(cases) for cases in planes.values()] == [16, 16, 16]
    trials = change().trials(["static-ml"], range(1), 1.0)
    assert len({trial.name for trial in trials}) == 48  # though planes share some episodes
    assert len({trial.source.key for trial in trials}) == 43


def test_every_fault_is_in_every_world_beside_the_same_drive_without_it():
    suite = faults()
    faulty = [case for case in suite.cases if case.condition["fault"] in FAULTS]
    assert len({str(case.condition) for case in faulty}) == 3 * len(FAULTS) == 45
    for case in faulty:
        source = case.source(7)
        assert isinstance(source, SimulatedDrive)
        scale, *given = source.parameters["faults"]
        assert scale == OdometryScale(1.01)
        assert tuple(given) == FAULTS[str(case.condition["fault"])]
    assert FAULTS["none"] == ()


def test_people_walk_through_drives_without_a_fault():
    walked = [case for case in faults().cases if case.condition["fault"] == "none, people"]
    assert {str(case.condition["world"]) for case in walked} == set(AMONG_PEOPLE)
    for case in walked:
        source = case.source(7)
        assert isinstance(source, SimulatedDrive)
        assert source.parameters["world"].people == PEOPLE
        assert "faults" not in source.parameters


def test_faults_leave_the_drive_as_it_was():
    cases = {c.condition["fault"]: c for c in faults().cases if c.condition["world"] == "corridor"}
    usual, slipped, blind = (
        cases[name].source(7).make() for name in ("none", "slip 0.8 m", "gap 10 s")
    )
    assert (slipped.truth.poses == usual.truth.poses).all()
    assert 10.0 <= slipped.meta["faults"]["Slip"] <= 20.1
    assert len(usual.scans) - len(blind.scans) == 100
    assert blind.times[-1] == usual.times[-1]


def test_doors_flip_as_often_as_is_said():
    law = flipping(4.8).law
    assert law == Doors().law  # the paper's
    assert 60 / (0.5 * (flipping(24).law.shortest + flipping(24).law.longest)) == 24


def test_a_worse_odometry_has_so_many_times_the_deviations():
    assert worse(1.0) == Odometry()
    assert worse(2.0).bias == 2 * Odometry().bias
    assert worse(2.0).alpha1 == 4 * Odometry().alpha1  # a variance


def test_an_interval_leaves_scans_out_and_keeps_the_odometry():
    whole, thin = (drive("DoorCorridor-v0", 3, every=k).make() for k in (1, 10))
    assert thin.times.tolist() == whole.times[::10].tolist()
    assert len(thin.odometry) == len(whole.odometry)
    assert (thin.truth.poses == whole.truth.poses[::10]).all()
    assert (thin.truth.doors == whole.truth.doors[::10]).all()


# -- logs ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def episode() -> Episode:
    return drive("DoorCorridor-v0", 4, max_episode_steps=120).make()


@pytest.fixture
def folder(tmp_path, episode):
    """A log with a reference, one without, an episode with the truth."""
    home = tmp_path / "logs"
    home.mkdir()
    write_carmen(episode, home / "with.log.gz")
    write_tum(Trajectory(episode.times, episode.truth.poses), home / "with.tum")
    write_carmen(episode, home / "plain.log")
    write_carmen(episode, home / "true.log")
    save_episode(episode, home / "true.npz")
    return home


def test_a_folder_of_logs_is_scored_with_what_lies_beside_them(bench, folder, tmp_path):
    assert bench("logs", "--logs", str(folder), "--variants", "static-ml,odometry") == 0
    rows = {(r["log"], r["variant"]): r for r in read(tmp_path / "out" / "results.jsonl")}
    assert len(rows) == 3 * 2
    assert rows["with", "static-ml"]["ate_aligned"] < 0.03
    assert rows["with", "odometry"]["ate_aligned"] > 0.1
    assert rows["with", "static-ml"]["stamps"] == 121
    assert "ate_aligned" not in rows["plain", "static-ml"]
    plain = (rows["plain", name]["agreement"] for name in ("static-ml", "odometry"))
    assert next(plain) > 0.9 > next(plain) + 0.1
    assert rows["plain", "static-ml"]["matched"] > 50
    assert rows["true", "static-ml"]["ate"] < 0.03  # the npz, not the log of its name


def test_real_logs_have_their_relations(shared_data):
    suite = logs(shared_data)
    names = [case.condition["log"] for case in suite.cases]
    assert names == sorted(names)
    assert {"aces", "csail", "intel"} <= set(names)
    found = LogScorer(LogFile(shared_data / "intel.log.gz"), Episode.__new__(Episode))
    assert len(found._relations) == 2984


def test_the_truth_in_an_episode_goes_before_all_else(episode):
    assert isinstance(scorer(LogFile(None), episode), TruthScorer)  # type: ignore[arg-type]
    found = scorer(LogFile(None), episode)(run(build("odometry", episode), episode))  # type: ignore[arg-type]
    assert found["ate_bound"] is not None


def test_a_log_that_cannot_be_read_is_a_result_and_a_folder_is_no_log(bench, folder, tmp_path):
    (folder / "bad.npz").write_bytes(b"no episode")
    (folder / "folder.log").mkdir()
    assert bench("logs", "--logs", str(folder), "--variants", "odometry") == 0
    errors = {r["log"]: r["error"] for r in read(tmp_path / "out" / "results.jsonl")}
    assert errors.keys() == {"with", "plain", "true", "bad"}
    assert errors["bad"].startswith("InputError: ")
    assert "bad.npz: no scan in 1 lines" in errors["bad"]
    assert [name for name, error in errors.items() if error] == ["bad"]


def test_a_folder_without_logs_is_refused(tmp_path):
    with pytest.raises(InputError, match="no log in it"):
        logs(tmp_path)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("a.log.gz", "a"), ("a.b.log", "a.b"), ("x.npz", "x"), ("x.clf", "x"), ("x.txt", "x.txt")],
)
def test_the_name_of_a_log_is_without_its_ending(name, expected):
    assert stem(name) == expected


# -- a suite of the user's own ---------------------------------------------------------------------

OWN = """
name = "mine"
variants = ["dynamic-ml", "odometry"]
seeds = 3

[[case]]
name = "fast doors, short sight"
env = "DoorCorridor-v0"
every = 2
max_episode_steps = 300
world = { length = 20.0, doors_per_side = 6 }
doors = { open_share = 0.3, law = { kind = "Uniform", shortest = 1.0, longest = 3.0 } }
laser = { max_range = 4.0, beams = 91 }
odometry = { bias = 0.0 }

[[case]]
env = "DoorLoop-v0"
doors = "static"
"""


SHORT = OWN + "max_episode_steps = 100\n"  # the last case ends early


def written(tmp_path, text: str):
    path = tmp_path / "own.toml"
    path.write_text(text)
    return path


def test_a_file_describes_a_suite(tmp_path):
    suite = read_suite(written(tmp_path, OWN))
    assert (suite.name, suite.seeds, list(suite.variants)) == (
        "mine",
        3,
        ["dynamic-ml", "odometry"],
    )
    first, second = (case.source(7) for case in suite.cases)
    assert isinstance(first, SimulatedDrive)
    assert first.parameters["laser"] == Laser(beams=91, max_range=4.0)
    assert first.parameters["doors"].law.longest == 3.0
    assert first.parameters["doors"].open_share == 0.3
    assert first.parameters["world"].length == 20.0
    assert first.plain()["every"] == 2
    assert first.plain()["steps"] == 300
    assert second.plain()["config"]["world"]["type"] == "Loop"
    assert [c.condition["case"] for c in suite.cases] == ["fast doors, short sight", "DoorLoop-v0"]


def test_a_registered_world_and_law_go_along_to_other_processes(tmp_path, monkeypatch):
    monkeypatch.setitem(NAMED_WORLDS._parts, "short", Corridor(length=8.0))
    monkeypatch.setitem(NAMED_LAWS._parts, "often", Uniform(1.0, 2.0))
    text = 'name = "mine"\nvariants = ["odometry"]\nseeds = 1\n'
    text += '[[case]]\nworld = "short"\ndoors = "often"\n'
    (case,) = read_suite(written(tmp_path, text)).cases
    source = case.source(7)
    assert isinstance(source, SimulatedDrive)
    assert source.parameters == {"world": Corridor(length=8.0), "doors": Uniform(1.0, 2.0)}
    assert not source.code


REAL = """
variants = ["odometry"]
[[case]]
name = "by name"
laser = "SICK-LMS200"
robot = "TurtleBot3"
[[case]]
name = "changed"
laser = { kind = "RPLIDAR-A2", max_range = 6.0 }
[[case]]
name = "own"
laser = { effects = [{ kind = "MixedPixels", width = 0.01 },
                     { kind = "Surfaces", glass = [0, 3] }] }
"""


def test_a_file_names_lasers_robots_and_effects(tmp_path):
    named, changed, own = (case.source(7) for case in read_suite(written(tmp_path, REAL)).cases)
    assert isinstance(named, SimulatedDrive)
    assert named.plain()["config"]["robot"]["max_speed"] == 0.22
    assert named.plain()["config"]["laser"]["mount"] == [-0.032, 0.0, 0.0]
    assert changed.parameters["laser"] == replace(LASERS["RPLIDAR-A2"], max_range=6.0)
    effects = MixedPixels(width=0.01), Surfaces(glass=(0, 3))
    assert own.parameters["laser"] == Laser(effects=effects)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (('"SICK-LMS200"', '"SICK"'), "case 1: laser must be one of"),
        (('"TurtleBot3"', '"Turtle"'), "case 1: robot must be one of"),
        (('"RPLIDAR-A2"', '"RPLIDAR"'), "case 2: laser must be one of"),
        (('"MixedPixels"', '"Mixed"'), "case 3: the kind of an effect must be one of"),
        (("width = 0.01", "wide = 0.01"), "field of the effect MixedPixels"),
        (("glass = [0, 3]", "glass = [0, -3]"), "Surfaces.glass holds indices"),
    ],
)
def test_wrong_lasers_in_a_file_are_refused(tmp_path, changed, message):
    with pytest.raises(InputError, match=message):
        read_suite(written(tmp_path, REAL.replace(*changed)))


def test_every_sensor_is_beside_the_same_drive_without_it():
    cases = {case.condition["sensor"]: case.source(7) for case in sensors().cases}
    assert cases.keys() == SENSORS.keys()
    usual, mixed = (cases[name].make() for name in ("none", "mixed pixels"))
    assert (usual.truth.poses == mixed.truth.poses).all()
    assert (usual.odometry.poses == mixed.odometry.poses).all()
    usual_rows, mixed_rows = (np.array([scan.ranges for scan in e.scans]) for e in (usual, mixed))
    differ = ~np.isclose(usual_rows, mixed_rows, rtol=0.0, atol=1e-6)
    assert 0.0 < np.mean(differ) < 0.1
    for name, source in cases.items():
        assert (source.plain()["config"] == cases["none"].plain()["config"]) == (name == "none")


FAULTY = """
variants = ["odometry"]
[[case]]
faults = [{ kind = "Slip", distance = 0.8, at = [3.0, 5.0] }, { kind = "Lag", delay = 0.4 },
          { kind = "Gap" }]
"""


def test_a_file_names_faults(tmp_path):
    (case,) = read_suite(written(tmp_path, FAULTY)).cases
    source = case.source(7)
    assert isinstance(source, SimulatedDrive)
    assert source.parameters == {"faults": (Slip(0.8, at=(3.0, 5.0)), Lag(0.4), Gap())}


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (('"Slip"', '"Slips"'), "the kind of a fault must be one of .* did you mean 'Slip'"),
        (("distance = 0.8", "far = 0.8"), "a field of the fault Slip must be one of 'distance'"),
        (("delay = 0.4", "delay = -1.0"), r"Lag\.delay must be a finite number"),
        (("[3.0, 5.0]", "[5.0, 3.0]"), r"Slip\.at must be a time in s"),
        (('{ kind = "Gap" }', '"Gap"'), "a fault must be a table with its kind, got 'Gap'"),
    ],
)
def test_wrong_faults_in_a_file_are_refused(tmp_path, changed, message):
    with pytest.raises(InputError, match=message):
        read_suite(written(tmp_path, FAULTY.replace(*changed)))


def test_a_row_holds_when_faults_occurred_and_whether_the_variant_knew(bench, tmp_path):
    short = FAULTY.replace("[[case]]", "[[case]]\nmax_episode_steps = 100")
    assert bench(str(written(tmp_path, short)), "--seeds", "1") == 0
    (row,) = read(tmp_path / "out" / "results.jsonl")
    assert row["faults"].keys() == {"Slip", "Lag"}  # the gap is later
    assert 3.0 <= row["faults"]["Slip"] <= 5.1
    assert row["lost"]["lost_at_end"]  # dead reckoning with the paper's odometry
    assert row["lost"]["sure_and_wrong"] == row["lost"]["lost_share"] > 0.3
    assert [loss["told"] for loss in row["lost"]["losses"]] == [None]


OWN_WORLD = """
from dynslam_env import Layout
class Room:
    def layout(self, rng):
        walls = [(0, 0, {side}, 0), ({side}, 0, {side}, 5), ({side}, 5, 0, 5), (0, 5, 0, 0)]
        return Layout(walls, (), (1.0, 2.5, 0.0), [(4.0, 2.5)])
"""


def test_an_episode_is_another_when_the_code_of_its_world_has_changed(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    text = 'name = "mine"\nvariants = ["odometry"]\nseeds = 1\n[[case]]\nworld = "room"\n'
    keys = []
    for side in (5, 6, 6):
        (tmp_path / "own_room.py").write_text(OWN_WORLD.format(side=side))
        monkeypatch.delitem(sys.modules, "own_room", raising=False)
        importlib.invalidate_caches()
        room = importlib.import_module("own_room").Room()
        monkeypatch.setitem(NAMED_WORLDS._parts, "room", room)
        (case,) = read_suite(written(tmp_path, text)).cases
        keys.append(case.source(7).key)
    assert keys[0] != keys[1] == keys[2]


def test_a_world_that_is_no_dataclass_has_no_fields(tmp_path, monkeypatch):
    monkeypatch.setitem(NAMED_WORLDS._parts, "room", object())
    text = 'name = "mine"\nvariants = ["odometry"]\nseeds = 1\n'
    text += '[[case]]\nworld = { kind = "room", length = 3.0 }\n'
    with pytest.raises(InputError, match="case 1: world: object has no fields"):
        read_suite(written(tmp_path, text))


def test_it_runs(bench, tmp_path):
    assert bench(str(written(tmp_path, SHORT)), "--seeds", "1", "--jobs", "-1") == 0
    rows = read(tmp_path / "out" / "results.jsonl")
    assert {(row["suite"], row["case"], row["variant"]) for row in rows} == {
        ("mine", case, variant)
        for case in ("fast doors, short sight", "DoorLoop-v0")
        for variant in ("dynamic-ml", "odometry")
    }
    assert {row["scans"] for row in rows if row["case"].startswith("fast")} == {151}


def test_another_episode_of_the_same_case_is_not_mixed_in(bench, tmp_path, capsys):
    first = str(written(tmp_path, SHORT))
    assert bench(first, "--seeds", "1", "--variants", "odometry") == 0
    written(tmp_path, SHORT.replace("max_range = 4.0", "max_range = 5.0"))
    before = (tmp_path / "out" / "results.jsonl").read_bytes()
    assert bench(first, "--seeds", "2", "--variants", "odometry", "--resume") == 2
    assert "another episode as case fast doors, short sight, seed 5000" in capsys.readouterr().err
    assert (tmp_path / "out" / "results.jsonl").read_bytes() == before


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("seeds = 3", "seed = 3"), "an entry must be one of 'name', 'variants', 'seeds', 'case'"),
        (('name = "mine"', 'name = "../mine"'), "name must be of letters, digits, spaces"),
        (("seeds = 3", "seeds = 0"), "seeds must be a whole number of at least 1, got 0"),
        (('["dynamic-ml", "odometry"]', '"dynamic-ml"'), "variants must be a list of names"),
        (('env = "DoorLoop-v0"', 'env = "Door"'), "case 2: env must be one of 'DoorCorridor-v0'"),
        (("every = 2", "every = 0"), "case 1: every must be a whole number of at least 1"),
        (("length = 20.0", "lenght = 20.0"), "case 1: a field of world must be one of 'length'"),
        (("length = 20.0", "length = -1.0"), "Corridor.length must be a finite number above 0"),
        (("beams = 91", 'beams = "many"'), "Laser.beams must be a whole number"),
        (('kind = "Uniform"', 'kind = "Often"'), "doors.law.kind must be one of 'Uniform'"),
        (('doors = "static"', 'doors = "ajar"'), "doors must be one of 'moving', 'static'"),
        (('doors = "static"', 'log = "none.log"'), "an entry of a case with a log"),
        (('env = "DoorLoop-v0"\ndoors = "static"', 'log = "no.log"'), "no.log: no such file"),
        (('env = "DoorLoop-v0"\ndoors = "static"', 'name = "a"\nlog = 5'), "log must be a str"),
        (("[[case]]", "[[cases]]"), "an entry must be one of"),
        (("seeds = 3", "seeds = = 3"), "not a TOML file"),
        (('env = "DoorLoop-v0"', 'name = "fast doors, short sight"'), "two cases are named"),
        (("bias = 0.0", "bias = { a = 1 }"), "odometry.bias cannot be given in a file"),
    ],
)
def test_mistakes_say_where_and_what_is_allowed(tmp_path, change, told):
    text = OWN.replace(*change)
    assert text != OWN
    with pytest.raises(InputError) as error:
        read_suite(written(tmp_path, text))
    assert told in str(error.value)
    assert "own.toml: " in str(error.value)


def test_a_suite_without_cases_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"at least one \[\[case\]\]"):
        read_suite(written(tmp_path, 'variants = ["static-ml"]'))


def test_a_suite_of_a_split_has_its_episodes_at_the_difficulty():
    suite = paper().at("test", "hard")
    for case, before in zip(suite.cases, paper().cases, strict=True):
        assert case.condition == {**before.condition, "split": "test", "difficulty": "hard"}
        source, usual = case.source(17), before.source(17)
        assert isinstance(source, SimulatedDrive)
        assert isinstance(usual, SimulatedDrive)
        assert (source.split, source.seed) == ("test", 17)
        assert source.parameters == {**usual.parameters, "difficulty": "hard"}
        assert source.key != usual.key
    suite = paper()
    assert suite.at(None, None) is suite


def test_the_drive_of_a_split_is_that_of_the_environment():
    case = worlds().at("test", None).cases[0]
    source = case.source(3)
    assert isinstance(source, SimulatedDrive)
    episode = replace(source, parameters={"max_episode_steps": 5}).make()
    env = DoorWorldEnv()
    env.reset(options={"split": "test", "index": 3})
    assert episode.truth is not None
    np.testing.assert_array_equal(episode.truth.walls, env.layout.walls)
    np.testing.assert_array_equal(episode.scans[0].ranges, env.scan.ranges)


def test_recordings_have_no_split(tmp_path):
    (tmp_path / "a.log").write_text("")
    case = logs(tmp_path).at("test", None).cases[0]
    with pytest.raises(InputError, match="a recording has no split and no difficulty"):
        case.source(0)


@pytest.mark.parametrize("name", ["outside:evil.toml", "odometry, outside:evil.toml"])
def test_a_suite_runs_no_commands_of_a_file_that_it_names(tmp_path, name):
    path = tmp_path / "mine.toml"
    path.write_text(f'variants = ["{name}"]\n[[case]]\nenv = "DoorCorridor-v0"\n')
    with pytest.raises(InputError, match=r"'outside:evil\.toml' runs the commands in that file"):
        read_suite(path)


def test_a_recording_of_any_size_is_told_apart_in_little_memory(tmp_path):
    """All of it was held in memory for its digest."""
    path = tmp_path / "large.log"
    with path.open("wb") as file:
        file.truncate(64_000_000)
    tracemalloc.start()
    try:
        told = LogFile(path).plain()["sha256"]
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert told == hashlib.sha256(bytes(64_000_000)).hexdigest()
    assert peak < 4_000_000
