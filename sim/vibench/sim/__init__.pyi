from .background import Progress as Progress
from .engine.run import Accuracy as Accuracy, AccuracyWord as AccuracyWord, Outcome as Outcome
from .exponents.lyapunov import (
    ExponentVerdict as ExponentVerdict,
    LyapunovEstimate as LyapunovEstimate,
    Precision as Precision,
    lyapunov_exponent as lyapunov_exponent,
)
from .exponents.lyapunov_spectrum import (
    LyapunovSpectrum as LyapunovSpectrum,
    lyapunov_spectrum as lyapunov_spectrum,
)
from .motion.integrate import (
    FollowedMotion as FollowedMotion,
    Impacts as Impacts,
    Trajectory as Trajectory,
    follow_samples as follow_samples,
    integrate as integrate,
)
from .motion.response import Response as Response, steady_response as steady_response
from .operating_system.this import state_folder as state_folder
from .periodic.balance_branch import BalanceOptions as BalanceOptions
from .periodic.branch import (
    BifurcationKind as BifurcationKind,
    Branch as Branch,
    BranchEvent as BranchEvent,
    OrbitShape as OrbitShape,
)
from .periodic.branch_following import (
    AmplitudePath as AmplitudePath,
    DrivePath as DrivePath,
    FrequencyPath as FrequencyPath,
)
from .periodic.continuation import ArcEnd as ArcEnd, ArcSteps as ArcSteps
from .periodic.first_order_balance import (
    FirstOrderState as FirstOrderState,
    first_order_states as first_order_states,
)
from .periodic.harmonic_balance import (
    Balance as Balance,
    HarmonicSet as HarmonicSet,
    LinearStructure as LinearStructure,
    structure_of as structure_of,
)
from .periodic.orbit_branch import (
    periodic_branch as periodic_branch,
    periodic_branch_within as periodic_branch_within,
)
from .periodic.phase_resonance import phase_resonance_branch as phase_resonance_branch
from .periodic.restoring_force import (
    PowerSpring as PowerSpring,
    RestoringForce as RestoringForce,
    spring_of as spring_of,
)
from .periodic.shooting import (
    PeriodicOrbit as PeriodicOrbit,
    PhaseReference as PhaseReference,
    ShootingEnd as ShootingEnd,
    periodic_orbit as periodic_orbit,
)
from .scene.plan import ScenePlan as ScenePlan, plan_scene as plan_scene
from .scene.prediction import (
    Ensemble as Ensemble,
    FoundMotion as FoundMotion,
    Method as Method,
    MotionKind as MotionKind,
    ScenePrediction as ScenePrediction,
    StartMemory as StartMemory,
    TargetReport as TargetReport,
)
from .scene.refinement import refine_scene as refine_scene
from .scene.scene import (
    BUDGET_S as BUDGET_S,
    AutomaticDuration as AutomaticDuration,
    FixedDuration as FixedDuration,
    Given as Given,
    Observable as Observable,
    Rest as Rest,
    Scene as Scene,
    Target as Target,
)
from .scene.shares import EscapeRate as EscapeRate, Share as Share, wilson_share as wilson_share
from .scene.solve import (
    settle_scene as settle_scene,
    solve_ensemble as solve_ensemble,
    solve_scene as solve_scene,
)
from .specimen.contact_laws import (
    CONTACT_LAWS as CONTACT_LAWS,
    ContactLaw as ContactLaw,
    Elasticity as Elasticity,
    Hertz as Hertz,
    HuntCrossley as HuntCrossley,
    LinearGap as LinearGap,
    NoContact as NoContact,
    PowerLaw as PowerLaw,
    RigidStops as RigidStops,
    hertz_stiffness as hertz_stiffness,
)
from .specimen.drive import (
    Drive as Drive,
    Harmonic as Harmonic,
    LinearSweep as LinearSweep,
    LogarithmicSweep as LogarithmicSweep,
    Parameter as Parameter,
    Sampled as Sampled,
)
from .specimen.frozen_model import (
    FrozenModel as FrozenModel,
    NumberWith as NumberWith,
    count_text as count_text,
    number_of as number_of,
)
from .specimen.modes import (
    BaseResponse as BaseResponse,
    base_response as base_response,
    base_transmissibility as base_transmissibility,
)
from .specimen.specimen import Specimen as Specimen, bound_matrices as bound_matrices, gong2025 as gong2025
from .specimen.specimen_description import (
    USUAL_SPECIMEN as USUAL_SPECIMEN,
    DampingTime as DampingTime,
    SpecimenDescription as SpecimenDescription,
    SpecimenTable as SpecimenTable,
    SpecimenWarning as SpecimenWarning,
    UnknownSpecimenError as UnknownSpecimenError,
    load_specimen as load_specimen,
    shipped_specimens as shipped_specimens,
    usual_specimen as usual_specimen,
)
from .specimen.toml_table import (
    UnreadableTomlError as UnreadableTomlError,
    fault_in_words as fault_in_words,
    toml_table as toml_table,
)
