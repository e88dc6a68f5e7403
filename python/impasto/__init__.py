"""Impasto: a material language, and the path tracer that its compiler feeds.

>>> import impasto
>>> clay = impasto.Material("clay.impasto", roughness=0.4)
>>> impasto.check(clay)
>>> value, pdf = clay.eval(wo=(0, 0.6, 0.8), wi=directions)
>>> picture = impasto.render(clay, samples=16)
>>> picture.pixels.shape
(480, 480, 3)

docs/python.md is the manual. Long calls let other threads run, take a function ``progress``, and end at Ctrl-C. What goes wrong
is an `Error` with ``diagnostics``.
"""

from ._ask import Costs, check, cost, emit, eval, explain, inspect, sample
from ._errors import (
    DeviceError,
    Diagnostic,
    Diagnostics,
    Error,
    FileError,
    Label,
    PlanError,
    SceneError,
    SourceError,
)
from ._impasto import __version__
from ._material import Bsdf, Material, Samples, Scattering
from ._parameters import Parameter
from ._plan import (
    Automatic,
    Calibrated,
    Exact,
    Heuristic,
    Materials,
    Plan,
    Problem,
    Profile,
    Request,
    Search,
    TimeModel,
    Workload,
    materials,
    plan,
    profile,
    workload,
)
from ._render import Picture, devices, outputs, render
from ._scene import Binding, Bindings, Scene, SceneBuilder, load
from ._study import Study, study

__all__ = [
    "Automatic",
    "Binding",
    "Bindings",
    "Bsdf",
    "Calibrated",
    "Costs",
    "DeviceError",
    "Diagnostic",
    "Diagnostics",
    "Error",
    "Exact",
    "FileError",
    "Heuristic",
    "Label",
    "Material",
    "Materials",
    "Parameter",
    "Picture",
    "Plan",
    "PlanError",
    "Problem",
    "Profile",
    "Request",
    "Samples",
    "Scattering",
    "Scene",
    "SceneBuilder",
    "SceneError",
    "Search",
    "SourceError",
    "Study",
    "TimeModel",
    "Workload",
    "__version__",
    "check",
    "cost",
    "devices",
    "emit",
    "eval",
    "explain",
    "inspect",
    "load",
    "materials",
    "outputs",
    "plan",
    "profile",
    "render",
    "sample",
    "study",
    "workload",
]
