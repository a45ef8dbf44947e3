"""Load an exported folder with LeRobot, unchanged and off line, in an environment that has lerobot.

Prints what it found as JSON: argument 1 is the folder, argument 2 the selection.
"""

from __future__ import annotations

import json
import sys

from lerobot.datasets.lerobot_dataset import LeRobotDataset, LeRobotDatasetMetadata

folder, selection = sys.argv[1:]
metadata = LeRobotDatasetMetadata("local/exported", root=folder)
kept = [number for number, keep in enumerate(metadata.episodes[f"kept/{selection}"]) if keep]
whole = LeRobotDataset("local/exported", root=folder)
part = LeRobotDataset(
    "local/exported",
    root=folder,
    episodes=kept,
    delta_timestamps={"action": [step / metadata.fps for step in range(4)]},
)
frames = [part[k] for k in range(len(part))]
print(
    json.dumps(
        {
            "fps": metadata.fps,
            "tasks": sorted({frame["task"] for frame in frames}),
            "episodes": kept,
            "ids": [metadata.episodes["trajectory_id"][number] for number in kept],
            "whole": [whole.num_episodes, whole.num_frames],
            "part": [part.num_episodes, part.num_frames],
            "episode_index": [int(frame["episode_index"]) for frame in frames],
            "state": [frame["observation.state"].tolist() for frame in frames],
            "environment": list(frames[0]["observation.environment_state"].shape),
            "action": frames[0]["action"].tolist(),
            "mean": metadata.stats["observation.state"]["mean"].tolist(),
        }
    )
)
