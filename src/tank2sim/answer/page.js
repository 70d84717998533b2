"use strict";
// Draws the charts of the page, in the colours of the screen, and in light ones for paper and for saved files.
(() => {
  const { light, dark, locale, charts } = JSON.parse(document.getElementById("drawings").textContent);
  const figures = [...document.querySelectorAll("figure")];
  const darkScreen = matchMedia("(prefers-color-scheme: dark)");
  const views = new Map();
  const LEAST_SHRINK = 0.75; // share of their width to which panels side by side may be made smaller
  let turn = 0;

  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  tip.setAttribute("aria-hidden", "true");
  document.body.append(tip);

  function showTip(_handler, event, _item, value) {
    tip.hidden = value === null || value === undefined || value === "";
    if (tip.hidden) return;
    const lines = typeof value === "object" ? Object.entries(value) : [["", value]];
    tip.replaceChildren(...lines.flatMap(([key, text]) => {
      const [name, content] = [document.createElement("span"), document.createElement("b")];
      name.textContent = key;
      content.textContent = String(text);
      return [name, content];
    }));
    const box = tip.getBoundingClientRect();
    const left = event.clientX + 14 + box.width > innerWidth ? event.clientX - box.width - 14 : event.clientX + 14;
    const top = Math.min(event.clientY + 14, innerHeight - box.height - 8);
    tip.style.left = `${Math.max(4, left)}px`;
    tip.style.top = `${Math.max(4, top)}px`;
  }

  // A narrower chart keeps the size of its letters; where both axes have one scale its height and its labels shrink.
  const LEAST_LABEL_PX = 8;

  function shrunk(node, factor, height) {
    const copy = { ...node };
    if (typeof copy.width === "number") copy.width *= factor;
    if (height && typeof copy.height === "number") copy.height *= factor;
    if (height && factor < 1 && ["rim", "words"].includes(copy.mark?.style)) {
      const fontSize = Math.max(LEAST_LABEL_PX, factor * light.style.words.fontSize);
      copy.mark = { ...copy.mark, fontSize };
    }
    for (const key of ["layer", "vconcat", "hconcat", "concat"]) {
      if (copy[key]) copy[key] = copy[key].map((part) => shrunk(part, factor, height));
    }
    if (copy.spec) copy.spec = shrunk(copy.spec, factor, height);
    return copy;
  }

  // The inputs of a chart are outside of its picture, in a form of their own; drawn again, it keeps what was chosen.
  function switches(place) {
    return (charts[place].params ?? []).filter(({ bind }) => bind?.input);
  }

  function chosen(place) {
    const view = views.get(place)?.view;
    return view ? switches(place).map(({ name }) => [name, view.signal(name)]) : [];
  }

  function choose(place, values) {
    const view = views.get(place)?.view;
    for (const [name, value] of values) view?.signal(name, value);
    if (values.length) view?.run();
  }

  function embedded(holder, chart, config, bind) {
    bind?.replaceChildren();
    const looks = { config, formatLocale: locale, renderer: "svg", tooltip: showTip, bind };
    return vegaEmbed(holder, chart, { mode: "vega-lite", actions: false, defaultStyle: false, ...looks });
  }

  // Legends that reach beyond the page leave no room for the chart: their entries then go into fewer columns.
  const LEGEND_COLUMNS = [3, 1];

  function legendsFit(holder, room) {
    const picture = holder.querySelector("svg"); // the style of the page may show it smaller than it is
    const { left, width } = picture.getBoundingClientRect();
    const scale = picture.width.baseVal.value / width;
    const boxes = [...holder.querySelectorAll(".role-legend")].map((legend) => legend.getBoundingClientRect());
    const right = Math.max(...boxes.map((box) => box.right));
    return (right - left) * scale + light.padding <= room;
  }

  function withStackedLegends(config, columns) {
    const { layout, ...legend } = config.legend;
    const top = { ...layout.top, direction: "vertical", margin: 6 };
    return { ...config, legend: { ...legend, columns, layout: { ...layout, top } } };
  }

  function inARow(chart) {
    return Math.min(chart.columns, chart.concat?.length ?? chart.columns); // a row may have room for more panels than there are
  }

  // Panels side by side that are wider than the page: fewer in a row, before they become too small to be read.
  function inFewerColumns(chart, width, room) {
    return { ...chart, columns: Math.max(1, Math.floor((inARow(chart) * room) / width)) };
  }

  // Panels side by side of a chart that says so go under each other, each with the labels of its own axis.
  function withStackedPanels(node) {
    const { hconcat, ...copy } = node;
    if (copy.facet?.column) Object.assign(copy, { facet: copy.facet.column, columns: 1 });
    if (copy.vconcat) copy.vconcat = copy.vconcat.map(withStackedPanels);
    if (hconcat) copy.vconcat = hconcat.map(withLabels);
    return copy;
  }

  function withLabels(node) {
    const copy = { ...node };
    const y = copy.encoding?.y;
    if (copy.layer) copy.layer = copy.layer.map(withLabels);
    if (y?.axis?.labels === false) copy.encoding = { ...copy.encoding, y: { ...y, axis: { ...y.axis, labels: true } } };
    return copy;
  }

  async function draw(place, config) {
    const holder = figures[place].querySelector(".drawing");
    const equal = Boolean(charts[place].usermeta?.equal_scales);
    const choice = figures[place].querySelector(".choice") ?? undefined;
    const kept = chosen(place);
    const room = holder.clientWidth;
    let factor = 1;
    let look = config;
    const columns = [...LEGEND_COLUMNS];
    let chart = charts[place];
    let stacks = Boolean(charts[place].usermeta?.stacks);
    let before = null; // the attempt before, of the same parts: axes and legends keep their width
    for (let attempt = 0; attempt < 8; attempt += 1) {
      views.get(place)?.finalize();
      views.set(place, await embedded(holder, shrunk(chart, factor, equal), look, choice));
      const width = holder.querySelector("svg").width.baseVal.value;
      if (width <= room || room === 0) break;
      if (stacks && room < LEAST_SHRINK * width) {
        chart = withStackedPanels(chart);
        stacks = false;
        before = null;
        continue;
      }
      if (chart === charts[place] && inARow(chart) > 1 && room < LEAST_SHRINK * width) {
        chart = inFewerColumns(chart, width, room);
        before = null;
        continue;
      }
      if (columns.length && !legendsFit(holder, room)) {
        look = withStackedLegends(config, columns.shift());
        before = null;
        continue;
      }
      const growth = before && before.width > width ? (before.width - width) / (before.factor - factor) : width / factor;
      // A second step is short: where a legend holds the width, the growth says nothing of the plot.
      const least = before ? 0.5 : 0.05;
      before = { factor, width };
      factor = Math.max(factor - (width - 0.99 * room) / growth, least * factor);
    }
    choose(place, kept);
    figures[place].querySelector(".tools").hidden = false;
  }

  async function drawAll(config) {
    turn += 1;
    const mine = turn;
    let failed = 0;
    for (let place = 0; place < charts.length && mine === turn; place += 1) {
      try {
        await draw(place, config);
      } catch (error) {
        failed += 1;
        figures[place].querySelector(".drawing").textContent = `This chart cannot be drawn: ${error.message}`;
        console.error(error);
      }
    }
    if (mine === turn) document.documentElement.dataset.charts = failed ? "failed" : "drawn";
  }

  async function save(place, kind) {
    const { view, finalize } = await embedded(document.createElement("div"), charts[place], light);
    for (const [name, value] of chosen(place)) view.signal(name, value);
    await view.runAsync();
    const link = document.createElement("a");
    link.href = await view.toImageURL(kind, kind === "png" ? 2 : 1);
    link.download = `figure-${place + 1}.${kind}`;
    link.click();
    finalize();
  }

  const onScreen = () => drawAll(darkScreen.matches ? dark : light);
  darkScreen.addEventListener("change", onScreen);
  // Paper has no switches: it shows the first choice of each.
  let left = [];
  const folded = [];
  addEventListener("beforeprint", () => {
    folded.push(...document.querySelectorAll("details:not([open])"));
    for (const part of folded) part.open = true;
    left = charts.map((_, place) => chosen(place));
    charts.forEach((_, place) => choose(place, switches(place).map(({ name, value }) => [name, value])));
    if (darkScreen.matches) drawAll(light);
  });
  addEventListener("afterprint", () => {
    for (const part of folded.splice(0)) part.open = false;
    left.forEach((values, place) => choose(place, values));
    if (darkScreen.matches) onScreen();
  });

  let width = innerWidth;
  let waiting = 0;
  addEventListener("resize", () => {
    if (innerWidth === width) return;
    width = innerWidth;
    clearTimeout(waiting);
    waiting = setTimeout(onScreen, 200);
  });
  figures.forEach((figure, place) => {
    figure.querySelector(".choice")?.addEventListener("submit", (event) => event.preventDefault());
    for (const button of figure.querySelectorAll("button")) {
      button.addEventListener("click", () => save(place, button.dataset.save));
    }
  });
  onScreen();
})();
