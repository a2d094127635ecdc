from .exponents import (
    lyapunov_exponent as lyapunov_exponent,
    lyapunov_spectrum as lyapunov_spectrum,
)
from .model import (
    JOIN as JOIN,
    Accuracy as Accuracy,
    BaseResponse as BaseResponse,
    Harmonic as Harmonic,
    Hertz as Hertz,
    HuntCrossley as HuntCrossley,
    LinearGap as LinearGap,
    LinearSweep as LinearSweep,
    LogarithmicSweep as LogarithmicSweep,
    NoContact as NoContact,
    Outcome as Outcome,
    PowerLaw as PowerLaw,
    RigidStops as RigidStops,
    Sampled as Sampled,
    Specimen as Specimen,
    base_response as base_response,
    base_transmissibility as base_transmissibility,
    gong2025 as gong2025,
)
from .motion import (
    Response as Response,
    Trajectory as Trajectory,
    follow_samples as follow_samples,
    integrate as integrate,
    response_curve as response_curve,
    steady_response as steady_response,
)
from .periodic import (
    PowerSpring as PowerSpring,
    first_order_states as first_order_states,
    harmonic_balance_branch as harmonic_balance_branch,
    jump_frequencies as jump_frequencies,
    periodic_branch as periodic_branch,
    periodic_orbit as periodic_orbit,
    spring_of as spring_of,
    structure_of as structure_of,
)
from .scene import (
    Observable as Observable,
    Rest as Rest,
    Scene as Scene,
    ScenePlan as ScenePlan,
    ScenePrediction as ScenePrediction,
    plan_scene as plan_scene,
    solve_scene as solve_scene,
)
