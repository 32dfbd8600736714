"""Answers to flags of other programs and libraries, which no flag of the suite replaces."""

from arc_suite.robots.field_hints import CHARACTER_CURE

_RESUME = "the same command goes on where it was interrupted"
_DEVICE = "learners compute on the device of JAX; see docs/gpu.md"
_WINDOW = "arc-suite view alone opens a window"
_AMOUNT = "programs have one amount of output; 2>/dev/null hides progress and warnings"
_FORM = "arc-suite build_model --torso, --head and --tail, with --json, writes a spec for --spec"
CURES = {
    **dict.fromkeys(("continue", "resume"), _RESUME),
    **dict.fromkeys(("cpu", "cuda", "device", "gpu", "use_gpu"), _DEVICE),
    **dict.fromkeys(("gui", "headless", "no_render", "nogui", "offscreen"), _WINDOW),
    **dict.fromkeys(("debug", "log_level", "quiet", "silent", "verbose", "verbosity"), _AMOUNT),
    **dict.fromkeys(("alsologtostderr", "logtostderr", "stderrthreshold"), _AMOUNT),
    **dict.fromkeys(("character", "mood", "personality", "temperament"), CHARACTER_CURE),
    **dict.fromkeys(("deterministic", "stochastic"), "the policy of a run acts by its mean action"),
    **dict.fromkeys(("render", "render_mode"), "arc-suite render films a policy, arc-suite view shows it"),
    **dict.fromkeys(("head", "tail", "torso"), _FORM),
    "flagfile": "write its flags into the command; arc-suite train --config takes the configuration of a run",
    "gravity": "environment.change_model sets it, see docs/environments.md",
    "list": "--help lists the names that flags take",
    "name": "arc-suite build_model --name NAME --json writes a spec with a name of its own",
    "overwrite": "files are written over; a run goes on in its folder",
}
# Those of programs that have --output.
CURES_OF_OUTPUTS = {"format": "the extension of the output is its format"}
# Values out of the range of a flag, which something else takes.
CURES_OF_VALUES = {
    ("legs", "3"): "a body of 3 legs is a spec, --spec=FILE",
    **{("seeds", count): "more seeds are a study of one's own, docs/study.md" for count in ("4", "5", "8", "10", "20")},
}
# Flags whose values a shell changes, unless they are quoted.
CURES_OF_MISSING_VALUES = {"palette": "a shell drops what follows a #: quote the colors, --palette='#3a5f2b'"}

_BALLAST = "docs/bodies.md: heads, tails and ballast"
_COUNT_OF_BODIES = "--bodies bounds the search"
_TRACKERS = "arc-suite train has --tensorboard and --wandb, for a run of --config"
_CHECKPOINTS = "a run saves its policy at each evaluation, see --evaluate_every"
_FILM = "arc-suite render films the policy of a run, arc-suite view shows it"
_FURTHER = "--algorithm finetune --hp start=RUN trains the policy of a run further"
_ID = "--id names a dataset; datasets lie in ~/.minari/datasets, or where MINARI_DATASETS_PATH points"
_FOLDER_OF_RUN = "--output names the folder of the run"
_LENGTHS = "--length NAME=FACTOR stretches links, and arc-suite build_model --scale all lengths"
_FILES_OF_PAGE = "buttons of the page save files"
_CARD = "the card is README.md in the folder of the run"
_CLIPS = "arc-suite animate writes clips, with --clips, --weight and --size"
_TASK_OF_PAGE = "a page has the task of its policy"
_WANDB = "Weights & Biases reads variables: WANDB_PROJECT, WANDB_ENTITY, WANDB_MODE, next to --wandb"
_STUDY_OF_DIVISION = "arc-suite study DIVISION-ALGORITHM makes the same runs, and has --submit and --shard"
_NO_BACKGROUND = "arc-suite animate --transparent writes a picture of a clip without a background"
CURES_OF_PROGRAMS = {
    "animate": {
        "frames": "a clip lasts a whole cycle; --fps sets its pictures",
        "loop": "clips of a gait are loops",
        "scale": _LENGTHS,
        "style": "did you mean --weight? it takes a character: heavy, nervous or old",
    },
    "benchmark": {
        **dict.fromkeys(("tensorboard", "wandb"), _TRACKERS),
        "steps": "a division has its steps; arc-suite train has --steps",
        **dict.fromkeys(("hours", "partition", "shard", "submit"), _STUDY_OF_DIVISION),
        "robot": "--places takes robots with their tasks, such as tick-walk",
    },
    "build_model": dict.fromkeys(("ballast", "density", "mass"), _BALLAST),
    "card": dict.fromkeys(("o", "output"), _CARD),
    "check": {"fix": "arc-suite studio --spec FILE has a button for the value that fits"},
    "collect": {
        **dict.fromkeys(("dataset", "dir", "name", "o", "out", "output", "output_dir", "path", "save"), _ID),
        "format": "datasets have Minari's format",
    },
    "completion": {
        **dict.fromkeys(("o", "output"), "its output goes into a file by > FILE"),
        "install": "its output goes into a file; see --help",
    },
    "design": {
        "spec": "did you mean --around?",
        "robot": "did you mean --around?",
        "legs": "the search chooses legs; --around keeps those of a creature",
        "minutes": _COUNT_OF_BODIES,
        "n": _COUNT_OF_BODIES,
        "t": _COUNT_OF_BODIES,
    },
    "doctor": {"fix": "its lines say what to do"},
    "evaluate": {
        "home": "arc-suite import has --home",
        "scale": _LENGTHS,
        "seeds": "--episodes counts on from --seed: --seed=0 --episodes=10 are seeds 0 to 9",
    },
    "play": {
        **dict.fromkeys(("clips", "size", "weight"), _CLIPS),
        **dict.fromkeys(("set", "task"), _TASK_OF_PAGE),
        "mode": "the end of the page's address says it, page.html#mode=goals",
        "open": "a browser shows the page",
    },
    "render": {
        "background": _NO_BACKGROUND,
        "i": "did you mean --spec or --policy?",
        "r": "did you mean --fps?",
        "size": "did you mean --width and --height?",
        "t": "did you mean --steps?",
        "transparent": _NO_BACKGROUND,
        "y": "files are written over",
    },
    "studio": dict.fromkeys(("o", "output"), _FILES_OF_PAGE),
    "study": {
        **dict.fromkeys(("tensorboard", "wandb"), _TRACKERS),
        "seeds": "a study has its seeds; arc-suite benchmark has --seeds",
    },
    "train": {
        **dict.fromkeys(("checkpoint_every", "checkpoint_freq", "save_every", "save_freq"), _CHECKPOINTS),
        **dict.fromkeys(("save_interval", "save_model"), _CHECKPOINTS),
        **dict.fromkeys(("capture_video", "play", "record_video", "render", "video", "view", "watch"), _FILM),
        **dict.fromkeys(("checkpoint", "ckpt", "from", "load", "load_run", "load_model", "pretrained"), _FURTHER),
        **dict.fromkeys(("wandb_entity", "wandb_mode", "wandb_name", "wandb_project"), _WANDB),
        **dict.fromkeys(
            ("activation", "optimizer"), "networks and optimizers are of the algorithm; see docs/algorithms.md"
        ),
        **dict.fromkeys(("name", "path"), _FOLDER_OF_RUN),
        "ent_coef": "in its place ppo has --hp initial_std and final_std, sac has --hp target_entropy",
        "vf_coef": "the critic of ppo has a learning rate in its place, --hp value_rate",
        "torch_deterministic": "runs are the same to the last bit on one machine",
    },
    "transfer": dict.fromkeys(("robot", "spec"), "arc-suite evaluate --policy RUN --spec FILE plays one body"),
    "view": dict.fromkeys(("o", "output"), "arc-suite render writes pictures, films and pages"),
}
