"""Map refinement computes all cells that differ from a neighbour, also after interruptions."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.sim.maps._refinement import AUDITED, ComparedCells, plan_refinement
from vibench.sim.maps._results import Audit, audit_of
from vibench.sim.scene.shares import Count, Share, shares_of


def disc(shape, centre, radius):
    rows, columns = np.indices(shape)
    return ((rows - centre[0]) ** 2 + (columns - centre[1]) ** 2 < radius**2).astype(np.int64)


def refine(codes, coarse=8, lost=None, sizes=None):
    """Refine until no cell is missing; ``lost`` selects the cells that are computed in each step."""
    known = np.zeros(codes.shape, dtype=bool)
    sizes = np.full(codes.shape, np.nan) if sizes is None else sizes
    for step in range(10_000):
        # Unknown cells hold the code 99, so that using one would be detected.
        seen = ComparedCells(known, np.where(known, codes, 99), np.where(known, sizes, np.nan), 0.1)
        plan = plan_refinement(seen, coarse, 1)
        if not len(plan.missing):
            return known, plan
        computed = plan.missing if lost is None else plan.missing[lost(step, len(plan.missing))]
        known.reshape(-1)[computed] = True
    raise AssertionError("it never ends")


def fill_codes(codes, known, plan):
    found = np.where(known, codes, -1).reshape(-1)
    audited = set(plan.audited.tolist())
    for filling in plan.fillings:
        for cell, donor in zip(filling.cells, filling.donors, strict=True):
            assert known.reshape(-1)[donor]
            if cell not in audited:
                found[cell] = found[donor]
    return found.reshape(codes.shape)


def test_every_map_cell_is_computed_or_filled_in_once():
    codes = disc((50, 71), (20, 30), 12)
    known, plan = refine(codes)
    filled = np.concatenate([each.cells for each in plan.fillings])
    assert len(np.unique(filled)) == len(filled)
    is_filled = np.zeros(codes.size, dtype=bool)
    is_filled[filled] = True
    is_filled[plan.audited] = False
    assert np.array_equal(is_filled.reshape(codes.shape), ~known)
    for each in plan.fillings:
        assert np.allclose(each.weights.sum(axis=1), 1.0)


@settings(deadline=None, max_examples=30)
@given(
    st.tuples(st.integers(17, 60), st.integers(17, 60)),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.floats(9, 40),
    st.sampled_from([2, 4, 8]),
)
def test_regions_of_a_map_wider_than_the_lattice_spacing_are_filled_correctly(shape, place, radius, coarse):
    # The centre lies in the map, because a disc cut off by the edge may be narrower than the lattice spacing.
    codes = disc(shape, np.multiply(place, shape), radius)
    known, plan = refine(codes, coarse)
    is_wrong = fill_codes(codes, known, plan) != codes
    # Only a few cells at the rim of the disc may be missed between lattice points.
    assert is_wrong.sum() <= 4


def test_a_thin_region_of_a_map_is_refined_completely_once_one_of_its_points_is_found():
    codes = np.zeros((65, 65), dtype=np.int64)
    columns = np.arange(65)
    codes[np.clip(columns // 2 + 16, 0, 64), columns] = 1
    known, plan = refine(codes, 16)
    assert np.array_equal(fill_codes(codes, known, plan), codes)
    assert known.mean() < 0.3


def test_a_map_is_refined_at_a_response_jump_even_within_one_kind_of_motion():
    codes = np.zeros((40, 40), dtype=np.int64)
    sizes = np.where(np.indices(codes.shape)[1] > 17, 1.0, 0.0)
    known, _ = refine(codes, 8, sizes=sizes)
    assert known[:, 17:19].all()


@pytest.mark.parametrize("seed", range(4))
def test_an_interrupted_map_computes_the_same_cells(seed):
    codes = disc((45, 60), (20, 30), 11) + 2 * disc((45, 60), (35, 50), 6)
    rng = np.random.default_rng(seed)
    whole, plan = refine(codes)
    parts, other = refine(codes, lost=lambda _, count: rng.random(count) < 0.6)
    assert np.array_equal(whole, parts)
    assert np.array_equal(plan.audited, other.audited)
    assert np.array_equal(plan.audited_donors, other.audited_donors)


def test_the_audit_of_a_map_finds_wrongly_filled_cells():
    # Single cells between lattice points are found by chance only.
    rng = np.random.default_rng(5)
    codes = (rng.random((129, 129)) < 0.02).astype(np.int64)
    codes[::16, ::16] = 0
    _, plan = refine(codes, 16)
    filled = np.concatenate([each.cells for each in plan.fillings])
    share = np.count_nonzero(codes.reshape(-1)[filled]) / len(filled)
    assert len(plan.audited) == AUDITED
    expected = share * AUDITED
    audit = audit_of(codes[:, None, :], plan)
    assert abs(audit.wrong - expected) < 4.0 * np.sqrt(expected) + 1.0
    assert (sum(audit.gained), sum(audit.lost)) == (audit.wrong, audit.wrong)


def test_filled_cells_that_were_not_audited_widen_the_intervals_of_shares():
    unaudited = Audit(filled=30, audited=0, wrong=0, gained=(0.0, 0.0), lost=(0.0, 0.0))
    shares = unaudited.corrected_shares((Share(0.9, 0.85, 0.95), Share(0.1, 0.05, 0.15)), 100)
    assert [each.share for each in shares] == [0.9, 0.1]
    assert [each.low for each in shares] == pytest.approx([0.55, 0.0])
    assert [each.high for each in shares] == pytest.approx([1.0, 0.45])
    assert (unaudited.wrong_share.low, unaudited.wrong_share.high) == (0.0, 1.0)
    whole = Audit(filled=0, audited=0, wrong=0, gained=(), lost=())
    assert (whole.wrong_share.low, whole.wrong_share.high) == (0.0, 0.0)


@pytest.mark.thorough
@pytest.mark.parametrize("rare", [0.02, pytest.param(0.15, marks=pytest.mark.slow)])
def test_share_intervals_of_a_map_hold_for_rare_kinds_of_motion(rare):
    held, middles = 0, []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        # One region is smooth; in the other two motions are mixed at random.
        codes = disc((193, 193), (96, 96), 60)
        codes[(codes == 0) & (rng.random(codes.shape) < rare)] = 2
        known, plan = refine(codes, 16)
        filled = fill_codes(codes, known, plan).reshape(-1)
        counts = [Count(int(np.count_nonzero(filled == code)), is_final=True) for code in range(3)]
        shares = audit_of(codes[:, None, :], plan).corrected_shares(shares_of(counts), codes.size)
        true = np.bincount(codes.reshape(-1)) / codes.size
        held += all(share.low <= each <= share.high for share, each in zip(shares, true, strict=True))
        assert sum(share.share for share in shares) == pytest.approx(1.0)
        middles.append([share.share for share in shares] - true)
    assert held >= 18
    # The mean of the shares is not biased.
    off = np.array(middles)[:, 2]
    assert abs(off.mean()) < 3.0 * off.std() / np.sqrt(len(off))
