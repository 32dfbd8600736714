"""What a dataset is collected with: its id and its provenance."""

import json

import minari
from datasets import QUEEN, SPIDER

from arc_suite import data
from arc_suite.envs.setup import Setup


def test_ids_by_default_are_minaris():
    named = {
        "arc_suite/queen/walk/cpg-refined-v0": data.DatasetSettings(QUEEN),
        "arc_suite/spider/walk/cpg-straight-v0": data.DatasetSettings(SPIDER),
        "arc_suite/tick/steer/cpg-steered-v0": data.DatasetSettings(Setup.of("tick", "steer")),
        "arc_suite/tick/steer/random-v0": data.DatasetSettings(Setup.of("tick", "steer"), "random", ()),
        "arc_suite/queen/walk/cpg-medium-fast-noise0_1-v0": data.DatasetSettings(
            QUEEN, presets=("medium", "fast"), noise=0.1
        ),
        "arc_suite/spider/walk/my_package_policies_make-50steps-v0": data.DatasetSettings(
            SPIDER, "my_package.policies:make", (), steps=50
        ),
        "arc_suite/queen/walk/cpg-refined-set59ccfc0d-v0": data.DatasetSettings(
            Setup.of("queen", "walk", {"arena": "bumps"})
        ),
    }
    for dataset_id, settings in named.items():
        assert settings.dataset_id() == dataset_id
        minari.dataset.minari_dataset.parse_dataset_id(dataset_id)


def test_ids_tell_settings_apart():
    def dataset_id(**task_kwargs):
        return data.DatasetSettings(Setup.of("queen", "walk", task_kwargs)).dataset_id()

    ids = {dataset_id(), dataset_id(gait="wave"), dataset_id(gait="ripple"), dataset_id(target_velocity=0.4)}
    assert len(ids) == 4
    assert dataset_id(gait="wave", target_velocity=0.4) == dataset_id(target_velocity=0.4, gait="wave")
    assert dataset_id(healthy_range=(0.2, 1.0)) == dataset_id(healthy_range=[0.2, 1.0])


def test_provenance_is_plain_and_tells_what_episodes_depend_on():
    settings = data.DatasetSettings(Setup.of("queen", "walk", {"healthy_range": (0.2, 1.0)}), presets=("slow", "tuned"))
    provenance = settings.provenance()
    assert json.loads(json.dumps(provenance)) == provenance
    assert provenance["task_kwargs"] == {"healthy_range": [0.2, 1.0]}
    slow, tuned = provenance["presets_sha256"]
    assert len(slow) == len(tuned) == 64 and slow != tuned
