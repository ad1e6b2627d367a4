"""Machine code of the CUDA kernels, which is made and read without a GPU.

    pip install "numba-cuda[cu13]" nvidia-cuda-nvcc nvidia-cuda-cuobjdump
    python -m scripts.bench.gpu_code      # minutes; writes results/gpu-code-<date>.json

Tells whether a fish lives in registers (no stack, no spills), whether float32 code computes in
float64, and how many instructions a control step takes. It measures no time.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba import cuda, types

from fish_env.envs.options import env_options
from fish_env.gpu import compiled
from fish_env.gpu.target import Target
from scripts.bench.harness import versions
from scripts.results import RESULTS, write_dated

CAPABILITY = (9, 0)
"""Of Hopper: H100 and H200."""
LANES, ISSUED = 32, 132 * 4
"""Threads of a warp, and warps that an H200 issues an instruction of in each cycle."""
CLOCK_HZ = 1.755e9
CASES: dict[str, dict[str, Any]] = {
    "no effects": {},
    "a tail whose rate jumps": {"effects": {"servo_backlash": {"gap": 0.05}}},
    "waves": {"wave": {"amplitude": 0.05}},
}
STAGES = 4


def signatures(real: type[Any]) -> dict[str, tuple[Any, ...]]:
    """Types of the arguments of each kernel."""
    number = numba.from_dtype(np.dtype(real))

    def arrays(dtype: Any, *dimensions: int) -> list[Any]:
        return [types.Array(dtype, n, "C") for n in dimensions]

    def whole(*dimensions: int) -> list[Any]:
        return arrays(types.int64, *dimensions)

    grid = [*whole(1), *arrays(number, 1), *whole(1), *arrays(number, 1), *whole(1)]
    single, seed = arrays(types.float32, 2), arrays(types.uint64, 1)
    begin = [
        *arrays(number, 2, 1, 1), *whole(1), *arrays(number, 2, 1, 3, 3, 2, 2, 1), *single,
        *arrays(number, 1), *seed,
    ]  # fmt: skip
    step = [
        *arrays(number, 2), *single, *arrays(number, 3), *grid, *arrays(number, 3, 2, 1), *single,
        *arrays(number, 1, 2, 3), *seed, *whole(1, 1),
    ]  # fmt: skip
    finish = [
        *arrays(number, 2), *begin, *whole(1, 2), types.int64, *arrays(types.float32, 1),
        *arrays(types.boolean, 1, 1), *single, *arrays(number, 2),
    ]  # fmt: skip
    return {"step": tuple(step), "finish": tuple(finish)}


def kernels(options: dict[str, Any], real: type[Any]) -> dict[str, Any]:
    """The functions behind the CUDA kernels of an environment, by name."""
    found: dict[str, Any] = {}

    class Kept(Target):
        def launched(self, function: Any, **_: Any) -> Any:
            found[function.__name__] = self._retyped(function)

    original, compiled.Target = compiled.Target, Kept  # type: ignore[misc]
    compiled.kernels_of.cache_clear()
    try:
        compiled.environment_kernels(env_options(**options), real.__name__, 2)
    finally:
        compiled.Target = original  # type: ignore[misc]
        compiled.kernels_of.cache_clear()
    return found


def assembled(function: Any, signature: tuple[Any, ...], folder: Path) -> tuple[str, str]:
    """Disassembly of a kernel, and what the assembler says of its registers."""
    text, _ = cuda.compile_ptx(function, signature, cc=CAPABILITY)
    ptx, binary = folder / "kernel.ptx", folder / "kernel.cubin"
    ptx.write_text(text)
    target = f"-arch=sm_{CAPABILITY[0]}{CAPABILITY[1]}"
    said = _run("ptxas", "-v", f"--maxrregcount={compiled.REGISTERS}", target, ptx, "-o", binary)
    return _run("cuobjdump", "-sass", binary), said


def _run(program: str, *arguments: object) -> str:
    import nvidia

    folders = [Path(folder) / "cu13" / "bin" / program for folder in nvidia.__path__]
    file = next((path for path in folders if path.exists()), Path(program))
    done = subprocess.run(
        [str(file), *map(str, arguments)], capture_output=True, text=True, check=True
    )
    return done.stdout + done.stderr


def read(sass: str) -> tuple[list[str], list[tuple[int, int]]]:
    """Instructions in their order, and loops (first and last instruction), by jumps backwards."""
    found = re.findall(r"/\*([0-9a-f]{4,5})\*/\s+(.*?)\s*;", sass)
    place = {int(address, 16): i for i, (address, _) in enumerate(found)}
    loops = set()
    for i, (_, text) in enumerate(found):
        jump = re.search(r"\bBRA\S*\s+(?:.*?)0x([0-9a-f]+)", text)
        if jump and place[int(jump[1], 16)] < i:
            loops.add((place[int(jump[1], 16)], i))
    return [re.sub(r"^@!?U?P\w+\s+", "", text) for _, text in found], sorted(loops)


def physics_loops(code: list[str], loops: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The loop over physics steps and the one over stages in it; none where steps are parted."""

    def arithmetic(loop: tuple[int, int]) -> int:
        counted = Counter(text[1:4] for text in code[loop[0] : loop[1]])
        return sum(counted[name] for name in ("FMA", "MUL", "ADD"))

    stage = max(loops, key=lambda loop: (arithmetic(loop) > 250, loop[0] - loop[1]))
    around = [loop for loop in loops if loop[0] < stage[0] and loop[1] > stage[1]]
    return [max(around, key=lambda loop: loop[0] - loop[1]), stage] if around else []


def counts(code: list[str], loops: list[tuple[int, int]], substeps: int) -> dict[str, Any]:
    """Instructions of a control step whose physics steps are whole."""
    found = physics_loops(code, loops)
    if not found:
        return {}
    step, stage = found
    size, inner = step[1] - step[0] + 1, stage[1] - stage[0] + 1
    whole = substeps * (size + (STAGES - 1) * inner) + len(code) - size
    double = [text for text in code[step[0] : step[1]] if re.match(r"D[A-Z]|\S*F64", text)]
    return {
        "instructions_of_a_stage": inner,
        "instructions_of_a_control_step": whole,
        "float64_instructions_in_the_physics": len(double),
        "bound_control_steps_per_s": LANES * ISSUED * CLOCK_HZ / whole,
    }


def facts(name: str, options: dict[str, Any], precision: str, folder: Path) -> dict[str, Any]:
    """What the machine code of the step of one environment is like."""
    real = np.dtype(precision).type
    started = time.perf_counter()
    sass, said = assembled(kernels(options, real)["step"], signatures(real)["step"], folder)
    seconds = time.perf_counter() - started
    code, loops = read(sass)
    parted = env_options(**options).model.kernels.composition.corners
    substeps = env_options(**options).config.substeps
    return {
        "case": name,
        "precision": precision,
        "registers": int(re.findall(r"Used (\d+) registers", said)[0]),
        "stack_bytes": int(re.findall(r"(\d+) bytes stack frame", said)[0]),
        "spilled_bytes": int(re.findall(r"(\d+) bytes spill stores", said)[0]),
        "instructions": len(code),
        **({} if parted else counts(code, loops, substeps)),
        "compile_s": round(seconds, 1),
    }


class Hopper:
    """Stands for a device, so that code can be made without one."""

    compute_capability = CAPABILITY


def main(argv: list[str] | None = None) -> None:
    """Compile, read, write."""
    parser = argparse.ArgumentParser(prog="python -m scripts.bench.gpu_code")
    parser.add_argument("--only", default="", help="cases with this text in their name")
    parser.add_argument("--dry", action="store_true", help="write nothing")
    options = parser.parse_args(argv)
    if not hasattr(cuda, "compile_ptx"):
        sys.exit('numba-cuda is missing: pip install "numba-cuda[cu13]"')
    from numba.cuda import dispatcher

    dispatcher.get_current_device = Hopper
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, case in CASES.items():
            for precision in ("float32", "float64") if not case else ("float32",):
                if options.only in name:
                    rows.append(facts(name, case, precision, Path(folder)))
                    print(rows[-1], flush=True)
    content = {
        "command": "python -m scripts.bench.gpu_code",
        "about": (
            "machine code of the kernel `step` for compute capability 9.0; nothing here was run on "
            "a GPU. bound_control_steps_per_s: an H200 that issues an instruction in every cycle "
            "at 1.755 GHz, without the kernel that ends episodes"
        ),
        "versions": versions(("numba", "numba-cuda", "nvidia-cuda-nvcc")),
        "kernels": rows,
    }
    if not options.dry:
        print(f"written: {write_dated(RESULTS, 'gpu-code', content)}")


if __name__ == "__main__":
    main()
