"""What nobody but the person at the bench knows: one row a question."""

from dataclasses import dataclass
from enum import Enum, auto


class Found(Enum):
    """What the computer can see by itself."""

    GENERATORS = auto()
    """VISA resources."""
    CONVERTERS = auto()
    """Devices of the DAQ driver."""


@dataclass(frozen=True)
class Question:
    """One value of the configuration."""

    key: str
    """``"amplifier.gain_db"``; of a channel ``"daq.channels.m0_velocity.physical"``."""
    text: str
    found: Found | None = None


QUESTIONS = (
    Question("name", "What is the bench called?"),
    Question("generator.resource", "Which of them is the function generator?", Found.GENERATORS),
    Question("generator.settle_s", "How long does it need after each message [s]? 0.1 is safe"),
    Question("generator.amplitude_limit_vpp", "What is the largest setting you will ever allow [Vpp]?"),
    Question("daq.device", "Which of them is the converter?", Found.CONVERTERS),
    Question("daq.sample_rate_hz", "How many samples a second?"),
    Question("daq.channels.drive_voltage.physical", "Which input reads the generator's voltage?"),
    Question("daq.channels.drive_voltage.attenuation", "Divider in front of it (1: none)?"),
    Question("daq.channels.amplifier_voltage.physical", "Which input reads the amplifier's output?"),
    Question("daq.channels.amplifier_voltage.attenuation", "Divider in front of it?"),
    Question("daq.channels.base_acceleration.physical", "Which input reads the accelerometer on the base?"),
    Question(
        "daq.channels.base_acceleration.iepe_current_a",
        "Current that this input feeds the accelerometer [A]? 0 for a supply of its own",
    ),
    Question("daq.channels.m0_velocity.physical", "Which input reads the vibrometer?"),
    Question("amplifier.serial", "Serial number of the amplifier?"),
    Question("amplifier.gain_db", "Gain at its knob [dB]?"),
    Question("amplifier.current_limit_a", "Its current limit [A rms]?"),
    Question("shaker.serial", "Serial number of the shaker?"),
    Question(
        "shaker.fixture_mass_kg", "Mass on the table besides the specimen [kg], weighed with its screws?"
    ),
    Question("accelerometer.model", "Model of the accelerometer?"),
    Question("accelerometer.serial", "Its serial number?"),
    Question(
        "accelerometer.sensitivity_v_per_m_per_s2",
        "Its sensitivity, from its certificate [V per m/s2, or with a unit: 100 mV/g]?",
    ),
    Question("accelerometer.calibrated", "The date on that certificate (YYYY-MM-DD)?"),
    Question("vibrometer.serial", "Serial number of the vibrometer?"),
    Question("vibrometer.decoder", "Its decoder?"),
    Question(
        "vibrometer.range_mm_per_s_per_v", "Its range, as on its screen [mm/s per volt, or with a unit]?"
    ),
    Question("vibrometer.delay_s", "Delay of its output [s]? 0 if nobody has measured it"),
    Question("vibrometer.calibrated", "The date of its calibration (YYYY-MM-DD)?"),
    Question("specimen.gap_m", "Gap of the specimen [m], by feeler gauge?"),
)
"""In the order in which they are asked."""
