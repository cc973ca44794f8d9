"""Pieces of curves are followed on from their ends, past holes of the lattice, and made one where
they meet.
"""

import numpy as np

from survey.measures import tips


def height(x0):
    return 0.2 + 0.6 * x0**2


def parabola(x):
    """x1 less the height, with a hole beside it in which nothing is known."""
    value = x[:, 1] - height(x[:, 0])
    value[np.hypot(*(x - [0.5, 0.6]).T) < 0.1] = np.nan
    return value, np.full(len(x), 1e-15)


def piece(low, high):
    x0 = np.linspace(low, high, 12)
    return np.stack([x0, height(x0)], axis=1), np.full(12, 1e-15)


def test_pieces_that_meet_are_one_and_reach_the_border():
    ((x, error),) = tips.followed(parabola, [piece(0.55, 0.7), piece(0.1, 0.3)], 1e-16)
    order = x if x[0, 0] < x[-1, 0] else x[::-1]
    assert (
        np.allclose(order[[0, -1]], [[0.0, 0.2], [1.0, 0.8]]) and (np.diff(order[:, 0]) > 0.0).all()
    )
    assert (abs(x[:, 1] - height(x[:, 0])) <= error + 1e-15).all() and (error < 1e-6).all()


def test_a_piece_in_the_other_sense_is_turned_and_is_the_same_curve():
    x, error = piece(0.4, 0.4003)
    ((x, error),) = tips.followed(
        parabola, [piece(0.6, 0.9), (x[[-1, 0]], error[[-1, 0]]), piece(0.1, 0.3)], 1e-16
    )
    assert np.allclose(x[[0, -1]], [[0.0, 0.2], [1.0, 0.8]]) and (np.diff(x[:, 0]) > 0.0).all()


def test_a_hole_on_the_curve_ends_it():
    def holed(x):
        value, bar = parabola(x)
        value[abs(x[:, 0] - 0.4) < 0.05] = np.nan
        return value, bar

    found = tips.followed(holed, [piece(0.5, 0.7), piece(0.1, 0.3)], 1e-16)
    assert len(found) == 2
    inner = sorted(end for x, _error in found for end in x[[0, -1], 0])[1:3]
    assert 0.33 < inner[0] <= 0.35 and 0.45 <= inner[1] < 0.47


def test_round_a_corner_two_arms_meet_and_none_is_followed_along_the_other():
    """Of (x0 - 1/2) (x1 - 1/2) = c, which turns within 2e-3: two arms of length 1 / 2."""

    def hyperbola(x):
        return (x[:, 0] - 0.5) * (x[:, 1] - 0.5) - 1e-6, np.full(len(x), 1e-15)

    far = np.geomspace(1e-2, 0.5, 20)
    up = np.stack([0.5 + 1e-6 / far, 0.5 + far], axis=1)
    pieces = [(x, np.full(20, 1e-15)) for x in (up[::-1], up[:, ::-1])]
    ((x, _error),) = tips.followed(hyperbola, pieces, 1e-16)
    assert 0.998 < np.hypot(*np.diff(x, axis=0).T).sum() < 1.0


def test_where_three_pieces_meet_none_is_joined():
    three = [
        piece(0.1, 0.3),
        piece(0.3, 0.5),
        (piece(0.1, 0.3)[0] * [1, -1] + [0, 2 * height(0.3)], np.full(12, 1e-15)),
    ]
    assert len(tips._merged(three)) == 3
    assert len(tips._merged(three[:2])) == 1
    circle = np.stack([np.cos(np.linspace(0, np.pi, 9)), np.sin(np.linspace(0, np.pi, 9))], axis=1)
    ((ring, _),) = tips._merged([(circle, np.zeros(9)), (-circle, np.zeros(9))])
    assert len(ring) == 17 and np.allclose(ring[0], ring[-1])
