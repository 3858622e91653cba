"""Parameter sets: the shipped ones load, and a bad file is refused by file, key and value."""

from importlib.resources import files
from pathlib import Path

import pytest

from sitl.model.airframe import FIRST_ORDER
from sitl.model.airframe_files import ALL_UNITS, PROPELLER_KEYS, UNITS, AirframeError, available, load
from sitl.model.propeller_files import PropellerError


def test_every_shipped_set_loads_with_a_unit_and_a_source_for_every_value():
    assert {"nominal", "published", "report-table", "flight-code", "nominal-first-order"} <= set(available())
    for name in available():
        shipped = load(name)
        assert shipped.name == name
        owned = set(PROPELLER_KEYS) if "propeller" in shipped.values else set()
        assert shipped.values.keys() >= UNITS.keys() - owned
        assert all(entry.unit == ALL_UNITS[key] and entry.source for key, entry in shipped.values.items())
        assert len(shipped.sha256) == 64


def test_the_first_order_set_is_the_nominal_one_with_other_actuators():
    nominal, first = load("nominal").parameters, load("nominal-first-order").parameters
    assert first == nominal._replace(actuator_model=FIRST_ORDER)


def write(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text('[set]\nname = "mine"\ndescription = "x"\nbase = "nominal"\n' + text)
    return str(path)


def entry(key, value, unit, source="measured"):
    return f'[{key}]\nvalue = {value}\nunit = "{unit}"\nsource = "{source}"\n'


def test_a_file_may_change_some_values_of_a_shipped_set(tmp_path):
    mine = load(write(tmp_path, entry("m", 0.6, "kg")))
    assert mine.parameters.m == 0.6
    assert mine.parameters.b == load("nominal").parameters.b


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (entry("k_g", 1.0, "kg m"), "unknown key 'k_g'; did you mean 'k_"),
        (entry("m", 0.6, "g"), "m is in 'g', must be in 'kg'"),
        (entry("m", -0.6, "kg"), "m = -0.6 must be positive"),
        (entry("m", '"heavy"', "kg"), "m = 'heavy' is not a finite number"),
        (entry("m", "nan", "kg"), "not a finite number"),
        (entry("m", 50.0, "kg"), "cannot lift m = 50.0"),
        (entry("m", 0.6, "kg", ""), "m names no source"),
        (entry("omega_min", 2000.0, "rad/s"), "omega_min = 2000.0 must be below"),
        (entry("actuator_model", '"magic"', "name"), "'magic' is not one of saturated, first-order"),
        (entry("m", "1" + 400 * "0", "kg"), "is not a finite number"),
        (entry("J1", 0.5, "kg m2"), "J1 = 0.5, J2 = 0.002785, J3 = 0.00606: no rigid body"),
        ("m = 3\n", "m must be"),
        ("[m\n", "not a TOML file"),
    ],
)
def test_a_bad_file_is_refused_by_file_key_and_value(tmp_path, text, words):
    if text == "m = 3\n":
        path = tmp_path / "mine.toml"
        path.write_text('m = 3\n[set]\nname = "mine"\ndescription = "x"\nbase = "nominal"\n')
        name = str(path)
    else:
        name = write(tmp_path, text)
    with pytest.raises(AirframeError) as caught:
        load(name)
    assert "mine.toml" in str(caught.value)
    assert words in str(caught.value)


def test_unknown_names_and_missing_files_are_said():
    with pytest.raises(AirframeError, match="no parameter set 'nosuch': there are"):
        load("nosuch")
    with pytest.raises(AirframeError, match="No such file"):
        load("/nowhere/x.toml")


def test_a_set_without_base_must_be_whole(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('[set]\nname = "mine"\ndescription = "x"\n' + entry("m", 0.5, "kg"))
    with pytest.raises(AirframeError, match="J1, J2"):
        load(str(path))


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ('description = "x"', "with name and description is missing"),
        ('name = 3\ndescription = "x"', "name = 3 must be text"),
        ('name = "mine"\ndescription = "x"\nbasis = "nominal"', "unknown key 'basis'; did you mean 'base'"),
        ('name = "mine"\ndescription = "x"\nbase = "mine.toml"', "base 'mine.toml' is not a shipped set"),
        ('name = "mine"\ndescription = "x"\nwaived = ["gravity"]', "must be a list of inertia"),
    ],
)
def test_a_bad_header_is_refused(tmp_path, header, words):
    path = tmp_path / "mine.toml"
    path.write_text(f"[set]\n{header}\n")
    with pytest.raises(AirframeError, match=r"mine\.toml") as caught:
        load(str(path))
    assert words in str(caught.value)


def test_only_a_set_that_says_so_may_break_a_rule(tmp_path):
    """ENAC's flight code states inertias that no rigid body has; it is shipped as stated, and says so."""
    code = load("flight-code")
    assert code.waived == {"inertia"}
    assert code.parameters.J3 > code.parameters.J1 + code.parameters.J2
    assert all(load(name).waived == frozenset() for name in available() if name != "flight-code")


def test_a_set_is_named_by_the_hash_of_its_file(tmp_path):
    first, again = (load(write(tmp_path, entry("m", 0.5, "kg"))).sha256 for _ in range(2))
    assert first == again != load(write(tmp_path, entry("m", 0.51, "kg"))).sha256


PROPELLER = {
    "k_f": entry("k_f", 5e-6, "kg m"),
    "k_m": entry("k_m", 2e-7, "kg m2"),
    "S_ratio": entry("S_ratio", 0.3, "-"),
}


@pytest.mark.parametrize(
    ("base", "told", "refusal"),
    [
        ("nominal", ("k_f",), "k_f without the other of k_f and k_m"),
        ("nominal", ("k_m",), "k_m without the other of k_f and k_m"),
        ("collage", ("k_f", "k_m"), "k_f, k_m would not count: base 'collage' has a propeller"),
        ("collage", ("S_ratio",), "S_ratio would not count: base 'collage' has a propeller"),
    ],
)
def test_a_set_has_one_propeller(tmp_path, base, told, refusal):
    path = Path(write(tmp_path, "".join(PROPELLER[key] for key in told)))
    path.write_text(path.read_text().replace('base = "nominal"', f'base = "{base}"'))
    with pytest.raises(AirframeError, match=refusal):
        load(str(path))


def test_a_propellers_parts_beside_it_are_refused(tmp_path):
    text = entry("propeller", '"apc-8x8e"', "name") + PROPELLER["k_f"] + PROPELLER["k_m"]
    with pytest.raises(AirframeError, match="k_f, k_m beside propeller"):
        load(write(tmp_path, text))


def of_propeller(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text('[set]\nname = "mine"\ndescription = "x"\nbase = "collage"\n' + text)
    return str(path)


def test_a_set_may_correct_its_propeller(tmp_path):
    base = load("collage").parameters
    factors = {"thrust_factor": 0.9, "torque_factor": 1.1, "advance_factor": 1.2, "disc_factor": 1.25}
    text = "".join(entry(key, value, "-") for key, value in factors.items())
    mine = load(of_propeller(tmp_path, text)).parameters
    assert mine.k_f == pytest.approx(0.9 * base.k_f)
    assert mine.k_fvv == pytest.approx(0.9 * 1.44 * base.k_fvv)
    assert mine.k_m == pytest.approx(1.1 * base.k_m)
    assert mine.k_mk == pytest.approx(1.1 * 1.44 * base.k_mk)
    assert mine.advance_knot == pytest.approx(base.advance_knot / 1.2)
    assert mine.S_p == pytest.approx(1.25 * base.S_p)
    assert mine.S_ratio * mine.S_p == pytest.approx(base.S_ratio * base.S_p)


def test_a_set_may_bring_a_propeller_of_its_own_beside_it(tmp_path):
    shipped = files("sitl.model.propellers") / "apc-8x8e.toml"
    (tmp_path / "wood.toml").write_text(shipped.read_text().replace("diameter = 0.2032", "diameter = 0.4064"))
    text = entry("propeller", '"wood.toml"', "name")
    mine, base = load(of_propeller(tmp_path, text)), load("collage").parameters
    assert mine.parameters.S_p == pytest.approx(4.0 * base.S_p)
    (tmp_path / "wood.toml").write_text(shipped.read_text())
    again = load(of_propeller(tmp_path, text))
    assert again.parameters.k_f == pytest.approx(base.k_f)
    assert again.sha256 != mine.sha256  # the propeller is part of what is flown


def test_a_propeller_that_cannot_be_read_is_refused_by_both_files(tmp_path):
    text = entry("propeller", '"wood.toml"', "name")
    with pytest.raises(PropellerError, match=r"mine\.toml: propeller .*wood\.toml: No such file"):
        load(of_propeller(tmp_path, text))
    (tmp_path / "wood.toml").write_text("[propeller\n")
    with pytest.raises(PropellerError, match=r"mine\.toml: propeller .*wood\.toml: not a TOML file"):
        load(of_propeller(tmp_path, text))
    (tmp_path / "wood.toml").write_text("[propeller]\ndiameter = 0.1\n")
    with pytest.raises(PropellerError, match=r"wood\.toml: not a table of J, C_T and C_P: 'measured'"):
        load(of_propeller(tmp_path, text))
    with pytest.raises(AirframeError, match="propeller = 5 must be a name, or a TOML file beside this one"):
        load(of_propeller(tmp_path, entry("propeller", 5, "name")))


def test_elevons_ahead_of_the_centre_of_mass_are_refused(tmp_path):
    with pytest.raises(AirframeError, match="the elevons must be behind the centre of mass"):
        load(write(tmp_path, entry("Delta_r", -0.01, "m")))


def test_a_correction_needs_a_propeller(tmp_path):
    with pytest.raises(AirframeError, match="thrust_factor without a propeller to which they belong"):
        load(write(tmp_path, entry("thrust_factor", 1.1, "-")))


def test_a_correction_that_gives_energy_is_refused(tmp_path):
    with pytest.raises(PropellerError, match="more thrust power than shaft power"):
        load(of_propeller(tmp_path, entry("thrust_factor", 1.8, "-")))


@pytest.mark.parametrize("value", ["1.7976931348623157e308", "-1.7976931348623157e308", "inf"])
def test_a_number_as_large_as_there_are_is_none(tmp_path, value):
    with pytest.raises(AirframeError, match="is not a finite number"):
        load(write(tmp_path, entry("m", value, "kg")))


def test_what_the_reports_sets_do_without_is_nothing():
    a = load("nominal").parameters
    air = a.k_fv, a.k_fvv, a.k_fw, a.k_mv, a.k_mvv, a.k_mk, a.advance_knot, a.swirl, a.k_fc, a.k_h
    assert (*air, a.J_p, a.cp_shift, a.slip_shift, a.avionics_power) == (0.0,) * 14


def test_a_set_that_was_renamed_is_told_by_its_new_name():
    with pytest.raises(AirframeError, match="'physical' is called 'collage' now"):
        load("physical")
