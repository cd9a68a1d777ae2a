// Curves on the timeline's axis: attitude error while imaging, the wheels' speeds, and resources where there are some.

import { effect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { percents } from "./resources";
import { hasResources, shown, span, version, world } from "./store";
import { stamp } from "./time";
import { GUTTER } from "./timeline";

interface Curve {
  label: string;
  colour: string;
  /** Told apart by more than colour where several are of one kind. */
  dash?: number[];
}

interface PlotProps {
  title: string;
  curves: Curve[];
  data: () => uPlot.AlignedData;
}

/** What the simulator has of them: the ground knows only what comes down. */
const RESOURCES: Curve[] = [
  { label: "battery (truth)", colour: "#f0e442" },
  { label: "storage (truth)", colour: "#56b4e9", dash: [8, 3] },
  { label: "momentum of its limit (truth)", colour: "#cc79a7", dash: [2, 3] },
];

const HEIGHT = 86;
/** Width of a plot's name, which stands beside its axis [px]. */
const LABEL = 18;

function options(title: string, curves: Curve[], width: number): uPlot.Options {
  const grid = { stroke: "#1b2b3a", width: 1 };
  return {
    width,
    height: HEIGHT,
    padding: [8, 0, 4, 0],
    cursor: { drag: { setScale: false, x: false, y: false }, sync: { key: "time" }, points: { size: 5 } },
    legend: { show: true, live: true, markers: { width: 0, fill: (_, i) => curves[i - 1]?.colour ?? "#9fb4c7" } },
    scales: { x: { time: true, auto: false, range: () => span.value.map((t) => t / 1000) as [number, number] } },
    axes: [
      { show: false },
      { stroke: "#9fb4c7", grid, size: GUTTER - LABEL, label: title, labelSize: LABEL, labelFont: "11px system-ui", font: "11px system-ui" },
    ],
    series: [
      { label: "time", value: (_, value) => (value == null ? "" : stamp(value * 1000)) },
      ...curves.map((curve) => ({ label: curve.label, stroke: curve.colour, dash: curve.dash, width: 1.4, points: { show: false }, value: (_: uPlot, value: number | null) => (value == null ? "" : value.toPrecision(3)) })),
    ],
  };
}

function Plot({ title, curves, data }: PlotProps) {
  const place = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const target = place.current!;
    const plot = new uPlot(options(title, curves, target.clientWidth), data(), target);
    let asked = 0;
    const stop = effect(() => {
      version.value;
      shown.value;
      span.value;
      if (!asked)
        asked = requestAnimationFrame(() => {
          asked = 0;
          plot.setData(data());
        });
    });
    const watch = new ResizeObserver(() => plot.setSize({ width: target.clientWidth, height: HEIGHT }));
    watch.observe(target);
    return () => {
      stop();
      watch.disconnect();
      cancelAnimationFrame(asked);
      plot.destroy();
    };
  }, []);
  return <div class="plot" ref={place} />;
}

/** The part of a list, ordered by time, that the axis shows and that has happened. */
function shownPart<T extends { t: number }>(list: readonly T[]): T[] {
  const [from, to] = span.value;
  const end = Math.min(to, shown.value);
  return list.filter(({ t }) => t >= from && t <= end);
}

export function Plots() {
  const error = () => {
    const part = shownPart(world.value.status);
    return [part.map(({ t }) => t / 1000), part.map((it) => (it.phase === 0 ? null : it.error))] as uPlot.AlignedData;
  };
  const wheels = () => {
    const part = shownPart(world.value.wheels);
    return [part.map(({ t }) => t / 1000), ...[0, 1, 2].map((axis) => part.map((it) => it.rpm[axis] ?? null))] as uPlot.AlignedData;
  };
  const resources = () => {
    const part = shownPart(world.value.resources);
    return [part.map(({ t }) => t / 1000), ...percents(part)] as uPlot.AlignedData;
  };
  return (
    <>
      <Plot title="‖σ‖" curves={[{ label: "attitude error", colour: "#e69f00" }]} data={error} />
      <Plot
        title="rpm"
        curves={[
          { label: "wheel x", colour: "#56b4e9" },
          { label: "wheel y", colour: "#f0e442" },
          { label: "wheel z", colour: "#cc79a7" },
        ]}
        data={wheels}
      />
      {hasResources.value && <Plot title="% · truth" curves={RESOURCES} data={resources} />}
    </>
  );
}
