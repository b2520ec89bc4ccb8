"""The rules of a schedule in its files: carried where they can be, refused in words where they would be broken."""

import itertools
from dataclasses import replace

import pytest

from schedules.files import FILE_FORMATS, read_csv, read_hdf5, read_json, read_matlab, read_npz, write_schedule
from schedules.rules import INTEGRATOR_PLACEMENTS, INTERPOLATIONS, OUTS_OF_RANGE, ScheduleRules

READERS = {"json": read_json, "csv": read_csv, "mat": read_matlab, "npz": read_npz, "h5": read_hdf5}
ALL = [ScheduleRules(*each) for each in itertools.product(INTERPOLATIONS, OUTS_OF_RANGE, INTEGRATOR_PLACEMENTS)]


@pytest.mark.parametrize("suffix", READERS)
@pytest.mark.parametrize("rules", ALL)
def test_rules_come_back(make_schedule, same_schedule, suffix, rules):
    schedule = replace(make_schedule((3, 4), failed=[(1, 2)]), rules=rules)
    plain = replace(schedule, provenance=replace(schedule.provenance, design_name="plain"))
    found = READERS[suffix](write_schedule(plain, suffix))
    assert found.rules == rules
    assert found.schema_version == (2 if rules.integrator_placement == "after_gain" else 1)


@pytest.mark.parametrize("suffix", ["h", "c", "m", "xml", "dml"])
def test_tables_of_programs_are_multilinear(make_schedule, suffix):
    schedule = replace(make_schedule((3, 4)), rules=ScheduleRules("monotone_cubic"))
    with pytest.raises(ValueError, match=r"monotone_cubic.*interpolates multilinearly"):
        write_schedule(schedule, suffix)


@pytest.mark.parametrize("rule", ["hold", "refuse"])
def test_tables_that_always_clip_refuse_other_rules(make_schedule, rule):
    schedule = replace(make_schedule((3, 4)), rules=ScheduleRules(out_of_range=rule))
    for suffix in ("xml", "dml"):
        with pytest.raises(ValueError, match=f"the schedule's rule is {rule}.*nearest edge"):
            write_schedule(schedule, suffix)
    header = write_schedule(schedule, "h").decode()
    assert f"MAIN_OUT_OF_RANGE MAIN_{rule.upper()}" in header
    script = write_schedule(schedule, "m").decode()
    assert "Extrapolation method to Clip" not in script
    assert OUTS_OF_RANGE[rule] in script.replace("''", "'")
    # What the files check themselves with is asked of the edges, whatever the rule: numbers, not nan.
    assert "nan" not in write_schedule(schedule, "c").decode().split("vectors[] = {")[1].lower().split("};")[0]


@pytest.mark.parametrize("placement", INTEGRATOR_PLACEMENTS)
def test_every_file_says_where_integrators_stand(make_schedule, placement):
    schedule = replace(make_schedule((3, 4)), rules=ScheduleRules(integrator_placement=placement))
    for suffix in set(FILE_FORMATS) - {"mat", "npz", "h5"}:
        text = write_schedule(schedule, suffix).decode().replace("''", "'").replace("&apos;", "'")
        assert INTEGRATOR_PLACEMENTS[placement].split(":")[0] in text, suffix


def test_a_file_of_before_there_were_placements_integrates_before_the_gain(make_schedule):
    content = write_schedule(make_schedule((3, 4)), "json").decode()
    old = "\n".join(line for line in content.split("\n") if "integrator_placement" not in line)
    assert read_json(old.encode()).rules == ScheduleRules()


def test_a_version_that_does_not_know_a_placement_does_not_have_it(make_schedule):
    """A reader of version 1 would integrate before the gain: such a file must never say that it is one."""
    schedule = replace(make_schedule((3, 4)), rules=ScheduleRules(integrator_placement="after_gain"))
    content = write_schedule(schedule, "json").replace(b'"schema_version": 2', b'"schema_version": 1')
    with pytest.raises(ValueError, match="which schema_version 1 does not have"):
        read_json(content)
    for suffix, version in (("h", b"_SCHEMA_VERSION 2"), ("csv", b"# schema_version: 2"), ("mat", b"schema version 2")):
        assert version in write_schedule(schedule, suffix)
