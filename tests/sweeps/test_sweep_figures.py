"""Figures of a run: which are drawn, from which numbers."""

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import xarray as xr
from toy_run import make_run

from experiments.figures.__main__ import main
from hrcjax.sweeps.figures import (
    analysis_figures,
    best_and_worst,
    draw_run,
    metric_figure,
    paths_figure,
    trade_off_figure,
    zones_figure,
)
from hrcjax.sweeps.knob_figures import knobs_figure, setting_figure, values_along
from hrcjax.sweeps.store import open_run
from hrcjax.sweeps.summary import best_table, ranking, select

ALL = [
    "knobs", "line-ranges", "metric-bending-energy", "metric-clearance", "metric-length", "metric-score", "pareto", "paths",
    "sensitivity", "zones",
]  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    axes = ["K_att=log:0.01:0.1:4", "K_rep=lin:0.1:1:3", "zeta=2,4"]
    return make_run(tmp_path_factory.mktemp("run") / "r", "--seed", "0", "1", "--grid", *axes)


@pytest.fixture
def results(run: Path) -> xr.Dataset:
    with open_run(run) as ds:
        return ds.load()


def test_ranking_by_definition(results: xr.Dataset) -> None:
    mean = results.score.values.mean(axis=(0, 1, 2)).ravel()
    assert ranking(results, "score").tolist() == np.argsort(-mean, kind="stable").tolist()
    length = results.length.values.mean(axis=(0, 1, 2)).ravel()
    np.testing.assert_array_equal(length[ranking(results, "length")], np.sort(length))


def test_failed_settings_rank_last_and_missing_ones_at_the_end(results: xr.Dataset) -> None:
    best, second = ranking(results, "score")[:2]
    at = np.unravel_index(best, (4, 3, 2))
    changed = results.copy(deep=True)
    changed.status[(0, 0, 1, *at)] = 1  # in one of two worlds
    assert ranking(changed, "score")[-1] == best
    changed.score[(0, 0, 0, *np.unravel_index(second, (4, 3, 2)))] = np.nan
    assert ranking(changed, "score")[-2:].tolist() == [best, second]
    assert best_and_worst(changed, "score")["worst"] == best


def test_table_shows_the_best_in_order(results: xr.Dataset) -> None:
    head, *rows = best_table(results, "length", 3).splitlines()
    assert head.split()[:5] == ["k_att", "k_rep", "zeta", "length", "[m]"]
    assert [row.split()[0] for row in rows] == ["1", "2", "3"]
    best = select(results, int(ranking(results, "length")[0]))
    assert rows[0].split()[4] == f"{float(best.length.mean()):.4g}"
    assert len({len(line) for line in (head, *rows)}) == 1
    assert rows[0].split()[-1] == "no"


def test_heat_maps_hold_the_means_over_worlds(results: xr.Dataset) -> None:
    figure = metric_figure(results, "length")
    mesh = figure.axes[1].collections[0]
    expected = results.length.sel(zeta=4).mean(("scene", "person", "seed"))
    np.testing.assert_allclose(mesh.get_array(), expected.transpose("k_rep", "k_att"), rtol=1e-6)
    assert "mean over 2 worlds" in figure.get_suptitle()
    star = figure.axes[0].lines or figure.axes[1].lines
    best = select(results, int(ranking(results, "length")[0]))
    np.testing.assert_allclose(star[0].get_xydata()[0], [best.k_att, best.k_rep])


def test_heat_maps_hatch_what_failed_in_some_world(results: xr.Dataset) -> None:
    changed = results.copy(deep=True)
    changed.status[0, 0, 1, 2, 1, 0] = 1
    figure = metric_figure(changed, "length")
    hatched = [[part for part in axes.collections if part.get_gid() == "failed"] for axes in figure.axes[:2]]
    (cell,) = hatched[0][0].get_paths()
    assert cell.contains_point([float(results.k_att[2]), float(results.k_rep[1])]) and not hatched[1]


def test_a_fourth_axis_is_at_its_best_value(results: xr.Dataset) -> None:
    bare = results[["score", "status"]].drop_vars(["time", "frame", "xyz"], errors="ignore")
    wide = bare.expand_dims(speed=[1.0, 2.0], axis=-1).copy(deep=True)
    wide.speed.attrs["parameter"] = "field.speed"
    wide["score"] = wide.score * xr.DataArray([1.0, 2.0], dims="speed")
    wide.score.attrs.update(results.score.attrs)
    figure = metric_figure(wide, "score")
    assert "at speed = 2" in figure.get_suptitle()
    expected = wide.score.sel(zeta=2, speed=2).mean(("scene", "person", "seed"))
    np.testing.assert_allclose(figure.axes[0].collections[0].get_array(), expected.transpose("k_rep", "k_att"))


def test_paths_are_those_of_the_best_and_the_worst(results: xr.Dataset) -> None:
    figure = paths_figure(results, "score")
    assert figure is not None
    order = ranking(results, "score")
    lines = {line.get_label().split(":")[0]: line for line in figure.axes[0].lines}
    for which, at in (("best", order[0]), ("worst", order[-1])):
        tool = select(results, int(at)).tool.values[0, 0, 0]
        np.testing.assert_array_equal(lines[which].get_xydata(), tool[:, :2])
    assert {"best, planned", "worst, planned", "start", "goal"} <= set(lines)


def test_zones_are_those_of_the_best_and_the_worst(results: xr.Dataset) -> None:
    figure = zones_figure(results, "score")
    assert figure is not None
    order = ranking(results, "score")
    shown = figure.axes[0].collections[0].get_array()
    for row, at in zip(shown, (order[0], order[-1]), strict=True):
        np.testing.assert_array_equal(row, select(results, int(at)).zone.values[0, 0, 0])
    np.testing.assert_array_equal(figure.axes[1].lines[0].get_xdata(), results.time)


def test_separation_trace_goes_before_the_metric_of_that_name(results: xr.Dataset) -> None:
    named = results.rename(separation="separation_t")
    named["separation"] = named.score
    figure = zones_figure(named, "score")
    assert figure is not None
    best = select(named, int(ranking(named, "score")[0]))
    np.testing.assert_array_equal(figure.axes[1].lines[0].get_ydata(), best.separation_t.values[0, 0, 0])


def test_figures_that_need_what_is_not_there_are_left_out(results: xr.Dataset) -> None:
    bare = results.drop_vars(["tool", "plan", "zone", "length"])
    assert list(analysis_figures(bare, "score", None)) == []
    assert paths_figure(bare, "score") is None
    assert zones_figure(bare, "score") is None
    assert trade_off_figure(bare, "score") is None


def test_paths_along_a_knob_differ_in_it_alone(results: xr.Dataset) -> None:
    figure = knobs_figure(results, "score")
    assert figure is not None
    best = select(results, int(ranking(results, "score")[0]))
    panels = {axes.get_title(): axes for axes in figure.axes}
    assert len([title for title in panels if title]) == 4 + 3 + 2
    at = results.isel(scene=0, person=0, seed=0).sel(k_rep=best.k_rep.item(), zeta=best.zeta.item())
    for value in results.k_att.values:
        star = "★ " if value == float(best.k_att) else ""
        axes = panels[f"{star}$K_{{att}}$ = {value:.3g}"]
        np.testing.assert_allclose(axes.lines[1].get_xydata(), at.sel(k_att=value).tool.values[:, :2])


def test_a_setting_beside_the_best(results: xr.Dataset) -> None:
    figure = setting_figure(results, "score", {"k_att": 0.045, "zeta": 2.1})
    best = select(results, int(ranking(results, "score")[0]))
    one = results.isel(scene=0, person=0, seed=0).sel(k_att=results.k_att[2].item(), k_rep=best.k_rep.item(), zeta=2)
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    np.testing.assert_allclose(lines["this setting"].get_xydata(), one.tool.values[:, :2])
    np.testing.assert_allclose(lines["the best one"].get_xydata(), best.tool.values[0, 0, 0][:, :2])
    assert f"score {float(one.score):.3g}" in figure.get_suptitle() or int(one.status)
    with pytest.raises(KeyError, match="no swept parameter gain; there are: k_att, k_rep, zeta"):
        setting_figure(results, "score", {"gain": 1.0})


def test_values_along_an_axis_hold_the_ends_and_the_best() -> None:
    assert values_along(4, 2) == [0, 1, 2, 3] and values_along(1, 0) == [0]
    for base in range(16):
        at = values_along(16, base)
        assert at[0] == 0 and at[-1] == 15 and base in at and len(at) == 5 and at == sorted(set(at))


@pytest.mark.slow
def test_all_figures_are_written(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(run), "--by", "length"]) == 0
    files = sorted((run / "figures").iterdir())
    assert [file.stem for file in files] == [name for name in ALL if name != "metric-score"]
    assert capsys.readouterr().out.split() == [str(run / "figures" / f"{f.stem}.png") for f in sorted_as_drawn(files)]
    for file in files:
        image = matplotlib.image.imread(file)
        assert image.shape[1] > 600 and image[..., :3].std() > 0.01


def sorted_as_drawn(files: list[Path]) -> list[Path]:
    order = ["metric-length", "metric-bending-energy", "metric-clearance", "pareto", "paths", "zones"]
    order += ["knobs", "sensitivity", "line-ranges"]
    return sorted(files, key=lambda file: order.index(file.stem))


@pytest.mark.parametrize(
    "options",
    [
        ["--grid", "zeta=lin:2:5:4"],
        ["--grid", "zeta=3"],
        ["--grid", "zeta=5,2", "k_att=0.1,0.01"],
        ["--grid", "k_att=log:0.01:0.1", "zeta=lin:2:4", "--sobol", "8"],
        ["--grid", "zeta=lin:2:4", "--sobol", "8"],
    ],
)
def test_every_shape_of_sweep_can_be_drawn(tmp_path: Path, options: list[str]) -> None:
    with open_run(make_run(tmp_path / "r", *options)) as results:
        figure = metric_figure(results, "length")
        figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
        assert figure.axes[0].lines or figure.axes[0].collections
        if options[1] == "zeta=5,2":
            mesh = figure.axes[0].collections[0]
            expected = results.length.sortby(["zeta", "k_att"]).squeeze().transpose("k_att", "zeta")
            np.testing.assert_array_equal(mesh.get_array(), expected)


def test_mistakes_get_one_line(tmp_path: Path, run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for options, message in (
        ([str(tmp_path)], "holds no run"),
        ([str(run), "--by", "beauty"], "beauty: no such metric; accepted: score, length"),
        ([str(run), "--metric", "beauty"], "beauty: no such metric"),
        ([str(run), "--mtric", "beauty"], "close: --metric"),
    ):
        assert main(options) == 2
        error = capsys.readouterr().err
        assert error.startswith("error: ") and message in error and error.count("\n") == 1


def test_without_a_name_the_newest_run_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([]) == 2
    assert "no finished run under runs/" in capsys.readouterr().err
    drawn = []
    monkeypatch.setattr("experiments.figures.__main__.draw_run", lambda folder, *_: drawn.append(folder) or [])
    (tmp_path / "runs" / "a").mkdir(parents=True)
    (tmp_path / "runs" / "a" / "results.nc").write_bytes(b"")
    assert main([]) == 0 and drawn == [Path("runs/a")]


def test_draw_run_returns_its_files(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import hrcjax.sweeps.figures as figures

    monkeypatch.setattr(figures, "replace_file", lambda path, _: None)
    assert sorted(path.stem for path in draw_run(run)) == ALL
