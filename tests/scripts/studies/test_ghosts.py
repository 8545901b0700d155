# pyright: reportMissingImports=false
from dynslam_cli.studies.ghost_counts import drive, table


def test_the_static_layer_has_far_fewer_ghosts_than_static_ml() -> None:
    rows = drive("corridor", 1000)
    base, layer = rows[0], rows[1]
    assert layer["ghosts_per_m"] < base["ghosts_per_m"] / 2
    assert layer["wall_recall"] > base["wall_recall"] - 0.02
    assert layer["hit_recall"] > 0.98
    assert "corridor" in table(rows)
