"""A prediction as cells of the columns, and back."""

import numpy as np

from ..model import Accuracy, AccuracyWord, Outcome, chosen
from ..scene import Method, MotionKind, ScenePrediction
from ._arrays import Arrays
from ._columns import ENDED, FINAL_STATE, METHOD, MOTION, NUMBERS, OUTCOME, TEXT_BYTES, Cell


def cells_of(prediction: ScenePrediction) -> dict[str, Cell]:
    """Turn a prediction into cells; what was not asked, or not found, stays missing."""
    numbers = {column.name: getattr(prediction, field) for field, column in NUMBERS.items()}
    known: dict[str, Cell] = {name: value for name, value in numbers.items() if value is not None}
    return known | {
        MOTION: list(MotionKind).index(prediction.motion),
        METHOD: list(Method).index(prediction.method),
        OUTCOME: int(prediction.outcome),
        ENDED: cut_text(prediction.ended),
        FINAL_STATE: prediction.final_state,
    }


def prediction_at(
    arrays: Arrays,
    number: int,
    frequency_hz: float,
    amplitude_m: float,
    accuracy: Accuracy | AccuracyWord,
    start: str,
) -> ScenePrediction:
    """Make the prediction of a point from its cells and from what the study says of it."""
    numbers = {field: _number(arrays[column.name][number]) for field, column in NUMBERS.items()}
    x, y, z, vx, vy, vz = (float(value) for value in arrays[FINAL_STATE][number].astype(np.float64))
    return ScenePrediction(
        **numbers,  # type: ignore[arg-type]
        frequency_hz=frequency_hz,
        amplitude_m=amplitude_m,
        motion=list(MotionKind)[int(arrays[MOTION][number])],
        method=list(Method)[int(arrays[METHOD][number])],
        outcome=Outcome(int(arrays[OUTCOME][number])),
        ended=bytes(arrays[ENDED][number]).decode(),
        final_state=(x, y, z, vx, vy, vz),
        start=start,
        accuracy=chosen(Accuracy, accuracy).value,
    )


def cut_text(text: str) -> bytes:
    """UTF-8 bytes of a text, as many as a column holds, cut between characters."""
    return text.encode()[:TEXT_BYTES].decode(errors="ignore").encode()


def _number(cell: np.generic) -> float | int | None:
    value = cell.item()
    match value:
        case float():
            return value if np.isfinite(value) else None
        case int():
            return value if value >= 0 else None
        case _:
            raise TypeError(f"{value!r} is no number")
