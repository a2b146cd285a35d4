"""The report: each table and figure with the paper's numbers beside it, and how it was made."""

from __future__ import annotations

from collections.abc import Callable

from gough.paper import published
from gough.paper.claims import claims
from gough.paper.markdown import NOTHING, milliseconds, number, page, percent, table
from gough.paper.results import STAGES
from gough.paper.study import BATCH, SUMS, Study, with_workspace_of
from gough.whole_file import write_whole

TITLE = "The DisGNet paper's experiments, run again"
DISCUSSION, PAGE = "discussion.md", "report.html"


def write(study: Study) -> None:
    """Write index.md and report.html into the study's folder; the figures must be there."""
    text = "\n\n".join(part(study) for part in PARTS) + "\n"
    write_whole(study.folder / "index.md", text.encode())
    write_whole(study.folder / PAGE, page(text, TITLE, study.folder).encode())


def introduction(study: Study) -> str:
    """Introduction: data, training, and what the numbers are."""
    plan, unit = study.plan, _unit(study)
    return f"""# {TITLE}

Platform `{study.platform.name}`, lengths in {unit}. Numbers in columns headed "paper" are those
printed in Zhu et al., *DisGNet: A Distance Graph Neural Network for Forward Kinematics Learning of
Gough-Stewart Platform*: 1200 epochs of training, and times of one RTX 3090. It does not print the
joints of its platform, so absolute errors need not agree; what can be compared is what it claims
about methods. Everything else on this page was computed by `gough paper`, and can be computed
again: `gough paper --stage NAME -o FOLDER --networks NETWORKS` repeats one table from the networks,
with the same accuracy figures to the last digit. Times differ. "{NOTHING}" stands where the paper
has no number.

**Data.** The full training set is the first {plan.rows:,} rows of `gough dataset --seed
{plan.seed}`, the others the first 90 and 80 % of these. Errors are means over {plan.test:,}
held-out poses that no training saw, from a seed of their own. Workspace: {_box(study, "full")}.

**Training.** Every network got the same budget, {plan.budget:g} s of processor time on one thread,
by the same recipe: SOAP, batches of {BATCH}, a rate that falls to zero; plain-mlp with its mean
squared error, all others with the paper's loss. The budget was turned into a number of steps by
timing each network's step on an otherwise idle machine, so that a training can be repeated bit for
bit on a machine of the same kind."""


def claims_part(study: Study) -> str:
    """The paper's claims, each with a yes or no."""
    rows = [(c.claim, c.paper, c.here, "yes" if c.holds else "**no**") for c in claims(study)]
    discussion = study.folder / DISCUSSION
    words = discussion.read_text().strip() if discussion.exists() else ""
    head = ("claim", "paper", "here", "holds here")
    return f"## The paper's claims\n\n{table(head, rows)}\n\n{words}".strip()


def networks(study: Study) -> str:
    """Table I."""
    unit = _unit(study)
    result = study.result("networks")
    head = ("first guess", "numbers", "paper", f"E-trans {unit}", "paper", "E-rot deg", "paper",
            f"E-ik {unit}", "paper", f"worst {unit}", "true pose %", "1000 guesses ms",
            "paper (GPU)")  # fmt: skip
    rows = []
    for row in result["rows"]:
        paper = published.TABLE.get(row["name"])
        theirs = (
            (number(paper.parameters, 2), paper.trans, paper.rot, paper.ik,
             milliseconds(paper.seconds)) if paper else (NOTHING,) * 5
        )  # fmt: skip
        rows.append((
            row["name"], f"{row['parameters'] or 0:,}", theirs[0],
            number(row["trans_mean"]), theirs[1], number(row["rot_mean"]), theirs[2],
            number(row["ik_mean"]), theirs[3], number(row["trans_worst"]),
            percent(row["true"] / row["count"], 3), milliseconds(row["thousand_seconds"]),
            theirs[4],
        ))  # fmt: skip
    steps = [(name, f"{n:,}", number(_epochs(study, n)), number(_trained(result, name), 3))
             for name, n in study.plan.steps.items()]  # fmt: skip
    return "\n\n".join([
        "## First guesses",
        "E-rot is the angle between the two rotations: the paper's formula, the Frobenius norm of "
        "the logarithm, is sqrt(2) times that, but its tables agree with each other only if they "
        "hold the angle. \"True pose\" is where Newton with exact inverses and no second try ends.",
        table(head, rows), _made(study, "networks"),
        "Steps that the budget allowed. Seconds are the processor time that the trainings took, on "
        "a machine that did other work too:",
        table(("network", "steps", "epochs of the full set", "seconds"), steps),
    ])  # fmt: skip


def sets(study: Study) -> str:
    """The supplement's table of training sets."""
    result = study.result("sets")
    unit = _unit(study)
    at = {t: i for i, t in enumerate(result["thresholds"])}
    head = ("network", "rows", f"median {unit}", "paper", f"mean {unit}", "paper",
            f"< 0.5 {unit} %", "paper", f"< 1 {unit} %", "paper")  # fmt: skip
    turn = ("network", "rows", "median deg", "paper", "mean deg", "paper", "< 0.5 deg %", "paper",
            "< 1 deg %", "paper")  # fmt: skip
    trans, rot = [], []
    for row in result["rows"]:
        paper = published.SETS[row["set"]].get(row["name"], (NOTHING,) * 8)
        name = (row["name"], f"{row['rows']:,}")
        axis = row["axis"]
        trans.append(_beside(name, (number(axis["median"]), number(axis["mean"]),
                                    percent(axis["within"][at[0.5]]),
                                    percent(axis["within"][at[1.0]])), paper[:4]))  # fmt: skip
        rot.append(_beside(name, (number(row["rot_median"]), number(row["rot_mean"]),
                                  percent(row["rot_within"][at[0.5]]),
                                  percent(row["rot_within"][at[1.0]])), paper[4:]))  # fmt: skip
    return "\n\n".join([
        "## Full, 90 % and 80 % training sets",
        "Translation, as absolute error along each axis. The paper does not say so, but its means "
        "here are half its E-trans (0.75 and 1.45 mm for DisGNet, and so for every network), as "
        "errors along one axis are to their norm; read as norms, the two tables would contradict "
        "each other.",
        table(head, trans), "Rotation, as angle.", table(turn, rot), _made(study, "sets"),
    ])  # fmt: skip


def methods(study: Study) -> str:
    """Table II."""
    result = study.result("methods")
    head = ("method", "average time ms", "paper", "success %", "paper", "singular N_1",
            "imprecise N_2", "another mode")  # fmt: skip
    rows = []
    for row in result["rows"]:
        time, success = published.METHODS.get(row["name"], (NOTHING, NOTHING))
        solved = 1 - (row["singular"] + row["imprecise"]) / row["count"]
        rows.append((row["name"], milliseconds(row["average_seconds"]), time, percent(solved),
                     success, row["singular"], row["imprecise"], row["wrong"]))  # fmt: skip
    return "\n\n".join([
        "## Two-stage methods",
        f"W = {study.plan.solved:,} held-out poses, gamma = {result['gamma']:g}; the average time "
        "is that of both stages divided by W, on this CPU. The success rate is the paper's, "
        "1 - (N_1 + N_2) / W; poses that converged to another assembly mode, which the paper does "
        "not count, stand apart. `gough.solve` always goes to rounding.",
        table(head, rows), _made(study, "methods"),
    ])  # fmt: skip


def iterations(study: Study) -> str:
    """The supplement's table of iterations."""
    result = study.result("iterations")
    head = ["method", "counted"]
    for gamma in result["gammas"]:
        head += [f"gamma {gamma:g}", "paper"]
    head += ["unsolved"]
    rows = []
    for row in result["rows"]:
        paper = published.ITERATIONS.get(row["name"], (NOTHING,) * 3)
        pairs = [cell for pair in zip((f"{n:,}" for n in row["iterations"]),
                                      (_count(p) for p in paper), strict=True)
                 for cell in pair]  # fmt: skip
        unsolved = " / ".join(str(n) for n in row["unsolved"])
        rows.append((row["name"], row["counts"], *pairs, unsolved))
    return "\n\n".join([
        "## Number of iterations",
        f"Over {study.plan.solved:,} held-out poses. One sample at a time, iterations are summed "
        "over the samples; batched, the sweeps of the whole batch are counted, as the paper does. "
        "\"Unsolved\" are the rows without an answer at the three levels.",
        table(head, rows), _made(study, "iterations"),
    ])  # fmt: skip


def wide(study: Study) -> str:
    """The wide workspace."""
    result = study.result("wide")
    unit = _unit(study)
    head = ("first guess", f"E-trans {unit}", "E-rot deg", f"worst {unit}", "true pose %",
            "another mode %", "of these twins", "no end %", "`gough.solve` wrong")  # fmt: skip
    same = [(*_guess_cells(row), row["solve_wrong"]) for row in result["same"]]
    ends = ("first guess", "success %", "singular %", "another mode %", "scaled: success %",
            "singular %", "another mode %")  # fmt: skip
    second = [
        (row["name"], *_success_cells(row["batched"]), *_success_cells(row["scaled"]))
        for row in result["same"]
    ]
    every = [(*_guess_cells(row), row["solve_wrong"]) for row in result["all"]]
    return "\n\n".join([
        "## A wide workspace",
        f"{_box(study, 'wide')}. In the paper's workspace Newton's method reaches the true pose "
        "from every seed; here seeds differ. First over the poses that are reached without "
        "crossing a singularity (det J of home's sign), which the networks were trained on. Twins "
        "are poses of this workspace whose readings belong to another such pose as well: no "
        "function of the readings can be right for both.",
        table(head, same),
        "Then over all poses of the box, beyond singularities too, where readings alone do "
        "not determine the pose:",
        table(head, every),
        f"The batched method from the same guesses, over the first "
        f"{result['same'][0]['batched']['count']:,} poses of the first table, gamma = 0.0001. Its "
        "limit here is the inverse, which 20 iterations do not always reach; with lengths in units "
        "of the platform's size (\"scaled\", not in the paper) they do.",
        table(ends, second), _made(study, "wide"),
    ])  # fmt: skip


def figures(study: Study) -> str:
    """All figures with their captions."""
    gamma = study.result("times")["gamma"]
    parts = ["## Figures"]
    for name, words, stage in (
        ("accuracy", "Error accuracy of DisGNet on held-out poses while it trains.", "curves"),
        ("training", "E-trans and E-rot of all networks while they train on the full set, each for "
                     "the same processor time.", "curves"),
        ("newton_times", f"Time of the second stage alone from DisGNet's guesses, gamma = "
                         f"{gamma:g}: one sample at a time, and batched.", "times"),
        ("two_stage_times", f"Time of both stages, gamma = {gamma:g}.", "times"),
        ("solved_poses", "Eight held-out poses after both stages (dashed plate, thin legs) over "
                         "the true ones (filled plate, thick legs), gamma = 0.0001; above each the "
                         "error of the guess and what is left.",
         "poses"),
        ("error_histograms", "Errors of the first guesses, and after the second stage.", "errors"),
    ):  # fmt: skip
        parts += [f"![{words}](figures/{name}.svg)", words, _made(study, stage)]
    return "\n\n".join(parts)


def provenance(study: Study) -> str:
    """Command, commit and machine of each number, and the sums of the networks."""
    rows = []
    for stage in STAGES:
        made = study.result(stage)["made"]
        commit = (made["commit"] or "unknown")[:12]
        machine = f"{made['processor']}, {made['cores']} cores"
        rows.append((f"`{made['command']}`", f"`{commit}`", study.plan.seed, machine,
                     made["torch"], made["numpy"]))  # fmt: skip
    head = ("command", "commit", "seed", "machine", "torch", "numpy")
    sums = [(f"`{path}`", f"{known['bytes']:,}", f"`{known['sha256'][:16]}`")
            for path, known in study.known_sums().items()]  # fmt: skip
    return "\n\n".join([
        "## How each was made", table(head, rows),
        "The networks, which `gough paper --stage train` makes again; `--networks FOLDER` takes "
        f"them from where they are kept. The whole sums stand in `{SUMS}`.",
        table(("network", "bytes", "SHA-256, first 16 digits"), sums),
    ])  # fmt: skip


def _guess_cells(row: dict) -> tuple:
    count = row["count"]
    return (row["name"], number(row["trans_mean"]), number(row["rot_mean"]),
            number(row["trans_worst"]), percent(row["true"] / count, 3),
            percent(row["other"] / count, 3), row["twins"],
            percent(row["unconverged"] / count, 3))  # fmt: skip


def _success_cells(end: dict) -> tuple:
    """Success rate, singular rows, and solved ones of another mode, in per cent."""
    count = end["count"]
    shares = (1 - (end["singular"] + end["imprecise"]) / count, end["singular"] / count,
              end["wrong"] / count)  # fmt: skip
    return tuple(percent(share, 2) for share in shares)


def _beside(name: tuple, ours: tuple, paper: tuple) -> tuple:
    """Our cells, each followed by the paper's."""
    return (*name, *(cell for pair in zip(ours, paper, strict=True) for cell in pair))


def _made(study: Study, stage: str) -> str:
    made = study.result(stage)["made"]
    return (f"*`{made['command']}`, commit {(made['commit'] or 'unknown')[:12]}, seed "
            f"{study.plan.seed}, {made['processor']} with {made['cores']} cores.*")  # fmt: skip


def _epochs(study: Study, steps: int) -> float:
    return steps * BATCH / study.plan.rows_of("full")


def _trained(result: dict, name: str) -> float:
    return next(row["training_seconds"] for row in result["rows"] if row["name"] == name)


def _count(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:,}"


def _unit(study: Study) -> str:
    return study.platform.unit or "unit"


def _box(study: Study, name: str) -> str:
    """Description of the workspace of one of the SETS."""
    box = with_workspace_of(study.platform, name).workspace
    assert box is not None
    unit = _unit(study)
    shifts = ", ".join(f"{low:g} to {high:g}" for low, high in box.translation)
    turns = ", ".join(f"{low:g} to {high:g}" for low, high in box.rotation_deg)
    return f"translations from home {shifts} {unit}, Euler angles {turns} deg"


PARTS: tuple[Callable[[Study], str], ...] = (
    introduction, claims_part, networks, sets, methods, iterations, wide, figures, provenance,
)  # fmt: skip
