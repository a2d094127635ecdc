from ._figures import (
    LEAST_GAIN as LEAST_GAIN,
    MOTIONS as MOTIONS,
    TRANSIENTS as TRANSIENTS,
    AccuracyBenchmark as AccuracyBenchmark,
    LevelFigures as LevelFigures,
    MotionBenchmark as MotionBenchmark,
    SolverFigures as SolverFigures,
    TransientFigures as TransientFigures,
)
from ._lotteries import (
    LOTTERIES as LOTTERIES,
    LotteryFigures as LotteryFigures,
    StatedShare as StatedShare,
)
from ._measuring import (
    Thoroughness as Thoroughness,
    measure_accuracy as measure_accuracy,
)
from ._textbook_methods import (
    TextbookMethod as TextbookMethod,
    ode45 as ode45,
    runge_kutta as runge_kutta,
    textbook_exponent as textbook_exponent,
    textbook_state as textbook_state,
)
