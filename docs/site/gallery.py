"""Writes what docs/gallery.md shows: `python docs/site/gallery.py [NAME ...]`, some minutes.

That is docs/measured/gallery.json and the pictures in docs/pictures/gallery, of the scenarios NAME
or of all. The pictures are those of `sphshell-pin render`, cut to the middle. MkDocs loads this
file as a hook: the site has the scenario files, too.
"""

import io
import json
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image, ImageOps

from sphshell_pin.base.atomic import write_whole
from sphshell_pin.scenario import run_scenario, shipped_scenarios
from sphshell_pin.scenario.format.schema import Expected
from sphshell_pin.scenario.running.run import RunReport
from sphshell_pin.view.film import Camera, render_film

sys.path.insert(0, str(Path(__file__).parents[2]))  # run as a script, and as a hook of MkDocs
from benchmarks.measured import FOLDER, Measured, write

PICTURES = Path(__file__).parents[1] / "pictures" / "gallery"
SIZE = WIDTH, HEIGHT = 960, 600  # [pixels]
LARGEST = 150_000  # [bytes]: a larger file is written with 256 colors
WIDER = 1.9  # drawn so much wider, for title and legend beside the picture


@dataclass(frozen=True)
class Shot:
    """A scenario, when [s] and from where it is drawn, and the expected figure that is shown.

    The figure is called `what`, in `unit`, that is `factor` times the SI unit. `zoom` enlarges the
    part of the picture about `middle`, a share of its width and height.
    """

    name: str
    time: float
    figure: str
    what: str
    unit: str = ""
    factor: float = 1.0
    camera: Camera = "fit"
    zoom: float = 1.0
    middle: tuple[float, float] = (0.5, 0.5)

    def draw(self, run: RunReport) -> bytes:
        """Return the picture (.png)."""
        size = round(WIDER * self.zoom * WIDTH), round(self.zoom * HEIGHT)
        with tempfile.TemporaryDirectory() as folder:
            drawn = render_film(
                Path(folder) / "drawn.png",
                run.result,
                run.built.scene,
                run.built.visual_model,
                time=self.time,
                size=size,
                camera=self.camera,
                chart=False,
            )
            with Image.open(drawn) as image:
                left, top = (
                    round(at * whole - part / 2)
                    for at, whole, part in zip(self.middle, size, SIZE, strict=True)
                )
                cut = image.convert("RGB").crop((left, top, left + WIDTH, top + HEIGHT))
        stream = io.BytesIO()
        cut.save(stream, "png", optimize=True)
        if stream.tell() > LARGEST:
            stream = io.BytesIO()
            few = ImageOps.posterize(cut, 6).quantize(256, dither=Image.Dither.NONE)
            few.save(stream, "png", optimize=True)
        return stream.getvalue()

    def card(self, run: RunReport) -> str:
        """Return the picture with its figure, command and scenario, as Markdown."""
        title = run.built.scenario.title
        verdict = next(one for one in run.verdicts if one.figure == self.figure)
        measured = f"{self.what} **{self.shown(verdict.measured)}**"
        expected = self.expected(run.built.scenario.expect[self.figure])
        file = f"[{self.name}.toml](../scenarios/{self.name}.toml)"
        return "<br>".join(
            (
                f"![{title}](pictures/gallery/{self.name}.png)",
                f"**{title}**",
                f"{measured}, expected {expected}",
                f"`sphshell-pin run {self.name}` ({file})",
            )
        )

    def expected(self, bound: Expected) -> str:
        """Return what is expected, in words."""
        if bound.value is None:
            word, limit = ("at least", bound.min) if bound.max is None else ("at most", bound.max)
            return f"{word} {self.shown(limit or 0.0)}"
        within = f"{100 * bound.rtol:.3g} %" if bound.rtol else self.shown(bound.atol)
        return f"{self.shown(bound.value)} within {within}"

    def shown(self, value: float) -> str:
        """Return a value with four digits and its unit."""
        return f"{self.factor * value:.4g} {self.unit}".strip()


SHOTS = (
    Shot("fingertip_on_blade", 5.9, "pairs.tip-blade.mean_force", "mean force", "N"),
    Shot("peg_in_bore", 0.08, "final.v.root_joint.2", "velocity along the bore", "m/s", zoom=1.3),
    Shot("ball_in_seat", 1.0, "figures.least_force", "least of the three forces", "N", zoom=1.4),
    Shot(
        "allegro_lift",
        6.0,
        "figures.carried_weight",
        "weight on friction",
        "N",
        camera="contact",
        zoom=1.15,
    ),
    Shot(
        "polished_valve",
        9.0,
        "figures.depth",
        "mean depth removed",
        "nm",
        camera="follow",
        zoom=1.3,
    ),
    Shot(
        "ball_on_turntable",
        3.0,
        "figures.orbit_ratio",
        "speed of the orbit over the table's",
        zoom=1.25,
    ),
    Shot("cam_and_follower", 0.3, "figures.lift", "lift", "mm", 1e3, zoom=1.1, middle=(0.5, 0.46)),
    Shot(
        "oblique_impact", 0.00504, "figures.across", "speed across after the blow", "m/s", zoom=1.25
    ),
    Shot("rattleback", 2.855, "figures.turned", "turns round at", "s", zoom=1.3),
    Shot("sphere_on_shell", 0.75, "figures.swing_period", "period of the rolling", "s", zoom=1.15),
    Shot("allegro_hand_object", 1.5, "figures.carried_weight", "weight carried", "N"),
    Shot("gear_contact", 0.3, "figures.tooth_force", "force between the teeth", "N"),
)


def on_files(files: Any, config: Any) -> Any:
    """Add the scenario files to the site: called by MkDocs."""
    from mkdocs.structure.files import File

    for path in shipped_scenarios().values():
        content = path.read_text(encoding="utf-8")
        files.append(File.generated(config, f"scenarios/{path.name}", content=content))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Let links to the scenario files of the repository lead to those of the site."""
    return markdown.replace("](../scenarios/", "](scenarios/")


def main(*names: str) -> None:
    """Run and draw the scenarios with these names, by default all, and write the figures."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    data = json.loads((FOLDER / "gallery.json").read_text(encoding="utf-8")) if names else {}
    kept = data["sections"][0]["notes"] if names else []
    cards = []
    for shot in SHOTS:
        path = PICTURES / f"{shot.name}.png"
        if names and shot.name not in names:
            cards += [card for card in kept if f"/{path.name})" in card]
            continue
        with tempfile.TemporaryDirectory() as folder:
            run = run_scenario(shot.name, Path(folder) / shot.name, recording=False)
        cards.append(shot.card(run))
        write_whole(path, shot.draw(run))
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB", flush=True)
    print(write("gallery", "python docs/site/gallery.py", [Measured(notes=cards)]))


if __name__ == "__main__":
    main(*sys.argv[1:])
