"""Train a linear policy in Gymnasium for ten seconds: it learns to hover by roll and pitch alone.

$ python train.py
...
learnt: reward of 150 steps ...
"""

import time

import gymnasium
import numpy as np

TIME_S, CANDIDATES, BEST, STEPS = 10.0, 256, 16, 150

environments = gymnasium.make_vec(
    "mambo_nmpc.adapters.gymnasium:MamboNmpc-v0",
    num_envs=CANDIDATES,
    vectorization_mode="vector_entry_point",  # all drones are simulated together
    action="attitude",
    trajectory="hover",
)


def scores(weights: np.ndarray, seed: int) -> np.ndarray:
    """Return the rewards (n,) of policies, whose actions are weights (n, 2, 15) times the observations."""
    observation, _ = environments.reset(seed=seed)
    total, flies = np.zeros(CANDIDATES), np.ones(CANDIDATES, bool)
    for step in range(STEPS):
        actions = np.einsum("nij,nj->ni", weights, observation)
        observation, reward, crashed, _, _ = environments.step(np.clip(actions, -1.0, 1.0))
        total += np.where(flies, reward - crashed * (STEPS - step), 0.0)
        flies &= ~crashed
    return total


rng = np.random.default_rng(0)
mean, spread, end, generation = np.zeros((2, 15)), np.full((2, 15), 0.5), time.monotonic() + TIME_S, 0
while time.monotonic() < end:  # the cross-entropy method
    tried = mean + spread * rng.standard_normal((CANDIDATES, 2, 15))
    found = scores(tried, seed=generation)
    best = tried[np.argsort(found)[-BEST:]]
    mean, spread, generation = best.mean(axis=0), best.std(axis=0) + 0.01, generation + 1

all_alike = np.ones((CANDIDATES, 1, 1))
before, after = (scores(all_alike * one, seed=1000).mean() for one in (np.zeros((2, 15)), mean))
print(f"{generation} generations of {CANDIDATES} policies")
word = "learnt" if after > before else "not learnt"
print(f"{word}: reward of {STEPS} steps {after:.0f}, without a policy {before:.0f}")
