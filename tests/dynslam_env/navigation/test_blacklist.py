from dynslam_env.navigation.blacklist import Blacklist


def test_a_place_near_by_is_held_for_a_while():
    blacklist = Blacklist()
    blacklist.add((0.0, 0.0), 0.0, 5.0)
    assert blacklist.holds((0.1, 0.0), 4.9)
    assert not blacklist.holds((0.1, 0.0), 5.1)
    assert not blacklist.holds((1.0, 0.0), 4.9)
