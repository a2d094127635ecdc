"""Follow the specimen's periodic motions through its first resonance; compute all exponents at 260 Hz."""

from vibench.analysis.dynamics import BranchRequest, SpectrumRequest, diagram_of, exponent_spectrum

found = diagram_of(BranchRequest(amplitude_m=5e-6, start=88.0, stop=94.0, places=2, starts=2))
for line in found.lines:
    low, high, stable = line.frequency_hz.min(), line.frequency_hz.max(), 100.0 * line.is_stable.mean()
    print(f"period {line.periods}, {line.shape}: {low:.2f} to {high:.2f} Hz, {stable:.0f} % stable")
    for event in line.events:
        print(f"  {event.kind} at {event.frequency_hz:.3f} Hz")
print(found.cost_sentence)

chaos = exponent_spectrum(SpectrumRequest(start=260.0, stop=260.0, duration_s=5.0, settle_s=1.0))
for point in chaos.points:
    values = ", ".join(f"{value:.0f}" for value in point.exponents_per_s)
    print(f"260 Hz: exponents {values} 1/s, sum {point.sum_per_s:.6f} of {point.dampers_per_s:.6f} 1/s")
    print(f"dimension {point.dimension:.2f}, {point.dimension_low:.2f} to {point.dimension_high:.2f}")
