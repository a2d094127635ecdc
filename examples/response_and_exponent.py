"""Compute the response of the paper's specimen at 260 Hz, and its largest Lyapunov exponent."""

from vibench.sim import Harmonic, gong2025, lyapunov_exponent, steady_response

specimen = gong2025(damping_time_s=2e-5, gap_m=45e-6, contact="hertz")
for amplitude_m in (1e-6, 5e-6):
    drive = Harmonic(frequency_hz=260.0, amplitude_m=amplitude_m)
    response = steady_response(specimen, drive, duration_s=4.0, window_s=1.0)
    exponent = lyapunov_exponent(specimen, drive, duration_s=5.0, settle_s=2.0)
    print(
        f"{1e6 * amplitude_m:.0f} µm: Response I {response.relative_i:.2f}, II {response.relative_ii:.2f}, "
        f"{response.impacts} impacts in the last second; "
        f"largest exponent {exponent.exponent_per_s:.1f} ± {exponent.standard_error_per_s:.1f} 1/s"
    )
