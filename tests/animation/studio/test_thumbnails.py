"""Pictures of buttons show bodies and colors, without OpenGL."""

import base64
import io

import numpy as np
from PIL import Image

from arc_suite.animation.studio import thumbnails
from arc_suite.bodies import generator
from arc_suite.models.visuals import VISUALS
from arc_suite.models.visuals.spec import Visuals
from arc_suite.robots.spec import MATERIALS


def test_a_body_is_in_its_picture_in_its_colors():
    body = generator.generate(4, 2).replace(palette="rust")
    prefix, data = thumbnails.body_picture(body).split(",")
    assert prefix == "url(data:image/png;base64"
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(data.removesuffix(")")))))
    assert picture.shape == (56, 84, 4)
    solid = picture[..., 3] > 200
    rows, columns = np.nonzero(solid)
    assert 0.05 < solid.mean() < 0.6
    assert np.ptp(rows) > 40 or np.ptp(columns) > 70  # it fills the picture in one direction
    red, green, blue = picture[solid][:, :3].mean(axis=0)
    assert red > 1.2 * green > 1.2 * blue


def test_a_palette_shows_its_colors_side_by_side():
    picture = thumbnails.palette_picture("moss")
    assert picture.startswith("linear-gradient(to right, rgb(107, 133, 71) 0% 20%, ") and picture.count("rgb") == 5


def test_pictures_show_the_visuals_that_were_registered_last(monkeypatch):
    body = generator.generate(4, 2).replace(name="painted")
    pictures = set()
    for color in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        monkeypatch.setitem(VISUALS, body.name, Visuals(dict.fromkeys(MATERIALS, color)))
        pictures.add(thumbnails.body_picture(body))
    assert len(pictures) == 2
