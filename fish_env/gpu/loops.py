"""The loops of the device: one thread takes one fish through a rollout or a control step.

They stand for the loops over blocks of the two templates, and call what those call. Every index
into ``work`` is known when the kernel is compiled, so that a fish lives in the thread's registers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import cuda

from fish_env.envs.layout import OBSERVATION, OUTPUTS
from fish_env.gpu.random import normals, philox
from fish_env.gpu.starting import (
    clear_results,
    fill_draws,
    fill_ring,
    start_drive,
    start_effects,
    start_goal,
    start_parameters,
    start_pose,
)
from fish_env.model.state import INTEGRAL_ROW

if TYPE_CHECKING:  # what a composed module defines
    from fish_env.model.composed import (
        BACK,
        FAILED,
        LATE_TAIL,
        MODE,
        N_PARAMETERS,
        N_STATES,
        OWN_STEPS,
        PAR,
        REAL,
        ROW_GOAL,
        ROW_GUIDE,
        ROW_OUTPUT,
        ROW_POINTS,
        ROW_REWARD,
        ROW_TIME,
        ROW_WITHIN,
        SLEW,
        SUBSTEPS,
        TIME,
        TRACE_ROW,
        TRACE_ROWS,
        WORK_ROWS,
        X0,
        U,
        accept_actuators,
        accept_states,
        gather,
        gather_targets,
        judge,
        observe,
        plan_actuators,
        prepare_parts,
        rk4_step,
        scatter,
        set_goal,
        step_block,
        step_in_parts,
    )

N_OUTPUTS, N_OBSERVED = len(OUTPUTS), len(OBSERVATION)
FAILURE = OUTPUTS.index("failure")
STREAM_NOISE, STREAM_RESET_NOISE = np.uint64(2), np.uint64(3)
_WORD = np.uint64(0xFFFFFFFF)
QUEUE_AT, RING_AT, TICK = 0, 1, 2
"""Counters that all fish share: slots of the queue and of the ring, and steps so far."""
EPISODE, STEPS, ENDED = 0, 1, 2
"""Whole numbers of each fish: its episode, control steps in it, and whether it has ended."""
DISABLED, NEXT_STEP, SAME_STEP = 0, 1, 2


def advance_fish(
    work, width, state, inputs, par, slew, time, commands, turn, slots, starts, steps, sizes,
    every, trace_row, trace_at, trace, failed_at, history, tables, first, count,
):  # fmt: skip
    """Stands for ``advance_block`` of the rollout template, for one fish."""
    gather(work, 1, X0, N_STATES, state, first, 1)
    gather(work, 1, U, 5, inputs, first, 1)
    gather(work, 1, SLEW, 5, slew, first, 1)
    gather(work, 1, PAR, N_PARAMETERS, par, first, 1)
    work[TIME] = time[first]
    work[FAILED] = failed_at[first]
    late = LATE_TAIL & (history.shape[0] > 0)
    same_pace = work[:0]
    if OWN_STEPS:
        prepare_parts(work, 1)
    sample = trace_at % trace.shape[0] if trace.shape[0] > 0 else 0
    for segment in range(steps.shape[0]):
        h = sizes[segment]
        gather_targets(work, 1, commands, (slots[segment] + turn) % commands.shape[0], first, 1)
        until = every[segment]
        for i in range(steps[segment]):
            elapsed = starts[segment] + np.float64(i) * h
            plan_actuators(work, 1, h)
            if OWN_STEPS:
                step_in_parts(work, 1, elapsed, h, tables, late, history, first, 1, same_pace)
            else:
                rk4_step(work, 1, elapsed, h, tables, 1)
                accept_states(work, 1, elapsed + h)
            accept_actuators(work, 1)
            until -= 1
            if (until == 0) & (trace.shape[0] > 0):
                for row in range(TRACE_ROWS):
                    trace[sample, row, first] = work[X0 + TRACE_ROW + row]
                sample = sample + 1 if sample + 1 < trace.shape[0] else 0
            until = every[segment] if until == 0 else until
    scatter(work, 1, X0, N_STATES, state, first, 1)
    scatter(work, 1, U, 5, inputs, first, 1)
    failed_at[first] = work[FAILED]


def rollout(
    state, inputs, par, slew, time, commands, slots, starts, steps, sizes, every, trace_at, trace,
    failed_at, history, tables,
):  # fmt: skip
    """Advance every fish through all segments; arguments as of ``advance_lanes``."""
    lane = cuda.grid(1)
    if lane < state.shape[1]:
        work = cuda.local.array(WORK_ROWS, REAL)
        advance_fish(
            work, 1, state, inputs, par, slew, time, commands, 0, slots, starts, steps, sizes,
            every, TRACE_ROW, trace_at, trace, failed_at, history, tables, lane, 1,
        )  # fmt: skip


def draw_noise(noise, noise_sd, lane, number, stream, seed):
    """Draw what is added to the sensors of a fish, in pairs."""
    for i in range(0, noise.shape[0], 2):
        words = philox(np.uint64(i), np.uint64(lane), np.uint64(number) & _WORD, stream,
                       seed[0], seed[1])  # fmt: skip
        first, second = normals(words[0], words[1])
        noise[i, lane] = first * noise_sd[i]
        if i + 1 < noise.shape[0]:
            noise[i + 1, lane] = second * noise_sd[i + 1]


def step(
    data, actions, queue, slots, starts, steps, sizes, every, ring, noise, noise_sd, obs, setup,
    history, tables, seed, counters, bad,
):  # fmt: skip
    """One control step of every fish; arguments as of ``step_lanes``.

    Further arguments: ``noise_sd`` (sensors,) standard deviations, ``seed`` (2,) words,
    ``counters`` (3,) and ``bad`` (1,) the number of actions so far that were NaN.
    """
    lane = cuda.grid(1)
    if lane < data.shape[1]:
        work = cuda.local.array(WORK_ROWS, REAL)
        draw_noise(noise, noise_sd, lane, counters[TICK], STREAM_NOISE, seed)
        wrong = step_block(
            work, 1, data, actions, queue, counters[QUEUE_AT], slots, starts, steps, sizes, every,
            ring, counters[RING_AT], noise, obs, setup, SUBSTEPS, BACK, TRACE_ROW, history, tables,
            lane, 1,
        )  # fmt: skip
        if wrong > 0:
            cuda.atomic.add(bad, 0, wrong)


def begin(
    work, data, lane, draws, given, ranges, nominal, drawn_rows, drawn, slew, queue, ring, ring_at,
    history, noise, noise_sd, obs, setup, seed, whole,
):  # fmt: skip
    """Start an episode of one fish, and observe it.

    ``draws``, (numbers, N), are its uniform numbers; unless ``given`` says that the caller has
    filled them, they are drawn here. ``ring_at`` is the slot of the ring that the next step writes
    first, ``whole``, (3, N), holds the whole numbers of each fish.
    """
    number = whole[EPISODE, lane]
    whole[EPISODE, lane] = number + 1
    whole[STEPS, lane] = 0
    whole[ENDED, lane] = 0
    if not given:
        fill_draws(draws, lane, number, seed)
    start_goal(data, lane, draws, ranges)
    start_pose(data, lane, draws, ranges)
    start_parameters(data, lane, draws, nominal, drawn_rows, drawn)
    start_drive(data, lane, slew, queue, setup)
    start_effects(work, data, lane)
    clear_results(data, lane)
    fill_ring(data, lane, ring, ring_at, setup)
    if history.shape[0] > 0:
        history[0, lane] = 0.0
    draw_noise(noise, noise_sd, lane, number, STREAM_RESET_NOISE, seed)
    newest = ring_at - 1 + ring.shape[0]
    set_goal(data, lane, ROW_GOAL, ROW_TIME, ROW_GUIDE, ROW_POINTS, 0.0, setup, True)
    judge(data, lane, ring, newest, INTEGRAL_ROW - TRACE_ROW, data[17, lane], 0.0, 1.0, setup)
    data[ROW_WITHIN, lane] = 0.0
    data[ROW_OUTPUT + 18, lane] = 0.0
    data[ROW_OUTPUT + 19, lane] = 0.0
    observe(data, lane, ring, newest, BACK, TRACE_ROW, noise, obs, setup)


def reset(
    mask, given, data, draws, ranges, nominal, drawn_rows, drawn, slew, queue, ring, history,
    noise, noise_sd, obs, setup, seed, counters, whole,
):  # fmt: skip
    """Start an episode of every fish in ``mask``, (N,)."""
    lane = cuda.grid(1)
    if lane < data.shape[1] and mask[lane]:
        work = cuda.local.array(WORK_ROWS, REAL)
        begin(
            work, data, lane, draws, given, ranges, nominal, drawn_rows, drawn, slew, queue, ring,
            counters[RING_AT], history, noise, noise_sd, obs, setup, seed, whole,
        )  # fmt: skip


def finish(
    data, draws, ranges, nominal, drawn_rows, drawn, slew, queue, ring, history, noise, noise_sd,
    obs, setup, seed, counters, whole, longest, reward, terminated, truncated, final_obs,
    final_outputs,
):  # fmt: skip
    """End episodes behind a control step, and start others, as ``MODE`` says.

    An episode ends where the fish failed, or after ``longest`` control steps. ``reward``,
    ``terminated`` and ``truncated``, (N,), are written for every fish; ``final_obs``,
    (N, observations), and ``final_outputs``, (len(OUTPUTS), N), where an episode ends.
    """
    lane = cuda.grid(1)
    if lane < data.shape[1]:
        work = cuda.local.array(WORK_ROWS, REAL)
        ring_at = (counters[RING_AT] + SUBSTEPS) % ring.shape[0]
        before = (whole[ENDED, lane] != 0) & (MODE == NEXT_STEP)
        taken = whole[STEPS, lane] + 1
        failed = (data[ROW_OUTPUT + FAILURE, lane] > 0.0) & (not before)
        over = (taken >= longest) & (not failed) & (not before)
        whole[STEPS, lane] = taken
        whole[ENDED, lane] = 1 if failed | over else 0
        reward[lane] = 0.0 if before else data[ROW_REWARD, lane]
        terminated[lane] = failed
        truncated[lane] = over
        if failed | over:
            for i in range(N_OBSERVED):
                final_obs[lane, i] = obs[lane, i]
            for i in range(N_OUTPUTS):
                final_outputs[i, lane] = data[ROW_OUTPUT + i, lane]
        if before | ((failed | over) & (MODE == SAME_STEP)):
            begin(
                work, data, lane, draws, False, ranges, nominal, drawn_rows, drawn, slew, queue,
                ring, ring_at, history, noise, noise_sd, obs, setup, seed, whole,
            )  # fmt: skip


def count_step(counters, queue_slots, ring_slots):
    """Go on to the next slots, behind a step of all fish."""
    if cuda.grid(1) == 0:
        counters[QUEUE_AT] = (counters[QUEUE_AT] + 1) % queue_slots
        counters[RING_AT] = (counters[RING_AT] + SUBSTEPS) % ring_slots
        counters[TICK] += 1
