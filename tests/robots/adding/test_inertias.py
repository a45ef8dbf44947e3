import xml.etree.ElementTree as ET

import numpy as np

from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.inertias import read_inertial
from plancurate.robots.shapes import Shape

SIX = "ixx='0.0248674' ixy='-0.0043065' ixz='-0.000678' iyy='0.0048555' iyz='0.0045725' izz='0.0238783'"
LINK = f"<link><inertial><origin xyz='0 -0.2 0'/><mass value='1.7'/><inertia {SIX}/></inertial></link>"


def test_an_inertia_that_breaks_the_triangle_inequality_by_rounding_is_mended_and_stays_what_it_is():
    moments = np.linalg.eigvalsh(
        [[0.0248674, -0.0043065, -0.000678], [-0.0043065, 0.0048555, 0.0045725], [-0.000678, 0.0045725, 0.0238783]]
    )  # fmt: skip
    low, middle, high = moments
    assert 0.99 * high < low + middle < high
    shape, findings = Shape("box", (0.1, 0.3, 0.1), np.eye(4)), Findings()
    found = read_inertial("link2", ET.fromstring(LINK), [shape], findings)
    assert found is not None
    assert findings.notes == []
    mended = np.linalg.eigvalsh(found.inertia)
    assert mended[2] < mended[0] + mended[1]  # else PyBullet takes zero
    np.testing.assert_allclose(mended, moments, atol=0.005 * high)
