"""Pictures stand in the page itself, and the reason stands there where one can't be made."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from typing import Any

import numpy as np
import PIL.Image
import pytest

from plancurate.errors import PlancurateError
from plancurate.robots import load_world
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.pictures.drawing import Line
from plancurate.tasks.pictures.shot import BAD, GOOD, Run, Shot
from plancurate.tasks.pictures.solids import tool_path
from plancurate.tasks.report import build_report
from plancurate.tasks.report.contents import Section
from plancurate.tasks.report.page import page
from plancurate.tasks.report.pictures import SIZE, figure_of, rollout_note, study_pictures
from plancurate.tasks.study.results import study_results


@pytest.mark.slow
def test_the_page_holds_a_picture_with_its_thin_lines_in_their_colours(small_lake: Lake, maker: Any) -> None:
    study = maker.record("tiny", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", "S.")
    robot, scene = load_world("h2017", "free")
    turned = np.array([[turn, *robot.home[1:]] for turn in np.linspace(-0.9, 0.9, 40)])
    line = Line(tool_path(robot, turned), "#1a7f37", 3.0)
    figure = figure_of(
        "picture", "One", lambda _: "", lambda: [Shot(robot, scene, lines=(line,), title="<arm>")]
    )
    text = page(build_report(study_results(small_lake, study), Section("pictures", "Pictures", "", [figure])))
    (data,) = re.findall(r'<image [^>]*href="data:image/png;base64,([^"]*)"', text)
    with PIL.Image.open(io.BytesIO(base64.b64decode(data))) as image:
        assert image.size == SIZE
        colours = image.convert("RGB").getcolors(SIZE[0] * SIZE[1])
    assert sum(count for count, (red, green, _) in colours if green > red + 40) > 200
    assert 'aria-label="&lt;arm&gt;"' in text


def test_the_reason_stands_where_a_picture_can_t_be_made() -> None:
    def gone() -> list[Shot]:
        raise PlancurateError("the network is gone")

    figure = figure_of("picture", "Rollouts", lambda _: "What one sees.", gone)
    assert figure.note == "Not shown: the network is gone."
    assert not figure.pictures


def test_a_rollout_alone_says_that_every_other_ended_like_it() -> None:
    robot, scene = load_world("h2017", "free")
    reached, lost = (Shot(robot, scene, (Run(np.arange(2.0), np.zeros((2, 6)), c),)) for c in (GOOD, BAD))
    assert rollout_note([reached]).endswith("every tested rollout reaches its target.")
    assert rollout_note([replace(lost, title="BC_MLP on General")]).endswith(
        "There is one alone, of BC_MLP on General: every tested rollout fails."
    )
    assert "the same target" in rollout_note([reached, lost])


@pytest.mark.slow
def test_a_study_that_would_be_another_one_now_has_no_pictures(small_lake: Lake, maker: Any) -> None:
    study = maker.record("tiny", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", "S.")
    section = study_pictures(Home(small_lake.root.parent), study_results(small_lake, study))
    assert section.text.startswith("There are none: study tiny-aaaaaaaa: its robot, scenes or the package")
    assert not section.figures
