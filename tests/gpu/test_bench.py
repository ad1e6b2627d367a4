"""What is told about the code of a GPU, without one."""

import pytest

from scripts.bench import gpu_code, gpu_float32

FMA = "FFMA R1, R2, R3, R4 ;"


def listing(lines):
    """A disassembly: instructions at addresses 0x10 apart."""
    return "\n".join(f"        /*{16 * i:04x}*/   {line}" for i, line in enumerate(lines))


def test_loops_are_jumps_backwards():
    sass = listing(
        ["MOV R1, R2 ;", FMA, "@!P0 BRA 0x10 ;", "@P1 BRA 0x50 ;", "BRA 0x0 ;", "EXIT ;"]
    )
    code, loops = gpu_code.read(sass)
    assert loops == [(0, 4), (1, 2)]
    assert code[2] == "BRA 0x10"


def nested(stage, step, outside, double=0):
    """A loop over steps with a loop over stages in it."""
    before, after = outside // 2, outside - outside // 2 - 1
    lines = ["MOV R1, R2 ;"] * before + ["FADD R1, R2, R3 ;"] * (step - 1)
    lines += ["DADD R1, R2, R3 ;"] * double
    lines += [FMA] * (stage - 1) + [f"@P0 BRA 0x{16 * (before + step - 1 + double):x} ;"]
    lines += [f"@P0 BRA 0x{16 * before:x} ;"] + ["MOV R1, R2 ;"] * after + ["EXIT ;"]
    return gpu_code.read(listing(lines))


def test_a_control_step_counts_its_physics_steps_and_their_stages():
    found = gpu_code.counts(*nested(stage=300, step=100, outside=50), substeps=10)
    assert found["instructions_of_a_stage"] == 300
    assert found["instructions_of_a_control_step"] == 10 * (100 + 4 * 300) + 50
    assert found["float64_instructions_in_the_physics"] == 0


def test_float64_in_the_physics_is_noticed():
    found = gpu_code.counts(*nested(stage=300, step=100, outside=50, double=7), substeps=10)
    assert found["float64_instructions_in_the_physics"] == 7


@pytest.mark.slow
@pytest.mark.long
def test_float32_stays_near_float64_in_compiled_code(monkeypatch):
    """The functions of the device compiled for the CPU, where an episode takes no time."""
    monkeypatch.setattr(gpu_float32, "FISH", 16)
    found = gpu_float32.compared(seed=1)
    first, last = found["differences"][0], found["differences"][-1]
    assert 0.0 < first["position_m"] < 1e-6
    assert last["position_m"] < 5e-3
    assert found["return"]["largest_difference"] < 1e-3 * found["return"]["mean"]
