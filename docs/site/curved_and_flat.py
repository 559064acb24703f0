"""Writes docs/pictures/curved_and_flat.png: `python docs/site/curved_and_flat.py`.

The main run twice on the same triangles, once curved and once flat, and what the force does.
"""

from pathlib import Path

from sphshell_pin.plot.figure import new_figure, write_figure
from sphshell_pin.scenario import build
from sphshell_pin.scenario.running.run import simulate

PICTURE = Path(__file__).parents[1] / "pictures" / "curved_and_flat.png"
SETTLED = 0.3  # [s], the first touch not counted


def main() -> None:
    """Run both, draw them, print the figures."""
    figure = new_figure(9.0, 3.2)
    axes = figure.add_subplot()
    for method, color, width in (("facets", "#c9302c", 0.9), ("smooth", "#1f5fa8", 2.0)):
        built = build("fingertip_on_blade", {"contact.tip-blade.method": method})
        result, _ = simulate(built)
        force = result.row_columns()["pairs.tip-blade.normal_force [N]"]
        after = force[result.t >= SETTLED]
        said = f"{after.min():.2f} to {after.max():.2f} N from {SETTLED} s on"
        print(f"{method}: {said}, {len(built.shells['blade'].elements)} triangles")
        name = {"facets": 'flat, method = "facets"', "smooth": "curved, the default"}[method]
        axes.plot(result.t, force, color=color, linewidth=width, label=f"{name}: {said}")
    axes.axhline(5.0, color="#101418", linewidth=0.6, linestyle=":")
    axes.set(xlabel="time [s]", ylabel="normal force [N]", xlim=(0.0, result.t[-1]), ylim=(0, None))
    axes.set_title("A press of 5 N along a curve: the same triangles, curved and flat", loc="left")
    axes.legend(loc="lower right")
    write_figure(PICTURE, figure)


if __name__ == "__main__":
    main()
