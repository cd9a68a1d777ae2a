"""An agent that chooses at random, for one episode."""

import gymnasium
import swath  # noqa: F401 (registers the environment)

env = gymnasium.make("Swath/StripImaging-v0", episode={"orbits": 1.0})
observation, info = env.reset(seed=7)
total, over = 0.0, False
while not over:
    action = env.action_space.sample(mask=(info["action_mask"], None))
    observation, reward, terminated, truncated, info = env.step(action)
    total, over = total + float(reward), terminated or truncated
print(f"imaged strips worth {total:.2f} in {info['time_s'] / 60:.0f} minutes")
