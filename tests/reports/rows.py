"""Made-up measurements, so that what tables and pictures say of them is known beforehand."""

from conservative.benchmarks.measures.measurement import Measurement, frame
from conservative.reports.tables.work_precision import ERROR, TIME


def point(line, role, error, time, dt=0.1, scene="made_up", label=None, method=None, status="ok"):
    method = method or line
    common = ("work_precision", scene, method, label or method, role, dt)
    return [
        Measurement(*common, ERROR, error, "rad", status, line),
        Measurement(*common, TIME, time, "s/s", status, line),
    ]


def table(*groups):
    return frame([row for group in groups for row in group])
