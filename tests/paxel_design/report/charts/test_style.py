"""Charts: the same however often, and wherever, they were drawn before."""

import io

import matplotlib

from paxel_design.report.charts import new_figure, settle, style


def test_a_settled_chart_stays_where_it_is_however_often_it_is_drawn() -> None:
    with matplotlib.rc_context(style()):
        figure = new_figure(60)
        left, right = figure.subplots(1, 2, width_ratios=[1, 2])
        left.set_aspect("equal")
        left.set_ylabel("cycles per mm, up")
        right.set_yscale("log")
        right.plot([0, 1], [1e-4, 10], label="lines of the print")
        right.legend()
        settle(figure)
        places = [axes.get_position().bounds for axes in figure.axes]
        for kind in ("svg", "pdf", "svg"):
            figure.savefig(io.BytesIO(), format=kind)
        assert [axes.get_position().bounds for axes in figure.axes] == places
