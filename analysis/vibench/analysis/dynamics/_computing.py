"""Compute the results of requests one by one."""

import time
from collections.abc import Iterator

from vibench.sim import Harmonic, OrbitShape, lyapunov_spectrum, phase_resonance_branch
from vibench.sim.branches import BranchOrigin, FoundBranch, balanced_branches, shot_branches

from ._branch_lines import BranchDiagram, BranchLine, line_of
from ._branch_request import BranchMethod, BranchRequest
from ._spectrum_request import ExponentSpectrum, SpectrumPoint, SpectrumRequest, point_of


def branch_lines(request: BranchRequest) -> Iterator[BranchLine]:
    """Follow the branches one by one and yield each."""
    where = request.shaken, request.path, request.start, request.stop
    if request.resonance_band_hz is not None:
        found = _resonance(request, request.resonance_band_hz)
    elif request.method is BranchMethod.SHOOTING:
        found = shot_branches(*where, request.search)
    else:
        found = balanced_branches(*where, request.balance_options, request.search)
    return (line_of(each) for each in found)


def _resonance(request: BranchRequest, band_hz: tuple[float, float]) -> Iterator[FoundBranch]:
    began = time.perf_counter()
    levels_m = request.start, request.stop
    branch = phase_resonance_branch(request.shaken, band_hz, levels_m, request.phase_of)
    origin, elapsed_s = BranchOrigin.PHASE_RESONANCE, time.perf_counter() - began
    yield FoundBranch(branch, OrbitShape.MIRRORED, 1, origin, has_twin=False, elapsed_s=elapsed_s)


def diagram_of(request: BranchRequest) -> BranchDiagram:
    """Compute all branches of a request."""
    began = time.perf_counter()
    lines = tuple(branch_lines(request))
    return BranchDiagram(request, lines, time.perf_counter() - began)


def spectrum_points(request: SpectrumRequest) -> Iterator[SpectrumPoint]:
    """Compute the exponents of each value of a request in order, and yield each."""
    specimen = request.shaken
    for value in request.values:
        began = time.perf_counter()
        drive = Harmonic(*request.drive(value))
        found = lyapunov_spectrum(specimen, drive, request.accuracy, request.duration_s, request.settle_s)
        elapsed_s = time.perf_counter() - began
        yield point_of(found, request.damping_sum_per_s, request.confidence, elapsed_s)


def exponent_spectrum(request: SpectrumRequest) -> ExponentSpectrum:
    """Compute all exponents of a request."""
    began = time.perf_counter()
    points = tuple(spectrum_points(request))
    return ExponentSpectrum(request, points, time.perf_counter() - began)
