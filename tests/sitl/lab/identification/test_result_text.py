"""An identification as a person reads it."""

from sitl.lab.identification.identification_study import as_text
from tests.support.lab.identified_flight import identified


def test_the_tables_say_values_intervals_ratios_and_what_is_not_told():
    found = identified("physical", 3, hovering=True)
    lines = as_text(found, "physical", mass_given=False).splitlines()
    (thrust,) = [line for line in lines if line.startswith("k_f ")]
    row = next(row for row in found.parameters if row.key == "k_f")
    assert thrust.split()[-6:-3] == [f"{row.before:.4g}", f"{row.estimate:.4g}", f"{row.interval:.2g}"]
    assert thrust.endswith(f"{row.estimate / row.before:.3f}")
    assert any(line.startswith("yaw damping, 15 m/s") and line.endswith("not told") for line in lines)
    assert any(line.startswith("specific force z") and line.endswith("m/s2") for line in lines)
    assert any("0.492 kg is that of physical (--mass)" in line for line in lines)
    assert any(line.startswith("  forward flight: at most") for line in lines)


def test_a_given_mass_is_called_given():
    text = as_text(identified("physical", 3, hovering=True), "physical", mass_given=True)
    assert "kg is what you gave (--mass)" in text
