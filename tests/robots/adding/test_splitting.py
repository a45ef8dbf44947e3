"""Links that pass each other closely: their primitives are split until they let each other pass."""

from pathlib import Path

import numpy as np
import pybullet_data
import pytest
import trimesh

from plancurate import native
from plancurate.robots import load_robot
from plancurate.robots.adding import refining
from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.fitting import fit
from plancurate.robots.adding.model import Model
from plancurate.robots.adding.quality import depth
from plancurate.robots.adding.refining import Surfaces, refined, states_apart
from plancurate.robots.adding.solids import Solid, read_solids
from plancurate.robots.adding.source import read_source
from plancurate.robots.adding.splitting import LOST, Apart, shapes_of, split_where_it_pays
from plancurate.robots.adding.surroundings import surroundings
from plancurate.robots.chain import serial_chain
from plancurate.robots.scene import empty_scene
from plancurate.robots.urdf import read_urdf

LINK = """<link name="link{n}"><inertial><mass value="1"/>
  <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>"""
JOINT = """<joint name="joint{n}" type="revolute"><parent link="link{n}"/><child link="link{m}"/>
  <origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>"""
PAIR = ("link0", "link2")


def block(size, centre):
    return trimesh.creation.box(size).triangles + np.array(centre)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """Two joints about one axis, 1 rad either way."""
    file = tmp_path_factory.mktemp("arm") / "arm.urdf"
    links = "".join(LINK.format(n=n) for n in range(3))
    file.write_text(f'<robot name="arm">{links}{JOINT.format(n=0, m=1)}{JOINT.format(n=1, m=2)}</robot>')
    return Model(serial_chain(read_urdf(file)), (), np.full(2, -1.0), np.full(2, 1.0))


@pytest.fixture(scope="module")
def meshes():
    """A bracket, flat and with a wall behind, and a knob that turns before the wall without ever touching it."""
    bracket = np.concatenate(
        [block((0.4, 0.2, 0.04), (0, 0, 0.02)), block((0.04, 0.2, 0.4), (-0.18, 0, 0.2))]
    )
    return {"link0": bracket, "link2": block((0.1, 0.1, 0.24), (0.05, 0, 0))}


@pytest.fixture(scope="module")
def split(model, meshes):
    """One primitive a link, split; and the states, with what one primitive a link loses of them."""
    rooms = {link: surroundings(triangles) for link, triangles in meshes.items()}
    alone = {link: fit(triangles, 1, rooms[link]) for link, triangles in meshes.items()}
    apart = Apart(model, model.draw(300, 0), [PAIR])
    return split_where_it_pays(alone, rooms, apart), apart, apart.refused(alone).mean()


@pytest.mark.slow
def test_splits_win_back_the_states_in_which_links_pass_each_other(split):
    clusters, apart, lost_before = split
    assert lost_before == 1.0
    assert apart.refused(clusters).mean() <= LOST


def test_a_split_leaves_no_part_of_a_mesh_outside(split, meshes):
    clusters = split[0]
    for link, triangles in meshes.items():
        shapes = shapes_of(clusters)[link]
        points = np.concatenate(
            [triangles.reshape(-1, 3), trimesh.Trimesh(**_mesh(triangles)).sample(2000, seed=0)]
        )
        assert np.max([depth(shape, points) for shape in shapes], axis=0).min() > 0


def _mesh(triangles):
    return {"vertices": triangles.reshape(-1, 3), "faces": np.arange(3 * len(triangles)).reshape(-1, 3)}


@pytest.mark.slow
def test_links_with_the_same_primitives_are_split_each_for_itself(model, meshes):
    room = surroundings(meshes["link0"])
    brackets = fit(meshes["link0"], 1, room)
    knob = fit(meshes["link2"], 1, surroundings(meshes["link2"]))
    rooms = dict.fromkeys(["link0", "link1"], room) | {"link2": surroundings(meshes["link2"])}
    alike = {"link0": brackets, "link1": brackets, "link2": knob}
    found = split_where_it_pays(alike, rooms, Apart(model, model.draw(300, 0), [PAIR]))
    assert len(found["link0"]) > 1
    assert found["link1"] == brackets


@pytest.mark.slow
def test_splits_are_judged_by_states_that_are_free_for_the_meshes(model, meshes):
    bar = block((0.4, 0.02, 0.02), (0.2, 0, 0.05))  # passes over the flat part, and hits the post at -1.1 rad
    solids = {
        "link0": Solid((), np.concatenate([meshes["link0"], block((0.05, 0.05, 0.6), (0.1, -0.2, 0.3))])),
        "link2": Solid((), bar),
    }
    clusters = {
        link: fit(solid.triangles, 3, surroundings(solid.triangles)) for link, solid in solids.items()
    }
    states = model.draw(1000, 0)
    apart = states_apart(model.with_shapes(shapes_of(clusters)), Surfaces(model, solids), states)
    assert apart.pairs == [PAIR]
    turned = states.sum(axis=1)
    hits = np.abs(turned + 1.1) < 0.15
    assert set(apart.states[:, 0]).isdisjoint(states[hits, 0])
    assert len(apart.states) > 0.8 * (~hits).sum()


@pytest.mark.slow
def test_robots_add_splits_what_fitting_again_leaves(model, meshes, monkeypatch):
    monkeypatch.setattr(refining, "ROUNDS", 0)
    solids = {link: Solid((), triangles) for link, triangles in meshes.items()}
    posed = model.with_shapes(refined(model, solids, 1))
    free = native.is_free(posed.of_links(*PAIR), empty_scene().native, model.draw(500, 1))
    assert free.mean() > 0.94


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "file"), [("panda", "franka_panda/panda.urdf"), ("xarm6", "xarm/xarm6_robot.urdf")]
)
def test_the_shipped_robots_lose_few_states_that_their_meshes_allow(name, file):
    robot, findings = load_robot(name), Findings()
    solids = read_solids(read_source(Path(pybullet_data.getDataPath()) / file, findings), (), findings)
    model = Model(robot.chain, robot.shapes, robot.lower, robot.upper)
    apart = states_apart(model, Surfaces(model, solids), model.draw(1000, 5))
    assert len(apart.states) > 500
    assert native.is_free(robot.native, empty_scene().native, apart.states).mean() > 0.94
