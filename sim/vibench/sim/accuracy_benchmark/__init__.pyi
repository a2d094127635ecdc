from ._figures import (
    LEAST_GAIN as LEAST_GAIN,
    MOTIONS as MOTIONS,
    AccuracyBenchmark as AccuracyBenchmark,
    LevelFigures as LevelFigures,
    MotionBenchmark as MotionBenchmark,
    SolverFigures as SolverFigures,
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
