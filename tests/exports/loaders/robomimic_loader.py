"""Load an exported HDF5 with robomimic as its training script does, in an environment that has robomimic.

Prints what it found as JSON: argument 1 is the file, argument 2 the filter key.
"""

from __future__ import annotations

import json
import sys

import robomimic.utils.file_utils as file_utils
import robomimic.utils.obs_utils as obs_utils
from robomimic.config import config_factory
from robomimic.utils.train_utils import load_data_for_training

path, key = sys.argv[1:]
config = config_factory("bc")
with config.unlocked():
    config.train.data = path
    config.train.hdf5_filter_key = key
    config.train.hdf5_load_next_obs = True
    config.train.seq_length = 4
    config.observation.modalities.obs.low_dim = ["joint_positions", "target_offset"]
    config.observation.modalities.goal.low_dim = []
obs_utils.initialize_obs_utils_with_config(config)
environment = file_utils.get_env_metadata_from_dataset(path)
shapes = file_utils.get_shape_metadata_from_dataset(path, all_obs_keys=["joint_positions", "target_offset"])
loaded, _ = load_data_for_training(config, obs_keys=shapes["all_obs_keys"])
first = loaded[0]
print(
    json.dumps(
        {
            "environment": environment,
            "shapes": shapes["all_shapes"],
            "action_dimension": shapes["ac_dim"],
            "demos": loaded.demos,
            "sequences": len(loaded),
            "first": {
                "actions": first["actions"].tolist(),
                **{name: values.tolist() for name, values in first["obs"].items()},
                **{f"next_{name}": values.tolist() for name, values in first["next_obs"].items()},
            },
        },
        default=list,
    )
)
