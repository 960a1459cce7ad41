#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Learns to prepare a crown: the cross-entropy method on four parameters of a path, on all cores.

A generation draws paths about a mean, plays an episode with each, and moves the mean to the best of them. The first
mean stays too far outside of the plan and goes slowly, so that its time runs out.
"""

# %% What is learned
from __future__ import annotations

import argparse
import functools
import multiprocessing

import numpy as np
from trephine import env

NAMES = ["offset", "deeper", "feed", "pitch"]  # of trephine.env.crown_path
FIRST = np.array([0.9e-3, -0.8e-3, 3e-3, 2.2e-3])  # [m], [m], [m/s], [m]
SPREAD = np.array([0.4e-3, 0.4e-3, 2e-3, 0.5e-3])
LEAST = np.array([-0.2e-3, -1.5e-3, 1e-3, 0.6e-3])
MOST = np.array([2e-3, 0.3e-3, 12e-3, 3e-3])


# %% An episode, in a worker that keeps its environment
@functools.lru_cache(maxsize=1)
def drill(seconds: float) -> env.DrillEnv:
    return env.DrillEnv("crown", seconds=seconds)


def reward_of(parameters: np.ndarray, seed: int, seconds: float) -> float:
    policy = env.scripted("crown", **dict(zip(NAMES, parameters.tolist())))
    return env.play(drill(seconds), policy, seed)[0]


# %% The loop
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--generations", type=int, default=5)
    parser.add_argument("--population", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=25, help="of an episode")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()

    random = np.random.default_rng(options.seed)
    mean, spread = FIRST, SPREAD
    best = max(2, options.population // 3)
    print(f"{'generation':>10}{'mean reward':>13}{'best':>8}   " + "".join(f"{name + ' [mm]':>14}" for name in NAMES))
    with multiprocessing.get_context("spawn").Pool() as pool:
        for generation in range(options.generations):
            drawn = np.clip(random.normal(mean, spread, (options.population, len(mean))), LEAST, MOST)
            seeds = random.integers(1 << 31, size=options.population).tolist()
            rewards = np.array(pool.starmap(reward_of, [(p, s, options.seconds) for p, s in zip(drawn, seeds)]))
            elite = drawn[np.argsort(-rewards, kind="stable")[:best]]
            mean, spread = elite.mean(axis=0), elite.std(axis=0) + 0.1 * SPREAD
            print(f"{generation:10}{rewards.mean():13.1f}{rewards.max():8.1f}   " + "".join(f"{1e3 * m:14.2f}" for m in mean),
                  flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
