"""A planner of one's own against those of the package, on the same missions."""

from __future__ import annotations

from statistics import mean

import numpy as np
import swath


class Patient:
    """Takes the best priority per second among the strips whose windows are open after a transition.

    It slews for longer when the strip that it was at last failed: wheels that are fast leave less torque to turn with.
    """

    def __init__(self) -> None:
        self.t_pre_s = 80.0

    def decide(self, context: swath.Context) -> swath.Image | swath.Wait:
        """Decides what to do next."""
        if context.previous is None:
            self.t_pre_s = 80.0
        elif context.previous["strip"] is not None:
            step = -1.0 if context.previous["success"] else 5.0
            self.t_pre_s = float(np.clip(self.t_pre_s + step, 60.0, 110.0))
        start_s = context.now_s + self.t_pre_s
        reachable = (context.window_open_s <= start_s) & (start_s <= context.window_close_s)
        if not reachable.any():
            return swath.Wait(20.0)
        worth = np.where(reachable, context.priority / (self.t_pre_s + context.t_acq_s), 0.0)
        return swath.Image(int(worth.argmax()), self.t_pre_s)


if __name__ == "__main__":
    names = ["heuristic:80", "Patient", "lookahead"]
    episode = {"orbits": 3.0, "scenario": {"count": [3000, 3000]}}
    scores = swath.evaluate(["heuristic:80", Patient(), "lookahead"], seeds=range(4), episode=episode)
    for name, own in zip(names, scores, strict=True):
        print(f"{name:<14} {mean(score['reward_per_orbit'] for score in own):6.2f} per orbit")
