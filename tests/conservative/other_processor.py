"""Runs kernels and stores their final states in a file (npz). With `arm`, compiles the kernels that ran for Apple's M1, too.

`python other_processor.py FILE [arm]`; NUMBA_CPU_NAME and NUMBA_CPU_FEATURES choose the processor that numba compiles for.
"""

import importlib
import pkgutil
import re
import sys

import llvmlite.binding as llvm
import numpy as np
from numba.core.dispatcher import Dispatcher

import conservative as cv
from conservative import kernels

ARM = "arm64-apple-macosx11.0.0"


def states():
    """Return final attitudes by method: kernels for one body, and lanes."""
    scene = cv.scenes.asymmetric_top()
    methods = {"taylor": scene, "reduced": scene, "gauss": scene, "projected": scene, "lame": cv.scenes.lagrange_top()}
    found = {name: cv.integrate(body, 0.01, name, t_end=0.5).R_WB[-1] for name, body in methods.items()}
    rates = 3 * np.random.default_rng(1).normal(size=(9, 3))
    for method in ("taylor", "reduced"):
        found[f"{method}, lanes"] = cv.integrate_many(scene, dt=0.01, t_end=0.5, w_WB_B0=rates, method=method).R_WB[:, -1]
    return found


def compile_for_arm():
    """Return the number of instructions on registers of two floats, by compiled function of the kernels."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(ARM).create_target_machine(cpu="apple-m1", opt=2)
    counts = {}
    for module in pkgutil.iter_modules(kernels.__path__):
        for name, function in vars(importlib.import_module(f"{kernels.__name__}.{module.name}")).items():
            if isinstance(function, Dispatcher) and function.overloads:
                for text in function.inspect_llvm().values():
                    code = re.sub('target triple = ".*"', f'target triple = "{ARM}"', text)
                    code = re.sub('target datalayout = ".*"', f'target datalayout = "{machine.target_data}"', code)
                    code = re.sub('"target-(cpu|features)"="[^"]*"', "", code)
                    # numba's own counting of references, which it writes for the processor that it runs on
                    code = code.replace("llvm.x86.atomic", "numba.atomic").replace(" immarg", "")
                    assert "llvm.x86" not in code
                    counts[f"{module.name}.{name}"] = machine.emit_assembly(llvm.parse_assembly(code)).count(".2d")
    return counts


if __name__ == "__main__":
    np.savez(sys.argv[1], **states())
    if sys.argv[2:] == ["arm"]:
        print(compile_for_arm())
