"""MaskablePPO of sb3-contrib on a short budget: it must earn more than choosing at random does.

    pip install sb3-contrib
    python maskable_ppo.py [STEPS]
"""

from __future__ import annotations

import sys
from typing import Any

import gymnasium
import numpy as np
import swath
from sb3_contrib import MaskablePPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.vec_env import DummyVecEnv

ORBITS = 2.0
EPISODE = {"orbits": ORBITS, "scenario": {"count": [3000, 3000]}}
SEEDS = range(10_000, 10_010)


def make() -> gymnasium.Env[Any, Any]:
    """The environment as MaskablePPO can have it: flat observations, a grid of actions."""
    env = gymnasium.make("Swath/StripImaging-v0", episode=EPISODE)
    return swath.FlatObservation(swath.GridActions(env, transitions=12))


def earned(choose: Any) -> float:
    """Mean reward per orbit over episodes that nobody learned from."""
    env, total = make(), 0.0
    for seed in SEEDS:
        observation, _ = env.reset(seed=seed)
        over = False
        while not over:
            action = choose(observation, env.get_wrapper_attr("action_masks")())
            observation, reward, terminated, truncated, _ = env.step(action)
            total, over = total + float(reward), terminated or truncated
    return total / len(SEEDS) / ORBITS


def at_random(rng: np.random.Generator) -> Any:
    """Chooses among what is offered."""

    def choose(_: Any, mask: Any) -> Any:
        return np.array([rng.choice(np.flatnonzero(part)) for part in np.split(mask, [40])])

    return choose


def main() -> None:
    """Checks, learns, compares."""
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    check_env(make())
    envs = DummyVecEnv([make] * 16)
    # Discounts are per decision here; one takes some 150 s, so 0.9 stands for the paper's 0.999 per second.
    model = MaskablePPO("MlpPolicy", envs, n_steps=256, batch_size=512, gamma=0.9, ent_coef=0.01, seed=0, verbose=1)
    before = earned(at_random(np.random.default_rng(0)))
    model.learn(steps)
    after = earned(lambda seen, mask: model.predict(seen, action_masks=mask, deterministic=True)[0])
    print(f"random {before:.2f}, learned {after:.2f} per orbit")
    assert after > 1.2 * before, "it has learned nothing"


if __name__ == "__main__":
    main()
