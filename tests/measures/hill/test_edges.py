"""Edges of tongues: characteristic values to 30 digits, every row complete, closed gaps found
twice, folds kept.
"""

import numpy as np
import pytest
from hill_problems import REFERENCE
from mpmath import mpf

from survey.measures.hill import edges as hill_edges
from survey.scene import Request
from survey.scenes import mathieu, satellite

KINDS = {("a", 0): 2, ("b", 0): 3, ("a", 1): 0, ("b", 1): 1}  # DLMF 28.2(v)


def solver(scene, name, values, lane, **options):
    """Outputs along `lane` on rows of the parameter `name`."""
    values = np.asarray(values, dtype=float)

    def solve(row, x, wanted):
        return scene.solve(
            {name: values[row][:, None], lane: x},
            Request(options, "auto", 1e-13, frozenset(wanted)),
        )

    return solve


@pytest.mark.parametrize("q", [1.0, 5.0, 25.0])
def test_mathieus_characteristic_values(q):
    values = [row for row in REFERENCE["standard"]["mathieu"]["values"] if float(row["q"]) == q]
    edges = hill_edges.find(solver(mathieu, "q", [q], "a"), 1, -45.0, 110.0)
    assert edges.complete.all() and values
    for row in values:
        mine = (edges.kind == KINDS[row["kind"], row["n"] % 2]) & (edges.index == row["n"])
        assert mine.sum() == 1
        position = edges.position[mine][0]
        assert (
            abs(mpf(position) - mpf(row["value"]))
            <= edges.error[mine][0]
            < 1e-12 * (1 + abs(position))
        )


@pytest.mark.parametrize(("body", "low"), [("prolate", 0.0), ("oblate", 0.3)])
def test_edges_are_where_the_verdict_changes_and_the_count_is_the_rotation_number(body, low):
    k = np.array([0.1, 0.5, 0.9])
    solve = solver(satellite, "k", k, "rho", body=body)
    edges = hill_edges.find(solve, k.size, low + 0.3, 4.0)
    assert edges.complete.all()
    for row in range(k.size):
        own = edges.row == row
        x = edges.position[own]
        between = np.concatenate([[low + 0.3], x, [4.0]])
        out = solve(np.array([row]), 0.5 * (between[1:] + between[:-1])[None, :], hill_edges.COUNTS)
        verdict = out["verdict"][0]
        assert (verdict[1:] != verdict[:-1])[(verdict[1:] >= 0) & (verdict[:-1] >= 0)].all()
        # tongues come in order, with two edges each but for those that the axis' ends cut
        assert (np.diff(edges.index[own]) >= 0).all()
        number = np.bincount(edges.index[own])
        assert (number[edges.index[own].min() + 1 : edges.index[own].max()] == 2).all()


def test_width_of_a_tongue_is_its_power_of_k():
    """Prolate tongue n = 5: (25/4608) k^5 (satellite.md: What is known), resolved where it is 2e-12 wide."""
    k = np.array([0.013, 0.1])
    edges = hill_edges.find(solver(satellite, "k", k, "rho", body="prolate"), 2, 2.2, 2.35)
    for row, value in enumerate(k):
        own = (edges.row == row) & (edges.index == 5)
        assert sorted(edges.kind[own]) == [0, 1]
        width, bar = np.ptp(edges.position[own]), edges.error[own].sum()
        assert abs(width - 25 / 4608 * value**5) <= bar + 3 * value**2 * width


def test_a_fold_of_rotations_keeps_both_edges():
    """Prolate rotations: as 1/k grows the tongues near r = 0 and r = -2 meet (satellite.md: What is
    known).
    """
    k = 1 / np.array([0.6, 0.97])
    edges = hill_edges.find(solver(satellite, "k", k, "rho", body="prolate"), 2, -3.0, 0.5)
    assert edges.complete.all() and edges.row.size > 4
