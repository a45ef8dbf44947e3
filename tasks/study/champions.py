"""The champion of each policy of a study: a network that only one which is better beyond chance replaces.

Every network of the policy challenges it on the unseen targets that both were tested on (McNemar's exact test). The
p values are adjusted for the number of challengers (Holm): the best of many is above the champion by chance often.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from plancurate.tasks.study import text
from plancurate.tasks.study.against import SURE
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.evaluations import evaluation_id
from plancurate.tasks.study.mlflow_models import champion, set_champion
from plancurate.tasks.study.mlflow_records import StudyRun, model_name
from plancurate.tasks.study.network_cells import cell_of_network, cell_of_row
from plancurate.tasks.study.networks import wanted_networks
from plancurate.tasks.study.rows import ResultRow
from plancurate.tasks.study.selections import study_selections
from plancurate.tasks.study.statistics import Outcomes, holm
from plancurate.tasks.study.trial_results import network_rows

Tested = dict[str, ResultRow]
"""How each network of one pool and policy did at unseen targets, by evaluation id."""


@dataclass(frozen=True)
class Challenge:
    """A network against the champion on the unseen targets that both were tested on."""

    evaluation_id: str
    challenger: Outcomes
    champion: Outcomes
    p: float
    """Of McNemar's exact test, two-sided."""


def crown_networks(study: StudyContext, run: StudyRun) -> list[str]:
    """Move champions where a network is better, and say so in a line each; first ones and those that stay are named.

    A policy without a champion gets its most successful network. Nothing happens without tests at unseen targets.
    """
    moved: list[str] = []
    named: dict[str, list[str]] = {"first champions": [], "champions that stay": []}
    for (pool, policy), tested in tested_at_unseen(study).items():
        name = champion_name(study, study.pool(pool), policy)
        known = champion(run.uri, name)
        if known is None:
            set_champion(run, name, *first_champion(name, tested))
            named["first champions"].append(name)
        elif won := winner(challenges(study, study.pool(pool), policy, known)):
            moved.append(succession(name, won, tested[won.evaluation_id]))
            set_champion(run, name, won.evaluation_id, moved[-1])
        else:
            named["champions that stay"].append(name)
    return moved + [f"{what}: {', '.join(names)}" for what, names in named.items() if names]


def first_champion(name: str, tested: Tested) -> tuple[str, str]:
    """Return the evaluation id of the most successful network, and why it is the champion of that name."""
    best = max(tested, key=lambda key: (tested[key].success_rate, tested[key].settled_rate))
    row = tested[best]
    return best, (
        f"champion {name} is {title(row)}, the first: {text.percent(row.success_rate)} % of {row.n} unseen tests"
    )


def succession(name: str, won: Challenge, row: ResultRow) -> str:
    """Say why a network is the champion of that name from now on."""
    return (
        f"champion {name} is now {title(row)}: {text.percent(won.challenger.rate)} instead of "
        f"{text.percent(won.champion.rate)} % of {won.challenger.n} unseen tests, {text.p_value(won.p)} (paired)"
    )


def winner(challenges: Sequence[Challenge]) -> Challenge | None:
    """Return the most successful challenger that is better than the champion beyond chance, its p adjusted; or None."""
    adjusted = holm([one.p for one in challenges])
    better = [
        Challenge(one.evaluation_id, one.challenger, one.champion, p)
        for one, p in zip(challenges, adjusted, strict=True)
        if one.challenger.successes > one.champion.successes and p < SURE
    ]
    return max(better, key=lambda one: one.challenger.rate, default=None)


def challenges(study: StudyContext, pool: PoolContext, policy: str, champion: str) -> list[Challenge]:
    """Put every network of a pool and policy against the champion, by its evaluation id; none without common tests."""
    rows = study.lake.query(
        "study/challengers", challenger=study.study, policy=policy, champion=champion, **pool.partition
    ).to_pylist()
    return [
        Challenge(
            row["evaluation_id"],
            Outcomes(row["successes"], row["n"]),
            Outcomes(row["champion_successes"], row["n"]),
            row["p"],
        )
        for row in rows
    ]


def tested_at_unseen(study: StudyContext) -> dict[tuple[str, str], Tested]:
    """Return how the networks did at unseen targets after the last round of corrections, by pool and policy."""
    rows = {cell_of_row(row): row for row in network_rows(study.lake, study.study, "unseen")}
    found: dict[tuple[str, str], Tested] = {}
    for network in wanted_networks(study, study_selections(study)) if rows else []:
        row = rows.get(cell_of_network(study, network))
        if row and network.round == study.config.corrections.rounds and network.cluster is None:
            of_policy = found.setdefault((network.selection.pool, network.policy), {})
            of_policy[evaluation_id(study, network)] = row
    return found


def champion_name(study: StudyContext, pool: PoolContext, policy: str) -> str:
    """Name the registered model of a policy, such as `quick-BC_RNN`, or `quick-table-BC_RNN` of several pools."""
    where = [pool.title] if len(study.pools) > 1 else []
    return model_name(study.config.name, *where, policy)


def title(row: ResultRow) -> str:
    """Name a network within its policy for a person."""
    return f"{row.name} seed {row.seed}"
