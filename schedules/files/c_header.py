"""The schedule as C99: the header, which says what the source does. It can be included from C++.

All names begin with the controller's: ``nf_condition``, ``nf_gains``, ``nf_evaluate``. The numbers are double, or float
where ``GAINFIELD_FLOAT`` is defined for the whole program; objects of both kinds do not link with each other.
"""

from __future__ import annotations

import numpy as np

from schedules.files.plain_text import c_string, in_c_comment, number
from schedules.files.words import fingerprint, identifier, require_multilinear, require_table, words
from schedules.fill import FilledSchedule
from schedules.wire_names import axis_name

ARRAY_ORDER = "row-major: the last axis varies fastest, and all gains of a point stand together"

#: Words that C99 or C++20 keeps for itself, so that no member of a struct can be named so.
_KEYWORDS = """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t char32_t class
    compl concept const const_cast consteval constexpr constinit continue co_await co_return co_yield decltype
    default delete do double dynamic_cast else enum explicit export extern false float for friend goto if inline int
    long mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public register
    reinterpret_cast requires restrict return short signed sizeof static static_assert static_cast struct switch
    template this thread_local throw true try typedef typeid typename union unsigned using virtual void volatile
    wchar_t while xor xor_eq
"""
KEYWORDS = frozenset(_KEYWORDS.split())

_TYPES = """\
#ifdef GAINFIELD_FLOAT
{no_float}typedef float {p}_real;
#define {p}_evaluate {p}_evaluate_float /* a program that mixes both precisions does not link */
#else
typedef double {p}_real;
#endif

#define {P}_AXES {axes}
#define {P}_GAINS {gains}
#define {P}_POINTS {points}

/* A flight condition, in the units of the grid's axes. */
typedef struct {{
{condition}
}} {p}_condition;

/* Gains in SI and radians. */
typedef struct {{
{members}
}} {p}_gains;

/* What to do at a condition outside the breakpoints. */
typedef enum {{
    {P}_CLIP,  /* the nearest edge's gains */
    {P}_HOLD,  /* leave *gains as the caller had them */
    {P}_REFUSE /* leave *gains as the caller had them, and call it an error */
}} {p}_policy;

/* The rule of the schedule; with {P}_HOLD and no gains to leave, ask for {P}_CLIP. */
#define {P}_OUT_OF_RANGE {P}_{policy}

/* What {p}_evaluate answers; errors are below zero. {P}_CLIPPED and {P}_FILLED may come together, as their sum. */
enum {{
    {P}_INSIDE = 0,
    {P}_CLIPPED = 1,     /* outside, the gains are an edge's */
    {P}_FILLED = 2,      /* a point that was not designed but filled carries weight in these gains */
    {P}_HELD = 4,        /* outside, *gains is as it was */
    {P}_REFUSED = -1,    /* outside, *gains is as it was */
    {P}_NOT_A_NUMBER = -2 /* a coordinate is nan, *gains is as it was, whatever the policy */
}};

/*
 * Gains at a flight condition: multilinear between the points of the grid. At a point of the grid they are that point's
 * to the last bit. No memory is allocated, nothing is kept from one call to the next.
 */
int {p}_evaluate(const {p}_condition *at, {p}_policy outside, {p}_gains *gains);
"""


def write_c_header(schedule: FilledSchedule) -> bytes:
    """The header, in ASCII.

    Raises
    ------
    ValueError : a schedule without axes or gains, one that is not multilinear, or a name that is a word of C or C++
    """
    require_c(schedule)
    p = identifier(schedule.designed.controller)
    guard = f"{p.upper()}_GAIN_SCHEDULE_H"
    lines = [
        *about(schedule),
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        f"#define {p.upper()}_SCHEDULE_{fingerprint(schedule).upper()} /* the source asks for this very schedule */",
        f"#define {p.upper()}_SCHEMA_VERSION {schedule.designed.schema_version}",
        f"#define {p.upper()}_DESIGN_ID {c_string(schedule.designed.provenance.design_id)}",
        f"#define {p.upper()}_REQUEST_DIGEST {c_string(schedule.designed.provenance.request_digest)}",
        "",
        "#ifdef __cplusplus",
        'extern "C" {',
        "#endif",
        "",
        _types(schedule, p),
        "#ifdef __cplusplus",
        "}",
        "#endif",
        "",
        f"#endif /* {guard} */",
    ]
    return ("\n".join(lines) + "\n").encode("ascii")


def about(schedule: FilledSchedule) -> list[str]:
    """A block comment with what the schedule says in words."""
    lines = (f" * {name}: {in_c_comment(text)}" for name, text in words(schedule, ARRAY_ORDER))
    return ["/*", *lines, " */"]


def require_c(schedule: FilledSchedule) -> None:
    """Refuse what has no place in C."""
    require_table(schedule)
    require_multilinear(schedule, "C")
    names = [axis_name(axis) for axis in schedule.designed.axes] + [gain.name for gain in schedule.designed.gains]
    for name in names:
        if name in KEYWORDS:
            raise ValueError(f"{name!r} is a word of C or C++: it cannot be the name of an axis or a gain there")


def fits_float(schedule: FilledSchedule) -> bool:
    """Whether the table is one in single precision too: breakpoints stay distinct, no number is lost."""
    with np.errstate(over="ignore", under="ignore"):
        for axis in schedule.designed.axes:
            single = np.asarray(axis.values).astype(np.float32)
            if not np.all(np.isfinite(single)) or np.any(np.diff(single) <= 0):
                return False
        for gain in schedule.complete.gains:
            single = gain.values.astype(np.float32)
            if not np.all(np.isfinite(single)) or np.any((single == 0) & (gain.values != 0)):
                return False
    return True


def _types(schedule: FilledSchedule, p: str) -> str:
    axes, gains = schedule.designed.axes, schedule.designed.gains
    lost = '#error "breakpoints or gains of this schedule are lost in single precision"\n'
    ranges = ((a, f"{number(a.values[0])} to {number(a.values[-1])}") for a in axes)
    return _TYPES.format(
        p=p,
        P=p.upper(),
        policy=schedule.designed.rules.out_of_range.upper(),
        no_float="" if fits_float(schedule) else lost,
        axes=len(axes),
        gains=len(gains),
        points=schedule.source.size,
        condition="\n".join(f"    {p}_real {axis_name(a)}; /* {in_c_comment(a.unit)}, {r} */" for a, r in ranges),
        members="\n".join(f"    {p}_real {g.name}; /* {in_c_comment(g.unit)} */" for g in gains),
    )
