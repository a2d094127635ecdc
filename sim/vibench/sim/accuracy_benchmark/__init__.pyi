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
from ._plain_equations import (
    Law as Law,
    Place as Place,
    law_of as law_of,
    numbers_of as numbers_of,
    rates as rates,
)
