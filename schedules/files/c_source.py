"""The schedule as C99: the source with the tables, the interpolation, and a self-test.

``cc -std=c99 -DGAINFIELD_SELF_TEST wind_tunnel_nf.c`` makes a program that compares the interpolation with gains that
`schedules.interpolate` answered at nodes, cell centres and beyond the edges, and exits with 0 when all agree.
"""

from __future__ import annotations

import numpy as np

from schedules.files.c_header import about, require_c
from schedules.files.check_points import check_points, magnitudes
from schedules.files.plain_text import number, wrapped
from schedules.files.words import file_name, fingerprint, identifier
from schedules.fill import FilledSchedule
from schedules.wire_names import axis_name

_FOUND = """\
#include "{header}"

#ifndef {P}_SCHEDULE_{fingerprint}
#error "this source and its header are of different schedules"
#endif

#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error "nan would go unseen: build without -ffinite-math-only, which -ffast-math includes"
#endif

#ifdef GAINFIELD_FLOAT
#define R(decimal) decimal##f
#else
#define R(decimal) decimal
#endif
"""

_EVALUATE = """\
/* Neighbours of x among the breakpoints, and how far x is on the way from the lower to the upper; 1 when clipped. */
static int bracket(const {p}_real *breakpoints, int count, {p}_real x, int *lower, {p}_real *fraction)
{{
    int low = 0;
    int high = count - 1;
    int clipped = 0;

    if (x < breakpoints[low]) {{
        x = breakpoints[low];
        clipped = 1;
    }} else if (x > breakpoints[high]) {{
        x = breakpoints[high];
        clipped = 1;
    }}
    while (high - low > 1) {{
        const int middle = low + (high - low) / 2;

        if (breakpoints[middle] <= x) {{
            low = middle;
        }} else {{
            high = middle;
        }}
    }}
    *lower = low;
    *fraction = R(0.0); /* along an axis of one breakpoint the gains are constant */
    if (count > 1) {{
        *fraction = (x - breakpoints[low]) / (breakpoints[high] - breakpoints[low]);
    }}
    return clipped;
}}

int {p}_evaluate(const {p}_condition *at, {p}_policy outside, {p}_gains *gains)
{{
    const {p}_real x[{P}_AXES] = {{{coordinates}}};
    {p}_real fraction[{P}_AXES];
    {p}_real sum[{P}_GAINS] = {{R(0.0)}};
    int lower[{P}_AXES];
    int status = {P}_INSIDE;
    int axis;
    unsigned int corner;

    for (axis = 0; axis < {P}_AXES; ++axis) {{
        if (x[axis] != x[axis]) {{
            return {P}_NOT_A_NUMBER;
        }}
        if (bracket(axes[axis], sizes[axis], x[axis], &lower[axis], &fraction[axis])) {{
            status = {P}_CLIPPED;
        }}
    }}
    if (status == {P}_CLIPPED && outside != {P}_CLIP) {{
        return outside == {P}_HOLD ? {P}_HELD : {P}_REFUSED;
    }}
    for (corner = 0; corner < (1u << {P}_AXES); ++corner) {{
        {p}_real weight = R(1.0);
        int point = 0;
        int gain;

        for (axis = 0; axis < {P}_AXES; ++axis) {{
            const int upper = (int)((corner >> ({P}_AXES - 1 - axis)) & 1u);

            weight *= upper ? fraction[axis] : R(1.0) - fraction[axis];
            point = point * sizes[axis] + lower[axis] + upper;
        }}
        if (weight > R(0.0)) {{ /* a corner without weight may lie beyond the table */
            for (gain = 0; gain < {P}_GAINS; ++gain) {{
                sum[gain] += weight * table[point][gain];
            }}
            if (filled[point]) {{
                status |= {P}_FILLED;
            }}
        }}
    }}
{assignments}
    return status;
}}
"""

_SELF_TEST = """\
#ifdef GAINFIELD_SELF_TEST

#include <float.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef GAINFIELD_FLOAT
#define ROUNDING FLT_EPSILON
#else
#define ROUNDING DBL_EPSILON
#endif

static const struct {{
    {p}_condition at;
    {p}_real gains[{P}_GAINS];
    int clipped;
}} vectors[] = {{
{vectors}
}};

/* Of each gain what its rounding errors are in proportion to. */
static const double magnitude[{P}_GAINS] = {{
{magnitudes}
}};

int main(void)
{{
    const int count = (int)(sizeof vectors / sizeof vectors[0]);
    int failures = 0;
    int n;

    for (n = 0; n < count; ++n) {{
        {p}_gains gains;
        const int status = {p}_evaluate(&vectors[n].at, {P}_CLIP, &gains);
        int gain;

        if (status < 0 || (status & {P}_CLIPPED) != vectors[n].clipped) {{
            printf("vector %d: status %d\\n", n, status);
            ++failures;
            continue;
        }}
        for (gain = 0; gain < {P}_GAINS; ++gain) {{
            const {p}_real found[{P}_GAINS] = {{{members}}};
            const double error = (double)found[gain] - (double)vectors[n].gains[gain];

            if (!((error < 0.0 ? -error : error) <= 16.0 * (double)ROUNDING * magnitude[gain])) {{
                printf("vector %d, gain %d: %.17g, not %.17g\\n", n, gain, (double)found[gain],
                       (double)vectors[n].gains[gain]);
                ++failures;
            }}
        }}
    }}
    printf("%d vectors, %d failures\\n", count, failures);
    return failures == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}}

#endif /* GAINFIELD_SELF_TEST */
"""


def write_c_source(schedule: FilledSchedule) -> bytes:
    """The source, in ASCII. It includes the header by the name that `file_name` gives it.

    In double precision the sums are those of `schedules.interpolate`, term by term.

    Raises
    ------
    ValueError : what `write_c_header` refuses
    """
    require_c(schedule)
    designed = schedule.designed
    p = identifier(designed.controller)
    names = {"p": p, "P": p.upper()}
    members = [f"gains.{gain.name}" for gain in designed.gains]
    coordinates = ", ".join(f"at->{axis_name(axis)}" for axis in designed.axes)
    assignments = "\n".join(f"    gains->{gain.name} = sum[{k}];" for k, gain in enumerate(designed.gains))
    found = _FOUND.format(**names, header=file_name(designed, "h"), fingerprint=fingerprint(schedule).upper())
    self_test = _SELF_TEST.format(
        **names,
        vectors=_vectors(schedule),
        magnitudes=_block([number(x) for x in magnitudes(schedule.complete)]),
        members=", ".join(members),
    )
    parts = [
        "\n".join(about(schedule)),
        found,
        _tables(schedule, p),
        _EVALUATE.format(**names, coordinates=coordinates, assignments=assignments),
        self_test,
    ]
    return ("\n".join(parts)).encode("ascii")


def _tables(schedule: FilledSchedule, p: str) -> str:
    axes, gains = schedule.designed.axes, schedule.complete.gains
    blocks = []
    for axis in axes:
        values = _block([_real(x) for x in axis.values])
        blocks.append(f"static const {p}_real axis_{axis_name(axis)}[{len(axis.values)}] = {{\n{values}\n}};\n")
    blocks.append(f"static const {p}_real *const axes[] = {{{', '.join(f'axis_{axis_name(a)}' for a in axes)}}};")
    blocks.append(f"static const int sizes[] = {{{', '.join(str(n) for n in schedule.designed.shape)}}};\n")
    rows = np.stack([gain.values.ravel() for gain in gains], axis=-1).tolist()
    lines = "\n".join(f"    {{{', '.join(_real(x) for x in row)}}}," for row in rows)
    names = ", ".join(gain.name for gain in gains)
    blocks.append(f"/* {names}, a row a point */")
    blocks.append(f"static const {p}_real table[{p.upper()}_POINTS][{p.upper()}_GAINS] = {{\n{lines}\n}};\n")
    filled = _block([str(int(x)) for x in schedule.filled.ravel()])
    blocks.append("/* 1 where nothing was designed and the gains are another point's */")
    blocks.append(f"static const unsigned char filled[{p.upper()}_POINTS] = {{\n{filled}\n}};\n")
    return "\n".join(blocks)


def _vectors(schedule: FilledSchedule) -> str:
    lines = []
    for check in check_points(schedule.complete):
        at, gains = (", ".join(_real(x) for x in values) for values in (check.coordinates, check.gains))
        lines.append(f"    {{{{{at}}}, {{{gains}}}, {int(check.clipped)}}}, /* {check.name} */")
    return "\n".join(lines)


def _block(items: list[str]) -> str:
    return "\n".join(wrapped(items, ", ", "    "))


def _real(value: float) -> str:
    return f"R({number(value)})"
