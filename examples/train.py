"""Train a linear policy in Gymnasium, in some ten seconds: it learns to hover by roll and pitch alone.

$ python train.py
learnt: reward of 150 steps ...
"""

import gymnasium
import numpy as np

GENERATIONS, CANDIDATES, BEST, STEPS = 20, 128, 12, 150

environments = gymnasium.make_vec(
    "mambo_nmpc.adapters.gymnasium:MamboNmpc-v0",
    num_envs=CANDIDATES,
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
mean, spread = np.zeros((2, 15)), np.full((2, 15), 0.5)
for generation in range(GENERATIONS):  # the cross-entropy method
    tried = mean + spread * rng.standard_normal((CANDIDATES, 2, 15))
    found = scores(tried, seed=generation)
    best = tried[np.argsort(found)[-BEST:]]
    mean, spread = best.mean(axis=0), best.std(axis=0) + 0.01

all_alike = np.ones((CANDIDATES, 1, 1))
before, after = (scores(all_alike * one, seed=1000).mean() for one in (np.zeros((2, 15)), mean))
word = "learnt" if after > before else "not learnt"
print(f"{word}: reward of {STEPS} steps {after:.0f}, without a policy {before:.0f}")
